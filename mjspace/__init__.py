"""mjspace: a spacecraft testbed on MuJoCo physics."""

__version__ = "0.1.0"
