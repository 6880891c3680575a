"""Thousands of attacks on the testbed, made from a seed: kills.

    python tools/attack.py kills --cases 1000 --seed 0

Each case that finds something is printed with its seed. Exit status: 1 if there is one, else 0.
"""

import sys
from itertools import islice
from pathlib import Path
from typing import Annotated

import typer
from rich.progress import track

TESTS = Path(__file__).parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "fuzz")]

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
Cases = Annotated[int, typer.Option(min=1, help="How many.")]
Seed = Annotated[int, typer.Option(help="What they are made from.")]


@app.callback()
def main() -> None:
    """Attack the testbed with cases made from a seed."""


@app.command()
def kills(cases: Cases = 1000, seed: Seed = 0) -> None:
    """Send flights a signal at a random instant, and look at what their logs have lost."""
    import kills

    found = []
    bad = 0
    for name, kill in track(islice(kills.cases(seed), cases), "kills", cases):
        found.append(kills.attempt(kill))
        if found[-1].trouble:
            bad += 1
            print(f"{name}: {found[-1].trouble}", flush=True)
    print(
        f"kills, seed {seed}: {cases} cases, {bad} with trouble; at most "
        f"{max(each.lost for each in found):.2f} s of wall time lost, a request answered after "
        f"{max(each.answered for each in found):.2f} s, {sum(each.verified for each in found)} "
        "periods flown again identically"
    )
    raise typer.Exit(1 if bad else 0)


if __name__ == "__main__":
    app()
