"""Robotic arms on satellites."""
