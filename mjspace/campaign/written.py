"""A scenario written as a folder of its own: with every default, and the user's files."""

from pathlib import Path

from mjspace.runner.output import make_folder
from mjspace.scenario.loading import to_toml
from mjspace.simulation.assembly import Assembly

SCENARIO = "scenario.toml"


def write_scenario(assembly: Assembly, folder: Path) -> Path:
    """Write what is assembled into ``folder``; return the path of the scenario.

    Raises:
        OSError: a file cannot be written.
    """
    scenario = assembly.scenario
    named = (*scenario.kinds.values(), scenario.plant.model)
    make_folder(folder)
    for name, content in assembly.sources.items():
        top, inside, _ = name.partition("/")
        if any(kind.startswith(top + (inside or ":")) for kind in named):
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (folder / name).write_bytes(content)
    path = folder / SCENARIO
    path.write_text(to_toml(scenario))
    return path
