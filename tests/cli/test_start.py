"""What a start imports: each command what it needs, and no more."""

import subprocess
import sys

HEAVY = {"matplotlib", "mcap", "mujoco", "numba", "numpy", "scipy"}


def imported_by(code: str) -> set[str]:
    """Return the names of all modules that a new interpreter has after ``code``."""
    code = f"import sys\n{code}\nprint('\\n', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return set(done.stdout.splitlines()[-1].split())


def command(*words: str) -> str:
    return f"from mjspace.cli import app\napp({list(words)}, standalone_mode=False)"


def test_the_package_imports_nothing_that_computes_or_validates() -> None:
    assert not {*HEAVY, "pydantic"} & imported_by("import mjspace")


def test_scenarios_are_listed_without_anything_that_computes_or_validates_them() -> None:
    found = imported_by(command("list"))
    assert not HEAVY & found
    assert "mjspace.scenario.scenario" not in found  # Typer has Pydantic for itself


def test_a_scenario_is_shown_without_the_compiler_and_without_parts_that_it_has_not() -> None:
    found = imported_by(command("info", "contraction-ideal"))
    assert not {"matplotlib", "mcap", "numba", "scipy"} & found
    assert "mjspace.actuators.reaction_wheels" in found
    assert not {"mjspace.actuators.thrusters", "mjspace.environment.orbit"} & found


def test_a_shell_completes_a_scenario_without_anything_that_computes() -> None:
    found = imported_by(
        "import os\n"
        "os.environ |= {'_MJSPACE_COMPLETE': 'complete_bash', 'COMP_CWORD': '2',\n"
        "               'COMP_WORDS': 'mjspace run wheel-p'}\n"
        "from mjspace.cli import app\n"
        "try: app(prog_name='mjspace')\n"
        "except SystemExit: pass\n"
    )
    assert "mjspace.scenario.files" in found
    assert not HEAVY & found
