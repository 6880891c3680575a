"""A user's own model file with all the files that it refers to, as they go into the log."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import PurePosixPath
from typing import NamedTuple
from xml.etree import ElementTree

from mjspace.scenario.trust import Trust

KINDS = (".xml", ".urdf")
"""How the name of a model file ends: MJCF or URDF."""
_FOLDERS = ("meshdir", "texturedir", "assetdir")  # attributes of <compiler>
_OUTSIDE = "outside"  # the folder of files in the log that lie outside the model's own


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


class _Reference(NamedTuple):
    """A file that a model refers to; its paths are from the folder of the main one."""

    places: tuple[str, ...]
    """Where it may be."""
    folder: str
    """Of the model that the file's own references are of."""
    owner: str
    """The file that names it; "" for the model itself."""
    only_drawn: bool = False
    """Whether MuJoCo can do without it: it leaves out what a URDF has for pictures alone."""


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
    folder = PurePosixPath(name).parent

    def read(path: str) -> bytes | None:
        file = trust.file(type(name)((folder / path).as_posix()))  # as trusted as the model is
        return file.read_bytes() if file.is_file() else None

    return source_of(name, read)


def source_of(name: str, read: Callable[[str], bytes | None]) -> ModelSource:
    """Return the model ``name`` with what it refers to.

    ``read`` returns the file at a path from the model's folder, None where there is none.

    Raises:
        ValueError: a file is missing, or is no XML; or ``read`` raises it.
    """
    main = PurePosixPath(name).name
    files: dict[str, bytes] = {}
    queue = [_Reference((main,), "", "")]
    while queue:
        reference = queue.pop()
        found = ((place, read(place)) for place in reference.places)
        place, content = next((each for each in found if each[1] is not None), ("", None))
        if content is None and reference.only_drawn:
            continue
        if content is None:
            owner = f" (named in {reference.owner})" if reference.owner else ""
            raise ValueError(f"no file {reference.places[0]!r}{owner}")
        if _kept(place) not in files:
            files[_kept(place)] = content
            if PurePosixPath(place).suffix in KINDS:
                queue += _referred(place, content, reference.folder)
    return ModelSource(name, files)


def _kept(place: str) -> str:
    """Return the name in the log of a file at that place, which may be outside the folder."""
    path = PurePosixPath(place)
    outside = path.is_absolute() or ".." in path.parts
    return f"{_OUTSIDE}/{path.name}" if outside else place


def _referred(path: str, text: bytes, folder: str) -> Iterator[_Reference]:
    """Yield each file that the XML ``text`` refers to; ``folder`` is that of its model."""
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f"{path} is no XML: {error}") from None
    compilers = list(root.iter("compiler"))
    set_by = {key: c.get(key, "") for c in compilers for key in _FOLDERS if c.get(key)}
    beside = str(PurePosixPath(path).parent)
    drawn = {mesh for visual in root.iter("visual") for mesh in visual.iter("mesh")}
    for element in root.iter():
        if root.tag == "robot" and element.tag != "mesh":
            continue  # a simulator's own, as a plugin of Gazebo's
        for key, file in element.attrib.items():
            if not key.startswith("file"):
                continue
            if "://" in file and element not in drawn:
                raise ValueError(f"{path}: {file!r} is for ROS: write a path from its own folder")
            own = "texturedir" if element.tag == "texture" else "meshdir"
            under = set_by.get(own) or set_by.get("assetdir") or ""
            # MuJoCo looks in the folder of the model, and of the file that is included in it.
            names = (_joined(under, file), file, PurePosixPath(file).name)
            near = [_joined(base, name) for name in names for base in (folder, beside)]
            kept = [_joined(base, _kept(file)) for base in (folder, beside)]
            inner = _joined(folder, str(PurePosixPath(file).parent))
            places = tuple(dict.fromkeys([*near, *kept]))
            folder_of_it = inner if element.tag == "model" else folder
            yield _Reference(places, folder_of_it, path, only_drawn=element in drawn)


def _joined(folder: str, file: str) -> str:
    return (PurePosixPath(folder) / file).as_posix()
