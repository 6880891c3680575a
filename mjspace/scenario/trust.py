"""What the ``kind`` of a law, a reference or a disturbance names, and whether it may run."""

import functools
import importlib
import inspect
import pkgutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from importlib.resources import files
from ipaddress import ip_address
from pathlib import Path
from types import ModuleType
from typing import Any

from mjspace.errors import nearest, shortened
from mjspace.scenario.user_files import load_file

GROUP = "mjspace.controllers"
"""The package of the laws that come with mjspace, and the entry points of those that do not."""
_SCENARIOS = Path(str(files("mjspace.scenarios")))
_NOTED: ContextVar[dict[str, Path] | None] = ContextVar("noted", default=None)


def is_library(kind: str) -> bool:
    """Return whether a law of that ``kind`` is a function of a shared library."""
    return kind.partition(":")[0].endswith(".so")


def is_address(kind: str) -> bool:
    """Return whether a law of that ``kind`` is a process at the other end of a socket."""
    return "://" in kind


def function_of(kind: str) -> str:
    """Return the function that ``"library.so:function"`` names.

    Raises:
        ValueError: none that C could have.
    """
    name = str(kind.partition(":")[2])
    if not (name.isascii() and name.isidentifier()):
        raise ValueError(f"{shortened(kind)!r}: write 'library.so:function'")
    return name


@contextmanager
def files_noted() -> Iterator[dict[str, Path]]:
    """Yield the files that are looked up within the context, by the names they are given.

    Those that come with mjspace are left out.
    """
    noted: dict[str, Path] = {}
    before = _NOTED.set(noted)
    try:
        yield noted
    finally:
        _NOTED.reset(before)


def note(name: str, path: Path) -> None:
    """Note that a file, if it is one, is read within ``files_noted``, under that name."""
    noted = _NOTED.get()
    if noted is not None and path.is_file():
        noted[name] = path


class CommandLineText(str):
    """Text that the user gave by ``--set`` or ``--gain``: what it names is trusted."""


@dataclass(frozen=True)
class Trust:
    """What code and files a scenario may name, and where they are looked up.

    That is code which comes with mjspace or which an installed package offers as an entry point of
    the group ``mjspace.controllers``, and files in the scenario's own folder; and whatever the user
    named on the command line.
    """

    folder: Path
    """The scenario's."""
    everything: bool = False
    """Whether any installed module and any file may be named."""

    def file(self, name: str) -> Path:
        """Return the file of that name, looked up from the folder; or else of mjspace's scenarios.

        Raises:
            ValueError: it is outside the folder, and the scenario is not trusted.
        """
        path = self.folder / name
        if Path(name).name == name and not path.exists() and (_SCENARIOS / name).is_file():
            return _SCENARIOS / name  # as where a scenario is based on one of them
        if not (self._trusts(name) or path.resolve().is_relative_to(self.folder.resolve())):
            raise ValueError(f"{name} is outside the scenario's folder: --trust allows that")
        note(name, path)
        return path

    def library(self, kind: str) -> tuple[Path, str]:
        """Return the file and the function that ``"library.so:function"`` names.

        Raises:
            ValueError: it names no function, or a file that may not run or is not there.
        """
        name = function_of(kind)
        path = self.file(type(kind)(kind.partition(":")[0]))
        if not path.is_file():
            raise ValueError(f"no file {path}")
        return path, name

    def address(self, kind: str) -> tuple[str, int]:
        """Return the host and the port of ``"tcp://host:port"``.

        Raises:
            ValueError: it is no such address; or another machine's, and the scenario is not
                trusted.
        """
        scheme, _, place = kind.partition("://")
        host, _, port = place.rpartition(":")
        host = host.removeprefix("[").removesuffix("]")
        if scheme != "tcp" or not host:
            raise ValueError(f"{shortened(kind)!r}: write 'tcp://host:port'")
        if not (port.isascii() and port.isdigit() and len(port) < 6 and 0 < int(port) < 65536):
            raise ValueError(f"{shortened(kind)!r}: the port should be from 1 to 65535")
        if not (self._trusts(kind) or _is_this_machine(host)):
            raise ValueError(
                f"{shortened(kind)!r} is another machine, to which the flight's data would go: "
                "--trust allows that"
            )
        return host, int(port)

    def load(self, kind: str) -> Any:
        """Return the class or function that ``"module:Name"`` or ``"file.py:Name"`` names.

        Raises:
            ValueError: no such module, file or name, with the near ones; or none that may run.
        """
        place, _, name = kind.partition(":")
        if not place or not name:
            raise ValueError(f"{kind!r}: write 'module:Class' or 'file.py:Class'")
        place = type(kind)(place)  # partition makes a plain text of any
        own_file = place.endswith(".py")
        module = load_file(self.file(place)) if own_file else self._import(place)
        names = {
            key: value
            for key, value in vars(module).items()
            if own_file or _belongs_to(value, module)
        }
        if name not in names:
            own = [key for key, each in names.items() if callable(each) and key[:1] != "_"]
            classes = [key for key in own if inspect.isclass(names[key])]
            raise ValueError(f"{place!r} has no {name!r}{nearest(name, classes or own)}")
        found = names[name]
        if not callable(found):
            raise ValueError(f"{kind} is neither a class nor a function: {type(found).__name__}")
        return found

    def load_class(self, kind: str, methods: Sequence[str] = ()) -> type:
        """Return the class that ``kind`` names, which has the ``methods``, as "at(time)".

        Raises:
            ValueError: as ``load``; or it is no such class.
        """
        found = self.load(kind)
        if not inspect.isclass(found):
            raise ValueError(f"{kind} is a {type(found).__name__}, should be a class")
        for method in methods:
            if not callable(getattr(found, method.partition("(")[0], None)):
                raise ValueError(f"{kind} has no method {method}")
        return found

    def _trusts(self, name: str) -> bool:
        return self.everything or isinstance(name, CommandLineText)

    def _import(self, name: str) -> ModuleType:
        have = controllers()
        full: str | None = have.get(name.removeprefix(f"{GROUP}."))
        full = full or _entry_points().get(name) or (name if self._trusts(name) else None)
        if full is not None:
            try:
                return importlib.import_module(full)
            except ModuleNotFoundError as error:
                if error.name is None or not full.startswith(error.name):
                    raise ValueError(f"{name!r} cannot be imported: {error}") from error
        raise ValueError(
            f"no module {name!r} in {GROUP}{nearest(name, sorted(have))}; a file of your own is "
            f"named as 'file.py:Class', an installed module needs an entry point or --trust"
        )


@functools.cache
def controllers() -> dict[str, str]:
    """Return the full name of each module in controllers/ by the last part, as scenarios name it.

    The folders there are for people: a law keeps its name when it moves to another.
    """
    package = importlib.import_module(GROUP)
    found = pkgutil.walk_packages(package.__path__, f"{GROUP}.")
    return {each.name.rpartition(".")[2]: each.name for each in found if not each.ispkg}


def _is_this_machine(host: str) -> bool:
    """Return whether what is sent to the ``host`` does not leave this machine.

    A name is not looked up: that would be sent already.
    """
    try:
        return host == "localhost" or ip_address(host).is_loopback
    except ValueError:
        return False


def _entry_points() -> dict[str, str]:
    """Return the modules that installed packages offer, by the entry point's and their own name."""
    from importlib.metadata import entry_points  # 20 ms, which a law of mjspace's need not wait for

    found = {}
    for each in entry_points(group=GROUP):
        found[each.name] = found[each.module] = each.module
    return found


def _belongs_to(found: Any, module: ModuleType) -> bool:
    """Return whether a class or function is the module's, or its package's, own."""
    is_ours = module.__name__.startswith(f"{GROUP}.")
    package = GROUP if is_ours else module.__name__.partition(".")[0]
    return f"{getattr(found, '__module__', '')}.".startswith(f"{package}.")
