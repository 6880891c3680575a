"""Pictures and videos of a log, rendered offscreen."""
