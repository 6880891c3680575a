"""The vehicle: composition of its MJCF, mass properties, indices into MuJoCo's arrays, checks."""
