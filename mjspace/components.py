"""From a name and a table of gains to a law or a reference: find the class, check, construct."""

import dataclasses
import difflib
import hashlib
import importlib
import importlib.util
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from mjspace.quantity import to_si
from mjspace.scenario import Component

_SOURCE = "_mjspace_source"  # text of a user's module, whose file may be gone when it is asked for


def load_object(kind: str, folder: Path) -> Any:
    """Return what ``"module:Name"`` or ``"file.py:Name"`` names.

    A file is looked up from ``folder``; a module in mjspace.controllers first, then anywhere.

    Raises:
        ValueError: no such module, file or name, with the near ones.
    """
    place, _, name = kind.partition(":")
    if not place or not name:
        raise ValueError(f"{kind!r}: write 'module:Class' or 'file.py:Class'")
    module = _load_file(folder / place) if place.endswith(".py") else _import(place)
    if not hasattr(module, name):
        have = [key for key, value in vars(module).items() if inspect.isclass(value)]
        raise ValueError(f"{place!r} has no {name!r}{nearest(name, have)}")
    return getattr(module, name)


def construct(
    component: Component, kind: type, facts: Mapping[str, Any], folder: Path
) -> tuple[Any, Component]:
    """Return the object of class ``kind`` with the component's gains, and the component as flown.

    A parameter that the table leaves out is taken from ``facts`` where they hold its name (the
    vehicle's properties), else from its default; the component as flown has all written out.
    ``file`` gives the rows of a table read from a CSV file with a header of parameter names. A
    table in a gain that has a ``kind`` is constructed in the same way.

    Raises:
        ValueError: an unknown, missing or misshapen gain, with its name and what would be right.
    """
    gains = component.gains
    if "file" in gains:
        gains |= _columns(folder / str(gains.pop("file")))
    parameters = inspect.signature(kind).parameters
    for name in gains:
        if name not in parameters:
            raise ValueError(f"{name}: {component.kind} has no such key{nearest(name, parameters)}")
    inside = {name: gain for name, gain in gains.items() if _has_kind(gain)}
    written = {}
    for name, gain in inside.items():
        gains[name], written[name] = _within(name, gain, facts, folder)
    values = {name: facts[name] for name in parameters if name in facts} | gains
    missing = [
        name
        for name, parameter in parameters.items()
        if parameter.default is parameter.empty and name not in values
    ]
    if missing:
        raise ValueError(f"{missing[0]}: missing, and {component.kind} has no default for it")
    declared = {f.name: f.metadata for f in dataclasses.fields(kind)} if _is_data(kind) else {}
    values = {name: _value(name, v, declared.get(name, {})) for name, v in values.items()}
    built = kind(**values)
    flown = {name: getattr(built, name, values.get(name)) for name in parameters} | written
    return built, Component(kind=component.kind, **{k: plain(v) for k, v in flown.items()})


def _has_kind(value: Any) -> bool:
    """Return whether the gain is, or holds, a table with a ``kind``."""
    if isinstance(value, Mapping):
        return "kind" in value or any(map(_has_kind, value.values()))
    return isinstance(value, list) and any(map(_has_kind, value))


def _within(key: str, value: Any, facts: Mapping[str, Any], folder: Path) -> tuple[Any, Any]:
    """Return the gain with every table that has a ``kind`` constructed, and as flown."""
    if isinstance(value, list):
        pairs = [_within(f"{key}.{n}", item, facts, folder) for n, item in enumerate(value)]
        return [built for built, _ in pairs], [flown for _, flown in pairs]
    if not isinstance(value, Mapping):
        return value, value
    if "kind" not in value:
        items = {name: _within(f"{key}.{name}", v, facts, folder) for name, v in value.items()}
        return {n: built for n, (built, _) in items.items()}, {
            n: flown for n, (_, flown) in items.items()
        }
    inner = Component.model_validate(value)
    try:
        if inner.kind.partition(":")[0].endswith(".py"):
            raise ValueError(
                f"{inner.kind}: a law within another comes from a module, as the log "
                "keeps the text of one file alone"
            )
        built, flown = construct(inner, load_object(inner.kind, folder), facts, folder)
    except ValueError as error:
        raise ValueError(f"{key}: {error}") from error
    return built, {"kind": flown.kind, **flown.gains}


def source_of(kind: type) -> str:
    """Return the text of the file that defines ``kind``."""
    text = getattr(sys.modules[kind.__module__], _SOURCE, None)
    return text if text is not None else Path(inspect.getfile(kind)).read_text()


def nearest(name: str, names: Any) -> str:
    """Return ``": nearest is 'x' (have a, b, x)"`` for an error message."""
    near = difflib.get_close_matches(name, list(names), n=1, cutoff=0.5)
    have = ", ".join(names) or "none"
    return f": did you mean {near[0]!r}? (have {have})" if near else f": have {have}"


def plain(value: Any) -> Any:
    """Return ``value`` with its arrays as lists, as TOML can hold it."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    return value


def _is_data(kind: type) -> bool:
    return dataclasses.is_dataclass(kind)


def _value(name: str, value: Any, metadata: Mapping[str, Any]) -> Any:
    """Return the gain as its declared unit and shape want it; undeclared ones as they are."""
    if "unit" not in metadata:
        return value
    try:
        array = np.asarray(to_si(value, metadata["unit"]), dtype=float)
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name}: {error}") from None
    shape = metadata["shape"]
    right = len(array.shape) == len(shape) and all(
        want in (None, have) for want, have in zip(shape, array.shape, strict=True)
    )
    if not right:
        want = " x ".join("n" if size is None else str(size) for size in shape) or "one number"
        raise ValueError(f"{name}: got an array of shape {array.shape}, wanted {want}")
    return array if shape else float(array)


def _columns(path: Path) -> dict[str, Any]:
    """Return a CSV file's columns by their header; ``q0, q1, ...`` become one array ``q``."""
    try:
        header = path.read_text().splitlines()[0].lstrip("# ")
        rows = np.loadtxt(path, delimiter=",", skiprows=1, ndmin=2)
    except (OSError, IndexError, ValueError) as error:
        raise ValueError(f"file: {path} is no table of numbers with a header: {error}") from None
    columns: dict[str, list[Any]] = {}
    for name, column in zip([c.strip() for c in header.split(",")], rows.T, strict=False):
        columns.setdefault(name.rstrip("0123456789"), []).append(column)
    return {
        name: (parts[0] if len(parts) == 1 else np.stack(parts, axis=-1)).tolist()
        for name, parts in columns.items()
    }


def _load_file(path: Path) -> ModuleType:
    if not path.is_file():
        raise ValueError(f"no file {path}")
    text = path.read_bytes()
    # A name of the content's own: two files called law.py do not answer for each other.
    name = f"mjspace_user_{path.stem}_{hashlib.sha256(text).hexdigest()[:12]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path} is no Python file")
    module = importlib.util.module_from_spec(spec)
    setattr(module, _SOURCE, text.decode())
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        del sys.modules[name]
        raise ValueError(f"{path} cannot be imported: {type(error).__name__}: {error}") from error
    return module


def _import(name: str) -> ModuleType:
    for full in (f"mjspace.controllers.{name}", name):
        try:
            return importlib.import_module(full)
        except ModuleNotFoundError as error:
            if error.name is None or not full.startswith(error.name):
                raise ValueError(f"{name!r} cannot be imported: {error}") from error
    package = importlib.import_module("mjspace.controllers")
    have = sorted(path.stem for path in Path(package.__path__[0]).glob("[a-z]*.py"))
    raise ValueError(f"no module {name!r}{nearest(name, have)}")
