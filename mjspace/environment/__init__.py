"""The environment: gravity, magnetic field, disturbances, and the native callbacks for MuJoCo."""
