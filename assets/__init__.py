"""Spacecraft models in MuJoCo's format: parts, and the vehicles composed of them."""
