"""The benchmarks of ``mjspace validate``, one subject a module."""

from importlib import import_module

from mjspace.validation.benchmark import Benchmark

_SUBJECTS = ("torque_free",)

ALL: tuple[Benchmark, ...] = tuple(
    benchmark for name in _SUBJECTS for benchmark in import_module(f"{__name__}.{name}").BENCHMARKS
)
"""In the order of the report."""
