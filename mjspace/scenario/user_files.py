"""A user's own Python file, with the modules and the data files beside it."""

import ast
import hashlib
import importlib
import importlib.util
import inspect
import sys
import sysconfig
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

from mjspace.errors import pass_on_signals

DATA_FILES = "DATA_FILES"
"""What a user's module calls the tuple of names of the files beside it that it reads."""
_SOURCE, _BESIDE = "_mjspace_source", "_mjspace_beside"  # texts, as the files may be gone later


def load_file(path: Path) -> ModuleType:
    """Return the module of a Python file, which may import modules of its own folder.

    Modules beside it are those that the file itself imports, at the top of a module or of another
    one beside it. They are known to this file alone: two folders with a ``helpers.py`` each do not
    answer for one another, and neither do two files called ``law.py``.

    Raises:
        ValueError: no such file, or it cannot be imported.
    """
    if not path.is_file():
        raise ValueError(f"no file {path}")
    text, files = path.read_bytes(), beside(path)
    digest = hashlib.sha256(repr((str(path.resolve()), text, sorted(files.items()))).encode())
    name = f"mjspace_user_{path.stem}_{digest.hexdigest()[:12]}"
    if name in sys.modules:
        return sys.modules[name]
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ValueError(f"{path} is not a Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        setattr(module, _SOURCE, text.decode())
        setattr(module, _BESIDE, files)
        with _importable(path.parent.resolve(), files):
            spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        pass_on_signals(error)
        raise ValueError(f"{path} cannot be imported: {type(error).__name__}: {error}") from error
    return module


def beside(path: Path) -> dict[str, bytes]:
    """Return what the Python file needs of its folder, by its path from there.

    That is every module that it imports, and that those import, and every file named in
    ``DATA_FILES = ("table.csv",)`` of one of them.

    Raises:
        ValueError: a file of ``DATA_FILES`` is not there, or outside the folder.
    """
    found: dict[str, bytes] = {}
    queue = [path]
    while queue:
        file = queue.pop()
        try:
            tree = ast.parse(file.read_bytes())
        except (SyntaxError, ValueError):
            continue  # importing it says what is wrong
        for other in (*_modules(tree, file, path.parent), *_data(tree, file, path.parent)):
            name = other.relative_to(path.parent).as_posix()
            if name not in found and other != path:
                found[name] = other.read_bytes()
                if other.suffix == ".py":
                    queue.append(other)
    return found


def source_of(kind: type) -> str:
    """Return the text of the file that defines ``kind``."""
    text: str | None = getattr(sys.modules[kind.__module__], _SOURCE, None)
    return text if text is not None else Path(inspect.getfile(kind)).read_text(encoding="utf-8")


def files_of(kind: type) -> dict[str, bytes]:
    """Return the files beside the user's file that defines ``kind``; none for an installed one."""
    files: dict[str, bytes] = getattr(sys.modules[kind.__module__], _BESIDE, {})
    return files


def _modules(tree: ast.Module, file: Path, folder: Path) -> Iterator[Path]:
    """Yield the files in ``folder`` of the modules that the ``tree`` of ``file`` imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            package = file.relative_to(folder).parent.parts if node.level else ()
            package = package[: len(package) - node.level + 1] if node.level else ()
            base = ".".join([*package, *([node.module] if node.module else [])])
            names = [base, *(f"{base}.{alias.name}" for alias in node.names)]
        else:
            continue
        for name in names:
            parts = name.split(".")
            if not parts[0] or _is_installed(parts[0]):
                continue
            for depth in range(1, len(parts) + 1):
                place = folder.joinpath(*parts[:depth])
                yield from filter(Path.is_file, (place.with_suffix(".py"), place / "__init__.py"))


def _data(tree: ast.Module, file: Path, folder: Path) -> Iterator[Path]:
    """Yield the data files that the module says it reads."""
    for node in tree.body:
        targets = node.targets if isinstance(node, ast.Assign) else []
        if not any(isinstance(target, ast.Name) and target.id == DATA_FILES for target in targets):
            continue
        try:
            names = ast.literal_eval(node.value)  # type: ignore[attr-defined]
        except ValueError:
            names = None
        if not (isinstance(names, list | tuple) and all(isinstance(n, str) for n in names)):
            raise ValueError(f'{file}: {DATA_FILES}: write it out, as in ("table.csv",)')
        for name in names:
            place = file.parent / name
            inside = (
                place.resolve().is_relative_to(folder.resolve()) and ".." not in Path(name).parts
            )
            if not inside or not place.is_file():
                raise ValueError(f"{file}: {DATA_FILES}: no file {name!r} in its folder")
            yield place


@contextmanager
def _importable(folder: Path, files: Mapping[str, bytes]) -> Iterator[None]:
    """Let the modules among ``files`` be imported from ``folder``, and forget them afterwards."""
    own = {Path(name).parts[0].removesuffix(".py") for name in files if name.endswith(".py")}

    def loaded() -> dict[str, ModuleType]:
        return {n: m for n, m in sys.modules.items() if n.partition(".")[0] in own}

    hidden = loaded()
    for name in hidden:
        del sys.modules[name]
    sys.path.insert(0, str(folder))
    importlib.invalidate_caches()
    # A cached bytecode is taken for new by its second and size alone.
    writes_none, sys.dont_write_bytecode = sys.dont_write_bytecode, True
    try:
        yield
    finally:
        sys.dont_write_bytecode = writes_none
        sys.path.remove(str(folder))
        for name in loaded():
            del sys.modules[name]
        sys.modules.update(hidden)


def _is_installed(name: str) -> bool:
    """Return whether a top-level module of that name is there for every file, and wins."""
    if name in sys.stdlib_module_names or name == "mjspace":
        return True
    file = getattr(sys.modules.get(name), "__file__", None)
    places = [sysconfig.get_path(key) for key in ("purelib", "platlib")]
    return file is not None and any(Path(file).is_relative_to(place) for place in places)
