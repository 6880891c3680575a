"""The benchmarks of ``mjspace validate``, one subject a module."""

from importlib import import_module

from mjspace.validation.benchmark import Benchmark

_SUBJECTS = (
    "torque_free",
    "nutation",
    "gravity_gradient",
    "debra_delp",
    "wheels",
    "dual_spin",
    "dampers",
    "flat_spin",
    "yo_yo",
    "boom",
    "b_dot",
    "imbalance",
    "floating_arm",
    "orbits",
    "rocket",
    "double_gimbal",
    "lander_contact",
)

ALL: tuple[Benchmark, ...] = tuple(
    benchmark for name in _SUBJECTS for benchmark in import_module(f"{__name__}.{name}").BENCHMARKS
)
"""In the order of the report."""
