"""Magnetorquers: detumbling and unloading of wheels."""
