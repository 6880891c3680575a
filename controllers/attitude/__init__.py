"""Attitude control laws with reaction wheels or ideal torques."""
