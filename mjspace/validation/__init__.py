"""Measures this MuJoCo, this version, on this machine, against what is known."""
