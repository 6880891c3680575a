"""Draw the rooms of mjspace and who imports whom, from the imports in the code.

``python tools/rooms.py`` writes docs/rooms.svg and the list between the marks in
docs/architecture.md. A room is a package or a single module of mjspace, as in tests/test_layers.py.
"""

import ast
import runpy
from collections.abc import Mapping, Sequence
from functools import partial
from itertools import combinations, pairwise
from pathlib import Path

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs/architecture.md"
PICTURE = ROOT / "docs/rooms.svg"
LAYERS = runpy.run_path(str(ROOT / "tests/test_layers.py"))
levels = LAYERS["levels"]
BEGIN, END = "<!-- rooms: tools/rooms.py -->\n", "<!-- end of rooms -->"

# Pixels: a box, the space between boxes and between levels, and the margin.
WIDTH, HEIGHT, ACROSS, DOWN, MARGIN = 112, 30, 26, 34, 14

Imports = Mapping[str, frozenset[str]]
"""The rooms that each room imports, the ground first."""
Node = str | tuple[str, str, int]
"""A room, or where an arrow from one to another passes a level."""


def imports() -> Imports:
    """Return the imports of each room, in the order of tests/test_layers.py."""
    return {room: frozenset(LAYERS["imports_of"](room)) for room in LAYERS["ROOMS"]}


def listed(rooms: Imports) -> str:
    """Return the list of rooms for the page."""
    level = levels(rooms)
    arrows = sum(map(len, rooms.values()))
    modules = list(ROOT.glob("mjspace/**/*.py"))
    lines = [
        f"{len(rooms)} rooms on {max(level.values())} levels with {arrows} arrows; "
        f"{len(modules)} modules.",
        "",
        "| level | room | what it holds | imports |",
        "|---|---|---|---|",
    ]
    for room in sorted(rooms, key=lambda name: (level[name], name)):
        below = ", ".join(f"`{name}`" for name in rooms if name in rooms[room])
        lines.append(f"| {level[room]} | `{room}` | {_subject(room)} | {below} |")
    return "\n".join(["", *lines, "", ""])


def picture(rooms: Imports) -> str:
    """Return the picture as SVG: the ground at the bottom, arrows to what a room imports.

    An arrow that follows from others (a imports b, b imports c) is left out.
    """
    level = levels(rooms)
    top = max(level.values())
    # An arrow over several levels has a narrow place on each, so that no box hides it.
    arrows = [
        [room, *((room, other, n) for n in range(level[room] - 1, level[other], -1)), other]
        for room in rooms
        for other in sorted(_direct(rooms, room), key=list(rooms).index)
    ]
    rows = _rows(level, arrows)
    widths = {n: sum(_width(node) + ACROSS for node in row) - ACROSS for n, row in rows.items()}
    wide, high = max(widths.values()) + 2 * MARGIN, top * (HEIGHT + DOWN) - DOWN + 2 * MARGIN
    place: dict[Node, tuple[float, float]] = {}  # middle of the upper edge
    for number, row in rows.items():
        left = (wide - widths[number]) / 2
        for node in row:
            place[node] = left + _width(node) / 2, MARGIN + (top - number) * (HEIGHT + DOWN)
            left += _width(node) + ACROSS
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {wide} {high}" width="{wide}" '
        f'height="{high}" font-family="sans-serif" font-size="14">',
        f'<rect width="{wide}" height="{high}" fill="#ffffff"/>',
        '<defs><marker id="head" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" '
        'markerHeight="7" orient="auto"><path d="M0 0 8 4 0 8z" fill="#8794a8"/></marker></defs>',
        '<g fill="none" stroke="#8794a8" stroke-width="1.3" marker-end="url(#head)">',
    ]
    for nodes in arrows:
        x, y = place[nodes[0]]
        path = f"M{x:g} {y + HEIGHT:g}"
        for node in nodes[1:]:
            u, v = place[node]
            path += f"C{x:g} {v - DOWN / 2:g} {u:g} {v - DOWN / 2:g} {u:g} {v:g}"
            path += f"V{v + HEIGHT:g}" if isinstance(node, tuple) else ""
            x = u
        lines.append(f'<path d="{path}"/>')
    lines.append("</g>")
    for room in rooms:
        x, y = place[room]
        lines += [
            f'<rect x="{x - WIDTH / 2:g}" y="{y:g}" width="{WIDTH}" height="{HEIGHT}" rx="5" '
            f'fill="{"#e4ecf7" if level[room] > 1 else "#eef0f3"}" stroke="#35507a"/>',
            f'<text x="{x:g}" y="{y + 20:g}" text-anchor="middle" fill="#14233c">{room}</text>',
        ]
    return "\n".join([*lines, "</svg>", ""])


def _width(node: Node) -> int:
    return 0 if isinstance(node, tuple) else WIDTH


def _rows(level: Mapping[str, int], arrows: Sequence[Sequence[Node]]) -> dict[int, list[Node]]:
    """Return what stands on each level, from left to right near what it is joined to."""
    rows: dict[int, list[Node]] = {n: [] for n in range(1, max(level.values()) + 1)}
    for room, number in level.items():
        rows[number].append(room)
    near: dict[Node, list[Node]] = {room: [] for room in level}
    for nodes in arrows:
        for node in nodes[1:-1]:
            rows[node[2]].append(node)  # type: ignore[arg-type]
            near[node] = []
        for one, other in pairwise(nodes):
            near[one].append(other)
            near[other].append(one)
    best = {n: list(row) for n, row in rows.items()}
    for sweep in range(24):
        numbers = list(rows) if sweep % 2 else list(reversed(rows))
        for fixed, number in pairwise(numbers):
            at = {node: float(i) for i, node in enumerate(rows[fixed])}
            here = {node: float(i) for i, node in enumerate(rows[number])}
            rows[number].sort(key=partial(_middle, near=near, at=at, here=here))
        if _crossings(rows, near) < _crossings(best, near):
            best = {n: list(row) for n, row in rows.items()}
    return best


def _middle(
    node: Node,
    near: Mapping[Node, Sequence[Node]],
    at: Mapping[Node, float],
    here: Mapping[Node, float],
) -> float:
    """Return the mean place of what the node is joined to in another row; its own without any."""
    places = [at[other] for other in near[node] if other in at]
    return sum(places) / len(places) if places else here[node]


def _crossings(rows: Mapping[int, Sequence[Node]], near: Mapping[Node, Sequence[Node]]) -> int:
    found = 0
    for low, high in pairwise(rows.values()):
        ends = [(i, low.index(o)) for i, n in enumerate(high) for o in near[n] if o in low]
        found += sum((a - c) * (b - d) < 0 for (a, b), (c, d) in combinations(ends, 2))
    return found


def _direct(rooms: Imports, room: str) -> set[str]:
    """Return what the room imports that nothing else which it imports imports in its turn."""
    return {
        other
        for other in rooms[room]
        if not any(other in _all(rooms, third) for third in rooms[room] - {other})
    }


def _all(rooms: Imports, room: str) -> set[str]:
    return set(rooms[room]).union(*(_all(rooms, other) for other in rooms[room]))


def _subject(room: str) -> str:
    """Return the first line of the room's docstring."""
    package, module = ROOT / f"mjspace/{room}/__init__.py", ROOT / f"mjspace/{room}.py"
    path = package if package.exists() else module
    line = (ast.get_docstring(ast.parse(path.read_text())) or "").partition("\n")[0]
    return line.replace("``", "`").replace("|", "\\|")


def page(text: str, rooms: Imports) -> str:
    """Return the page ``text`` with the list of rooms between its marks."""
    before, _, rest = text.partition(BEGIN)
    _, _, after = rest.partition(END)
    return before + BEGIN + listed(rooms) + END + after


if __name__ == "__main__":
    found = imports()
    PICTURE.write_text(picture(found))
    PAGE.write_text(page(PAGE.read_text(), found))
