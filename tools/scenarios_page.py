"""Write docs/scenarios.md, the list of the scenarios that come with mjspace, from the scenarios.

They are grouped as their laws are in controllers/: a new scenario appears without an edit here.
"""

import warnings
from importlib import import_module
from pathlib import Path

from mjspace.scenario.files import scenario_names, subjects
from mjspace.scenario.loading import load

PAGE = Path(__file__).parents[1] / "docs/scenarios.md"
HEAD = """# What flies

The scenarios that come with mjspace, grouped by the subject of their law. Each ends in a verdict:
where a paper's claim does not hold on the multibody plant, the checks state what does. This page is
written by `python tools/scenarios_page.py` from the scenarios.

```console
$ mjspace list
$ mjspace run detumble-wheels --duration 2 --set checks=[] --out detumble
```

`mjspace info NAME` shows one with every default written out; [each key](scenario.md) can be set on
the command line. Laws and references are listed [with their gains][laws].

[laws]: scenario.md#laws-references-and-estimators-that-come-with-mjspace
"""


def page() -> str:
    """Return the page."""
    subject_of = subjects()
    groups: dict[str, list[str]] = {}
    for name in scenario_names():
        with warnings.catch_warnings(action="ignore"):
            scenario, _ = load(name)
        law = scenario.law.kind
        row = f"| [`{name}`](../mjspace/scenarios/{name}.toml) | {scenario.description} | `{law}` |"
        groups.setdefault(subject_of[name], []).append(row)
    lines = [HEAD]
    for group, rows in sorted(groups.items()):
        subject = (import_module(f"mjspace.controllers.{group}").__doc__ or "").partition("\n")[0]
        lines += [f"## {group.capitalize() if group != 'cmg' else 'CMG'}", "", subject, ""]
        lines += ["| scenario | what it shows | law |", "|---|---|---|", *rows, ""]
    return "\n".join(lines)


if __name__ == "__main__":
    PAGE.write_text(page())
