"""Reads a user's model file (MJCF, URDF or MJB) and reports what compiler settings changed."""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.vehicle.own_model import one_line

KINDS = (".xml", ".urdf", ".mjb")
_AUTO = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO
_NEUTRAL: dict[str, Any] = {
    "settotalmass": -1.0,
    "boundmass": 0.0,
    "boundinertia": 0.0,
    "inertiafromgeom": _AUTO,
    "inertiagrouprange": (0, 5),
    "discardvisual": False,
}
"""Settings that can change mass or inertia, with the value that keeps them as in the file."""


class Source(NamedTuple):
    """A model with its source."""

    model: Any
    """Compiled."""
    spec: Any
    """The ``MjSpec`` before it was compiled; None for an MJB file."""
    warnings: list[str]
    """MuJoCo's warnings from reading and compiling the file."""


def read(path: Path) -> Source:
    """Return the model in a file.

    Raises:
        ValueError: MuJoCo cannot read or compile the file; the message is one line.
        OSError: the file cannot be read.
    """
    path.open("rb").close()  # its OSError says why a file cannot be read, unlike MuJoCo's
    if path.suffix not in KINDS:
        raise ValueError("a model is an MJCF (.xml), URDF (.urdf or .xml) or compiled (.mjb) file")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            if path.suffix == ".mjb":
                model, spec = mujoco.MjModel.from_binary_path(str(path)), None
            else:
                # Included files are found relative to an absolute path.
                spec = mujoco.MjSpec.from_file(str(path.resolve()))
                model = (
                    spec.copy().compile()
                )  # a copy: compiling removes static bodies from the spec
        # FatalError is MuJoCo's for errors that it cannot continue from
        except (ValueError, mujoco.FatalError) as error:
            raise ValueError(_refusal(path, error)) from error
    return Source(model, spec, [one_line(str(warning.message)) for warning in caught])


def _refusal(path: Path, error: Exception) -> str:
    if path.suffix == ".mjb":
        return f"no compiled model of MuJoCo {mujoco.__version__}: {one_line(str(error))}"
    return one_line(str(error))


def findings(spec: Any) -> Iterator[str]:
    """Yield how the compiler's settings changed the masses and inertias that the file states.

    Every finding has the value in the file and the value after compilation.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # already reported by ``read``
        yield from _findings(spec)


def _findings(spec: Any) -> Iterator[str]:
    bare = _bare(spec)
    settings = [
        setting
        for setting, neutral in _NEUTRAL.items()
        if np.any(getattr(spec.compiler, setting) != np.asarray(neutral))
    ]
    if "settotalmass" in settings:  # it scales the result of the others
        before = _compiled_without(bare, "settotalmass").body_mass.sum()
        after = bare.copy().compile().body_mass.sum()
        if abs(after - before) > 1e-9 * before:
            yield (
                f"settotalmass={after:.6g}: the total mass is {after:.6g} kg instead of "
                f"{before:.6g} kg, and all inertias are scaled with it"
            )
        bare.compiler.settotalmass = _NEUTRAL["settotalmass"]
        settings.remove("settotalmass")
    flown = bare.copy().compile()
    yield from _balanced(bare)
    for setting in settings:
        yield from _changed_by(bare, flown, setting)
    if spec.compiler.fusestatic:
        yield from _fused(spec, flown)


def _bare(spec: Any) -> Any:
    """Return the spec reduced to bodies and geoms, without joints: it compiles with any setting.

    Bodies are not fused, and a body without mass is not an error.
    """
    bare = spec.copy()
    bare.compiler.fusestatic = False
    for kind in ("keys", "sensors", "actuators", "tendons", "equalities", "tuples", "joints"):
        for element in list(getattr(bare, kind)):
            bare.delete(element)
    return bare


def _balanced(spec: Any) -> Iterator[str]:
    if not spec.compiler.balanceinertia:
        return
    for number, body in enumerate(spec.bodies):
        stated = _principal(body)
        if body.explicitinertial and 2.0 * stated[2] > stated.sum() * (1.0 + 1e-9):
            yield (
                f"balanceinertia: {_called(body.name, number)} gets the principal moments "
                f"{_numbers([stated.mean()] * 3)} kg m^2 instead of {_numbers(stated)}, which are "
                f"impossible: the largest exceeds the sum of the others"
            )


def _principal(body: Any) -> Array:
    """Return the principal moments that the file states [kg m^2], ascending, (3,)."""
    xx, yy, zz, xy, xz, yz = body.fullinertia
    if np.isnan(xx):
        return np.sort(body.inertia)
    found: Array = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    return found


def _compiled_without(spec: Any, setting: str) -> Any:
    plain = spec.copy()
    setattr(plain.compiler, setting, _NEUTRAL[setting])
    return plain.compile()


def _changed_by(bare: Any, flown: Any, setting: str) -> Iterator[str]:
    text = f"{setting}={_as_text(getattr(bare.compiler, setting))}"
    stated = _compiled_without(bare, setting)
    for body in range(1, flown.nbody):
        for what, unit, here, there in (
            ("mass", "kg", flown.body_mass[body], stated.body_mass[body]),
            ("inertia", "kg m^2", flown.body_inertia[body], stated.body_inertia[body]),
        ):
            if not np.allclose(here, there, rtol=1e-9, atol=0.0):
                yield (
                    f"{text}: the {what} of {_name(flown, body)} is {_numbers(here)} {unit} "
                    f"instead of {_numbers(there)} {unit}"
                )


def _fused(spec: Any, bare: Any) -> Iterator[str]:
    """Yield which bodies ``fusestatic`` merged; ``bare`` is the model without it."""
    fused = spec.copy().compile()
    kept = {fused.body(number).name for number in range(fused.nbody)}
    for number, body in enumerate(spec.bodies):
        if body.name in kept:
            continue
        mass = f"{bare.body_mass[number]:.6g} kg"
        into = body
        while into.name != "world" and not len(into.joints):
            into = into.parent
        if into.name == "world":
            yield (
                f"fusestatic: {_name(bare, number)} was merged with the world, to which it is "
                f"fixed: its {mass} have no effect; to let it move, join it to a root link by a "
                f'joint of type "floating" (URDF), or give it a <freejoint/> (MJCF)'
            )
        else:
            before = bare.body(into.name).mass[0]
            yield (
                f"fusestatic: {_name(bare, number)}, {mass}, was merged with {into.name!r}: "
                f"{before:.6g} kg became {fused.body(into.name).mass[0]:.6g} kg"
            )


def _name(model: Any, body: int) -> str:
    return _called(model.body(body).name, body)


def _called(name: str, number: int) -> str:
    return f"body {name!r}" if name else f"body {number}"


def _as_text(value: Any) -> str:
    if isinstance(value, mujoco.mjtInertiaFromGeom):
        return str(value.name).removeprefix("mjINERTIAFROMGEOM_").lower()
    if isinstance(value, bool):
        return str(value).lower()
    return " ".join(f"{number:g}" for number in np.ravel(value))


def _numbers(values: Any) -> str:
    return ", ".join(f"{value:.6g}" for value in np.ravel(values))
