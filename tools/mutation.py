"""Mutation testing: change one thing in a module at a time, and see whether its tests notice.

``python tools/mutation.py [MODULE ...] [--sample N]`` prints each module's kill rate and the
survivors: the changes with which every test of the module still passed. Each of them is a test to
write, or a change that alters nothing. It exits 0 whatever it finds.

Each mutant runs in a fork of this process, which has the large libraries imported already, with the
changed module in place of the file, which is never touched. (mutmut leaves out functions with a
decorator, and cosmic-ray starts a Python for each mutant, which is 3 s here before a test begins.)
"""

import argparse
import ast
import copy
import importlib.machinery
import itertools
import os
import random
import resource
import signal
import sys
import tempfile
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, NamedTuple

# Set before NumPy is imported: no thread may run when this process forks.
os.environ |= {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}

import google.protobuf.descriptor_pb2  # noqa: F401
import matplotlib.pyplot  # noqa: F401
import mcap.reader  # noqa: F401
import mujoco  # noqa: F401
import numba  # noqa: F401
import pydantic  # noqa: F401
import pytest
import rich.table  # noqa: F401
import scipy.integrate
import scipy.optimize
import scipy.spatial.transform  # noqa: F401

ROOT = Path(__file__).resolve().parents[1]
LOG = (
    "log/test_log.py",
    "log/test_log_readers.py",
    "log/test_log_cut.py",
    "log/test_log_digest.py",
)
VALIDATION = ("validation/test_suite.py", "validation/test_report.py", "cli/test_validate.py")
DETERMINATION = (
    "controllers/determination/test_mekf.py",
    "controllers/determination/test_single_frame.py",
    "controllers/determination/test_vector_observations.py",
)
POINTING = ("controllers/references/test_pointing.py", "controllers/references/test_slews.py")
GUARDS = {
    "mjspace/log/background.py": ("log/test_background.py",),
    "mjspace/log/chunk.py": LOG,
    "mjspace/log/digest.py": LOG,
    "mjspace/log/file.py": LOG,
    "mjspace/log/index.py": LOG,
    "mjspace/log/encoding.py": LOG,
    "mjspace/log/reader.py": LOG,
    "mjspace/log/rows.py": (*LOG, "runner/test_log_rates.py"),
    "mjspace/log/schema.py": LOG,
    "mjspace/log/writer.py": LOG,
    "mjspace/runner/flight_log.py": (
        "runner/test_recorder.py",
        "runner/test_log_rates.py",
        "scenario/test_user_files.py",
    ),
    "mjspace/runner/recorder.py": ("runner/test_recorder.py",),
    "mjspace/simulation/recording.py": (
        "simulation/test_recording.py",
        "simulation/test_blocks.py",
        "runner/test_recorder.py",
        "simulation/test_events.py",
    ),
    "mjspace/runner/replay.py": (
        "runner/test_replay.py",
        "test_api.py",
        "scenario/test_user_files.py",
    ),
    "mjspace/runner/checks.py": ("runner/test_checks.py", "runner/test_verdict.py"),
    "mjspace/runner/statistic.py": ("runner/test_checks.py",),
    "mjspace/runner/run.py": (
        "runner/test_verdict.py",
        "runner/test_run.py",
        "runner/test_recorder.py",
    ),
    "mjspace/actuators/faults.py": ("actuators/test_faults.py", "simulation/test_blocks.py"),
    "mjspace/sensors/base.py": ("sensors/test_sensors.py", "sensors/test_data_sheet.py"),
    "mjspace/sensors/fault_kinds.py": ("sensors/test_sensor_faults.py",),
    "mjspace/sensors/gnss.py": ("sensors/test_sun_sensors.py",),
    "mjspace/sensors/horizon.py": ("sensors/test_horizon.py",),
    "mjspace/sensors/linear.py": ("sensors/test_data_sheet.py",),
    "mjspace/sensors/noise.py": ("sensors/test_sensors.py",),
    "mjspace/sensors/sampled.py": (
        *("sensors/test_sensors.py", "sensors/test_data_sheet.py"),
        "sensors/test_sensor_faults.py",
    ),
    "mjspace/sensors/sky.py": ("sensors/test_sun_sensors.py",),
    "mjspace/sensors/star_tracker.py": ("sensors/test_sensors.py", "sensors/test_sun_sensors.py"),
    "mjspace/sensors/suite.py": ("sensors/test_sensors.py", "sensors/test_data_sheet.py"),
    "mjspace/sensors/sun_sensor.py": ("sensors/test_sun_sensors.py",),
    "mjspace/sensors/accelerometer.py": ("sensors/test_accelerometer.py",),
    "mjspace/validation/results.py": VALIDATION,
    "mjspace/validation/suite.py": VALIDATION,
    "mjspace/validation/table.py": VALIDATION,
    "mjspace/validation/meter.py": ("validation/test_stand.py", "validation/test_floating_arm.py"),
    "mjspace/environment/osculating.py": ("environment/test_osculating.py",),
    "controllers/attitude/guarded_feedback.py": ("controllers/attitude/test_guarded_feedback.py",),
    "controllers/determination/error_state.py": DETERMINATION,
    "controllers/determination/mekf.py": DETERMINATION,
    "controllers/determination/samples.py": DETERMINATION,
    "controllers/determination/single_frame.py": DETERMINATION,
    "controllers/determination/vector_observations.py": DETERMINATION,
    "controllers/landing/hazards.py": ("controllers/landing/test_hazards.py",),
    "controllers/landing/lander_pid.py": ("controllers/landing/test_lander_pid.py",),
    "controllers/landing/powered_descent.py": ("controllers/landing/test_powered_descent.py",),
    "controllers/landing/quartic.py": ("controllers/landing/test_quartic.py",),
    "controllers/magnetic/magnetic_pointing.py": (
        "controllers/magnetic/test_magnetic_pointing.py",
    ),
    "controllers/references/double_s.py": ("controllers/references/test_slews.py",),
    "controllers/references/jets.py": POINTING,
    "controllers/references/pointing.py": POINTING,
    "controllers/references/slews.py": ("controllers/references/test_slews.py",),
    "controllers/references/targets.py": POINTING,
    "controllers/references/yaw_steering.py": POINTING,
    "controllers/landing/guidance.py": (
        "controllers/landing/test_descent_plan.py",
        "controllers/landing/test_lander_guidance.py",
    ),
}
"""The modules that carry trust, each with the test files that guard it."""

OPERATORS: dict[type, tuple[type, ...]] = {
    ast.Lt: (ast.LtE, ast.Gt),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.Lt),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
    ast.Add: (ast.Sub,),
    ast.Sub: (ast.Add,),
    ast.Mult: (ast.Div,),
    ast.Div: (ast.Mult,),
    ast.Pow: (ast.Mult,),
    ast.FloorDiv: (ast.Mult,),
    ast.Mod: (ast.Mult,),
    ast.BitAnd: (ast.BitOr,),
    ast.BitOr: (ast.BitAnd,),
    ast.LShift: (ast.RShift,),
    ast.RShift: (ast.LShift,),
    ast.And: (ast.Or,),
    ast.Or: (ast.And,),
}
_PAIRS = ("min max", "any all", "floor ceil", "zeros ones", "sin cos", "argmax argmin", "start end")
NAMES = {a: b for pair in _PAIRS for a, b in (pair.split(), reversed(pair.split()))}


class Mutant(NamedTuple):
    """A changed module."""

    line: int
    last: int
    before: str
    after: str
    tree: ast.Module


def places(source: str) -> list[tuple[int, int]]:
    """Return all that can be changed in a module: the number of the node, and of its change."""
    nodes = enumerate(_code(ast.parse(source)))
    return [(number, change) for number, node in nodes for change, _ in enumerate(_changes(node))]


def mutant(source: str, number: int, change: int) -> Mutant:
    """Return the module with one of its ``places`` changed."""
    tree = ast.parse(source)
    node = next(itertools.islice(_code(tree), number, None))
    line, before = node.lineno, _words(node)
    # Of a statement with a body, the head.
    last = node.body[0].lineno if isinstance(node, ast.If | ast.While) else node.end_lineno
    next(itertools.islice(_changes(node), change, None))()
    ast.fix_missing_locations(tree)
    return Mutant(line, last, before, _words(node), tree)


def _code(node: ast.AST) -> Iterator[Any]:
    """Yield the nodes below ``node`` that say what is done: no annotation, text or decorator."""
    for name, value in ast.iter_fields(node):
        if name in ("annotation", "returns", "decorator_list"):
            continue
        for child in value if isinstance(value, list) else [value]:
            if isinstance(child, ast.AST) and not isinstance(child, ast.JoinedStr):
                if isinstance(child, ast.expr | ast.stmt):
                    yield child
                yield from _code(child)


def _changes(node: Any) -> Iterator[Callable[[], None]]:
    """Yield functions, each of which changes ``node`` in one way."""
    match node:
        case ast.Compare():
            for place, operator in enumerate(node.ops):
                for other in OPERATORS.get(type(operator), ()):
                    yield lambda p=place, o=other: node.ops.__setitem__(p, o())  # type: ignore[misc]
        case ast.BinOp() | ast.AugAssign() | ast.BoolOp():
            for other in OPERATORS.get(type(node.op), ()):
                yield lambda o=other: setattr(node, "op", o())  # type: ignore[misc]
        case ast.UnaryOp(op=ast.USub() | ast.Not() | ast.Invert()):
            yield lambda: _become(node, node.operand)
        case ast.Constant(value=bool()):
            yield lambda: setattr(node, "value", not node.value)
        case ast.Constant(value=int()):
            yield lambda: setattr(node, "value", node.value + 1)
            yield lambda: setattr(node, "value", node.value - 1)
        case ast.Constant(value=float()):
            yield lambda: setattr(node, "value", node.value + 1.0)
            yield lambda: setattr(node, "value", node.value / 2.0 or -1.0)
        case ast.If() | ast.While() | ast.IfExp():
            yield lambda: setattr(node, "test", ast.Constant(False))
            if not isinstance(node, ast.While):
                yield lambda: setattr(node, "test", ast.Constant(True))
        case ast.Return(value=ast.expr()) if not _is_none(node.value):
            yield lambda: setattr(node, "value", ast.Constant(None))
        case ast.Raise() | ast.Expr(value=ast.Call()) | ast.Break() | ast.Continue():
            yield lambda: _become(node, ast.Pass())
        case ast.Assign(targets=[ast.Attribute() | ast.Subscript(), *_]):
            yield lambda: _become(node, ast.Pass())
        case ast.Attribute() if node.attr in NAMES:
            yield lambda: setattr(node, "attr", NAMES[node.attr])
        case ast.Name(ctx=ast.Load()) if node.id in NAMES:
            yield lambda: setattr(node, "id", NAMES[node.id])
        case _:
            pass
    if isinstance(node, ast.AugAssign):
        yield lambda: _become(node, ast.Pass())


def _is_none(node: ast.expr) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def _become(node: Any, other: Any) -> None:
    """Turn a node into another, in its place."""
    node.__class__ = other.__class__
    node.__dict__ = {
        **{k: v for k, v in node.__dict__.items() if k in ("lineno", "col_offset")},
        **{k: v for k, v in other.__dict__.items() if k not in ("lineno", "col_offset")},
    }


def _words(node: ast.AST) -> str:
    text = ast.unparse(ast.fix_missing_locations(copy.deepcopy(node)))
    return text.splitlines()[0][:90]


def _compiled(tree: ast.Module) -> list[ast.FunctionDef]:
    """Return the functions that Numba compiles: no line of them is seen to run."""
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    return [f for f in functions if any("cache=True" in ast.unparse(d) for d in f.decorator_list)]


class Loader(importlib.machinery.SourceFileLoader):
    """Loads one module from a changed tree instead of its file, and finds no other."""

    def __init__(self, name: str, path: Path, tree: ast.Module) -> None:
        super().__init__(name, str(path))
        self.tree = tree

    def get_code(self, fullname: str) -> Any:
        """Return the changed module's code, of which Numba keeps nothing compiled."""
        for node in _compiled(self.tree):
            for decorator in node.decorator_list:
                if isinstance(decorator, ast.Call):
                    decorator.keywords = [k for k in decorator.keywords if k.arg != "cache"]
        return compile(self.tree, self.path, "exec")

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> Any:
        """Return the changed module's spec, and None for every other."""
        if name != self.name:
            return None
        spec = importlib.machinery.ModuleSpec(name, self, origin=self.path)
        spec.has_location = True  # a flight reads the law's file into its log
        return spec


class Watch:
    """A plugin of pytest that finds which lines of a file each test reaches, and how long it takes.

    What runs while tests are collected, or for a fixture that several share, counts for every test.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.now = str(path), ""
        compiled = _compiled(ast.parse(path.read_text()))
        spans = [range(f.lineno, (f.end_lineno or f.lineno) + 1) for f in compiled]
        self.lines: dict[str, set[int]] = {"": set(itertools.chain(*spans))}
        self.seconds: dict[str, float] = {}
        threading.settrace(self._enter)
        sys.settrace(self._enter)

    def _enter(self, frame: Any, event: str, argument: Any) -> Any:
        return self._line if frame.f_code.co_filename == self.path else None

    def _line(self, frame: Any, event: str, argument: Any) -> Any:
        self.lines.setdefault(self.now, set()).add(frame.f_lineno)
        return self._line

    @pytest.hookimpl(hookwrapper=True)
    def pytest_runtest_protocol(self, item: Any) -> Any:
        """Note whose lines come next, and for how long."""
        self.now, began = item.nodeid, time.monotonic()
        yield
        self.seconds[item.nodeid], self.now = time.monotonic() - began, ""

    @pytest.hookimpl(hookwrapper=True)
    def pytest_fixture_setup(self, fixturedef: Any) -> Any:
        """Give what a shared fixture reaches to every test."""
        now = self.now
        if fixturedef.scope != "function":
            self.now = ""
        yield
        self.now = now

    def plan(self) -> dict[int, list[str]]:
        """Return the tests that reach each line, the fastest first; under 0, all of them."""
        order = sorted(self.seconds, key=lambda test: self.seconds[test])
        reached = {n: [t for t in order if n in self.lines.get(t, ())] for n in self._all_lines()}
        return {0: order} | {n: order if n in self.lines[""] else t for n, t in reached.items()}

    def _all_lines(self) -> set[int]:
        return set().union(*self.lines.values())


class Only:
    """A plugin of pytest that runs the named tests alone, in that order."""

    def __init__(self, names: list[str]) -> None:
        self.names = names

    def pytest_collection_modifyitems(self, items: list[Any]) -> None:
        """Leave the chosen tests."""
        known = {item.nodeid: item for item in items}
        items[:] = [known[name] for name in self.names if name in known]


class Unshrunk:
    """A plugin of pytest that spares the search for the smallest example of a failure."""

    def pytest_sessionstart(self) -> None:
        """Choose what hypothesis does, before the tests are imported."""
        from hypothesis import Phase, settings

        phases = (Phase.explicit, Phase.generate)
        settings.register_profile("mutation", phases=phases, derandomize=True, database=None)
        settings.load_profile("mutation")


class Outcome(NamedTuple):
    """What the tests made of a module."""

    passed: bool
    output: str
    plan: dict[int, list[str]]


def tested(module: "Module", tree: ast.Module, names: list[str] | None, limit: float) -> Outcome:
    """Run the tests of those names on a changed module in a fork; for None run all and watch them.

    What takes longer than ``limit`` [s] has failed.
    """
    with tempfile.TemporaryDirectory(prefix="mutant") as folder:
        child = os.fork()
        if not child:
            os.setsid()
            status = 1
            try:
                status = _test(module, tree, names, Path(folder))
            except BaseException:
                traceback.print_exc()
            finally:
                os._exit(status)
        due = time.monotonic() + limit
        while time.monotonic() < due:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                output = (Path(folder) / "output").read_text(errors="replace")
                plan = Path(folder) / "plan"
                return Outcome(
                    os.waitstatus_to_exitcode(status) == 0,
                    output,
                    ast.literal_eval(plan.read_text()) if plan.exists() else {},
                )
            time.sleep(0.01)
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return Outcome(False, f"stopped after {limit:.0f} s", {})


def _test(module: "Module", tree: ast.Module, names: list[str] | None, folder: Path) -> int:
    resource.setrlimit(resource.RLIMIT_FSIZE, (2**30, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_AS, (2**35, resource.RLIM_INFINITY))
    null = os.open(os.devnull, os.O_RDWR)
    output = os.open(folder / "output", os.O_CREAT | os.O_WRONLY)
    for stream, file in enumerate((null, output, output)):
        os.dup2(file, stream)
    os.chdir(ROOT)
    module.forget()
    sys.meta_path.insert(0, Loader(module.name, module.path, tree))
    watch = Watch(module.path) if names is None else None
    options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", f"--basetemp={folder}/tests"]
    status = int(pytest.main([*options, *module.tests], [Unshrunk(), watch or Only(names or [])]))
    if watch is not None:
        sys.settrace(None)
        (folder / "plan").write_text(repr(watch.plan()))
    return status


class Module:
    """A module that carries trust, and the test files that guard it."""

    def __init__(self, place: str) -> None:
        self.place, self.path = place, ROOT / place
        name = ".".join(Path(place).with_suffix("").parts)
        self.name = name if name.startswith("mjspace") else f"mjspace.{name}"
        self.tests = [str(ROOT / "tests" / test) for test in GUARDS[place]]
        self.source = self.path.read_text()

    def forget(self) -> None:
        """Take this module, and all that import it, from what this process has imported."""
        gone = {self.name}
        ours = {
            name: set(_imports(Path(loaded.__file__)))
            for name, loaded in sys.modules.items()
            if name.startswith("mjspace.") and loaded.__file__
        }
        while more := {name for name, needs in ours.items() if needs & gone} - gone:
            gone |= more
        for name in gone & sys.modules.keys():
            package, _, stem = name.rpartition(".")
            vars(sys.modules.get(package, ast)).pop(stem, None)
        for name in gone:
            sys.modules.pop(name, None)

    def examine(self, sample: int, seed: int) -> tuple[int, list[Mutant]]:
        """Return how many mutants were tried, and which of them survived."""
        began = time.monotonic()
        nominal = tested(self, ast.parse(self.source), None, 900.0)
        if not nominal.passed:
            print(f"{self.place}: its tests fail without any change\n{nominal.output}", flush=True)
            return 0, []
        limit = 20.0 + 5.0 * (time.monotonic() - began)
        chosen = places(self.source)
        if sample and sample < len(chosen):
            chosen = sorted(random.Random(f"{seed} {self.place}").sample(chosen, sample))
        survivors = []
        for place in chosen:
            changed = mutant(self.source, *place)
            lines = range(changed.line, changed.last + 1)
            # Of a statement over several lines not each is traced: all tests may reach the others.
            reach = [nominal.plan[n] for n in lines if nominal.plan.get(n)] or [nominal.plan[0]]
            names = [t for t in nominal.plan[0] if any(t in tests for tests in reach)]
            if tested(self, changed.tree, names, limit).passed:
                survivors.append(changed)
        return len(chosen), survivors


def _imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def import_all() -> None:
    """Import what the tests will need, so that each fork has it."""
    for path in sorted([*ROOT.glob("mjspace/**/*.py"), *ROOT.glob("controllers/**/*.py")]):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        of_basilisk = path.stem.startswith("basilisk") and path.stem.endswith("flight")
        unwanted = of_basilisk or path.stem in ("__init__", "__main__")
        if not unwanted and path.parent.name != "dm_env":  # which takes a second, and MuJoCo's log
            importlib.import_module(name if name.startswith("mjspace") else f"mjspace.{name}")


def main() -> None:
    """Examine the modules named on the command line, or all."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("modules", nargs="*", default=list(GUARDS), metavar="MODULE")
    parser.add_argument("--sample", type=int, default=0, help="mutants of a module; 0: all")
    parser.add_argument("--seed", type=int, default=0, help="of the sample")
    arguments = parser.parse_args()
    for module in arguments.modules:
        if module not in GUARDS:
            parser.error(f"{module}: not one of {', '.join(GUARDS)}")
    import_all()
    tried = killed = 0
    for module in arguments.modules:
        began = time.monotonic()
        count, survivors = Module(module).examine(arguments.sample, arguments.seed)
        tried, killed = tried + count, killed + count - len(survivors)
        rate = 100.0 * (1.0 - len(survivors) / max(count, 1))
        took = time.monotonic() - began
        print(f"{module}: {rate:.1f} % of {count} mutants killed ({took:.0f} s)", flush=True)
        for mutant in survivors:
            print(f"  {mutant.line}: {mutant.before}  ->  {mutant.after}", flush=True)
    print(f"together: {100.0 * killed / max(tried, 1):.1f} % of {tried} mutants killed")


if __name__ == "__main__":
    main()
