"""Array code taken down once as calls of NumPy's inner loops, and run again without Python."""
