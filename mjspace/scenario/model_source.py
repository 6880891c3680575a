"""A user's own model file with all the files that it refers to, as they go into the log."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from xml.etree import ElementTree

from mjspace.scenario.trust import Trust

KINDS = (".xml", ".urdf")
"""How the name of a model file ends: MJCF or URDF."""
_FOLDERS = ("meshdir", "texturedir", "assetdir")  # attributes of <compiler>


@dataclass(frozen=True)
class ModelSource:
    """The text of an MJCF or URDF file and the files that it refers to."""

    name: str
    """Of the file, which may have folders before it."""
    files: dict[str, bytes]
    """It and the others, by their paths from its own folder."""

    @property
    def main(self) -> str:
        """The name of the model's own file in ``files``."""
        return PurePosixPath(self.name).name


def is_own(model: str) -> bool:
    """Return whether ``plant.model`` names a user's file, not one of the models in assets/."""
    place = model.partition(":")[0]
    return place.endswith((*KINDS, ".mjb", ".py"))


def read_source(name: str, trust: Trust) -> ModelSource:
    """Return the model file ``name``, looked up from the scenario's folder, with its files.

    Raises:
        ValueError: it or a file that it refers to is not there, is no XML, or lies outside the
            scenario's folder, which is not trusted.
    """
    place = trust.file(name)
    folder = PurePosixPath(name).parent

    def read(path: str) -> bytes:
        file = trust.file(type(name)((folder / path).as_posix()))  # as trusted as the model is
        if not file.is_file():
            raise ValueError(f"{place}: no file {path!r}, which it refers to")
        return file.read_bytes()

    if not place.is_file():
        raise ValueError(f"no file {place}")
    return source_of(name, read)


def source_of(name: str, read: Callable[[str], bytes]) -> ModelSource:
    """Return the model ``name`` with what it refers to; ``read`` takes paths from its folder.

    Raises:
        ValueError: one of its XML files is no XML; or ``read`` raises it.
    """
    main = PurePosixPath(name).name
    files: dict[str, bytes] = {}
    queue = [(main, "")]
    while queue:
        path, folder = queue.pop()
        if path in files:
            continue
        files[path] = read(path)
        if PurePosixPath(path).suffix in KINDS:
            queue += _referred(path, files[path], folder)
    return ModelSource(name, files)


def _referred(path: str, text: bytes, folder: str) -> Iterator[tuple[str, str]]:
    """Yield each file that the XML ``text`` refers to, and the folder of the files in that.

    Paths are from the main model's folder; ``folder`` is that of the model which includes it.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is no XML: {error}") from None
    compilers = list(root.iter("compiler"))
    folders = {key: c.get(key, "") for c in compilers for key in _FOLDERS if c.get(key)}
    for element in root.iter():
        for key, file in element.attrib.items():
            if not key.startswith("file"):
                continue
            if element.tag in ("include", "model"):
                below = "" if element.tag == "include" else str(PurePosixPath(file).parent)
                yield _joined(folder, file), _joined(folder, below)
            elif root.tag == "robot":
                yield _of_urdf(path, file, compilers), ""
            else:
                own = "texturedir" if element.tag == "texture" else "meshdir"
                under = folders.get(own) or folders.get("assetdir") or ""
                yield _joined(folder, _joined(under, file)), ""


def _of_urdf(path: str, file: str, compilers: list[ElementTree.Element]) -> str:
    """Return where MuJoCo looks for a file of a URDF: without its folder, if not told otherwise."""
    if "://" in file:
        raise ValueError(
            f"{path}: {file!r} is looked up by ROS: write a path from the model's folder"
        )
    strips = next((c.get("strippath") for c in compilers if c.get("strippath")), "true")
    folder = next((c.get("meshdir", "") for c in compilers if c.get("meshdir")), "")
    return _joined(folder, PurePosixPath(file).name if strips == "true" else file)


def _joined(folder: str, file: str) -> str:
    return (PurePosixPath(folder) / file).as_posix()
