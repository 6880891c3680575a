"""A user's own model, made ready to fly: its bus free, its world replaced, its motors in SI."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from mjspace.errors import nearest
from mjspace.scenario.model_source import KINDS, ModelSource, read_source, source_of
from mjspace.scenario.plant import Roles
from mjspace.scenario.trust import Trust, note
from mjspace.vehicle import model_sensors
from mjspace.vehicle import roles as recognition
from mjspace.vehicle.roles import Recognized

_BUILT = "built.xml"  # the name of what code has built
_DISABLE = mujoco.mjtDisableBit
_FREE, _HINGE = mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_HINGE
_ON_JOINT = mujoco.mjtTrn.mjTRN_JOINT


def open_source(model: str, trust: Trust) -> ModelSource:
    """Return the source of ``plant.model``, a file or a function that builds an ``MjSpec``.

    Raises:
        ValueError: it is not there, is not trusted, or is no such file or function.
    """
    place, is_code, _ = model.partition(":")
    if place.endswith(".mjb"):
        raise ValueError(
            f"{model} is compiled, and nothing can be added to it: give the MJCF it was made of, "
            "as mj_saveLastXML writes it"
        )
    if not is_code:
        return read_source(model, trust)
    found = trust.load(model)
    try:
        spec = found()
    except Exception as error:
        raise ValueError(f"{model} raised {type(error).__name__}: {error}") from error
    if not isinstance(spec, mujoco.MjSpec):
        raise ValueError(f"{model} returned a {type(spec).__name__}, should be an mujoco.MjSpec")
    return _source_of_spec(spec, (trust.folder / place).parent)


def _source_of_spec(spec: Any, folder: Path) -> ModelSource:
    """Return a spec as XML, and the files that it names: its own assets, or of the ``folder``."""
    for element in (*spec.meshes, *spec.textures, *spec.hfields, *spec.skins):
        if element.file and element.file not in spec.assets:
            path = folder / element.file
            note(element.file, path)
            spec.assets[element.file] = path.read_bytes()
    with _in_one_line():
        spec.compile()
        text = spec.to_xml()
    files: dict[str, bytes] = {**spec.assets, _BUILT: text.encode()}
    return source_of(_BUILT, files.get)


def read(source: ModelSource) -> Any:
    """Return the ``MjSpec`` of a model file, made of none but the files of its ``source``.

    Raises:
        ValueError: MuJoCo cannot read or compile it; the message is one line.
    """
    # A copy of a spec lacks what refers to nothing, and compiling one removes static bodies.
    with _in_one_line():
        _parsed(source).compile()
        return _parsed(source)


def _parsed(source: ModelSource) -> Any:
    texts = {name: text for name, text in source.files.items() if name.endswith(KINDS)}
    main = source.files[source.main].decode()
    return mujoco.MjSpec.from_string(main, include=texts, assets=source.files)


@contextmanager
def _in_one_line() -> Iterator[None]:
    """Turn MuJoCo's errors into a ValueError of one line, and drop its warnings."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (ValueError, mujoco.FatalError) as error:
        raise ValueError(one_line(str(error))) from error


def one_line(text: str) -> str:
    """Return a message of MuJoCo's in one line."""
    return ", ".join(line.strip(" :,") for line in text.splitlines() if line.strip(" :,"))


def prepare(
    spec: Any, roles: Roles, *, lands: bool = False, armature: bool = True
) -> tuple[Recognized, Any]:
    """Make a model ready to fly; return what its motors are, and how it compiles.

    The vehicle stays as it is. What a scenario has itself replaces the model's: gravity, medium and
    keyframes. Bodies, joints, motors and sensors without a name get one; the bus gets a free joint,
    and hinges of wheels get a motor, where ``roles`` says so and there is none; motors of wheels
    and thrusters are commanded by torque [N m] and force [N]. Contacts are off, unless it
    ``lands``; its armature is left out, if that is not wanted.

    Raises:
        ValueError: MuJoCo cannot compile it; no body is called as ``roles`` says; or as
            ``roles.recognize``.
    """
    name_all(spec)
    free(spec, roles.bus)
    if not any(joint.type == _FREE for joint in spec.joints):
        raise ValueError(
            f"plant.model: no free joint: the vehicle hangs on the world; give its bus a "
            f"<freejoint/>, or name it as plant.roles.bus, which frees it: {_roots(spec)}"
        )
    if not armature:
        for element in (*spec.joints, *spec.tendons, *spec.actuators):
            element.armature = 0.0
    _add_motors(spec, roles.wheels or ())
    _set_options(spec, lands=lands)
    for key in list(spec.keys):
        spec.delete(key)
    for motor in spec.actuators:
        if motor.dyntype == mujoco.mjtDyn.mjDYN_FILTEREXACT:
            motor.dyntype = mujoco.mjtDyn.mjDYN_FILTER  # the same lag, to RK4's order
    for sensor in spec.sensors:  # a scenario says how one samples
        sensor.nsample, sensor.delay, sensor.interval = 0, 0.0, np.zeros(2)
    model = compiled(spec)
    recognized = recognition.recognize(model, roles)
    model_sensors.add_places(spec)
    for motor in (*recognized.wheels, *recognized.thrusters):
        number = model.actuator(motor.name).id
        _command_in_si(spec.actuator(motor.name), recognition.scale(model, number))
    if _is_constrained(model):
        # At its tolerance the solver would leave a remainder between a torque and its reaction.
        spec.option.tolerance = 0.0
    elif not lands:
        spec.option.disableflags |= int(_DISABLE.mjDSBL_CONSTRAINT)
    return recognized, model


def name_all(spec: Any) -> None:
    """Give each body, joint, motor and sensor without a name one that no other has."""
    _name(spec.bodies, lambda body: "body")
    _name(spec.joints, lambda joint: f"{joint.parent.name}_joint")
    _name(spec.actuators, lambda motor: f"{motor.target}_motor" if motor.target else "motor")
    _name(spec.sensors, lambda sensor: f"{sensor.objname}_sensor" if sensor.objname else "sensor")


def compiled(spec: Any) -> Any:
    """Return the model of a copy of ``spec``, which stays as it is.

    Raises:
        ValueError: MuJoCo cannot compile it; the message is one line.
    """
    with _in_one_line():
        return spec.copy().compile()


def free(spec: Any, bus: str | None) -> None:
    """Let the body called ``bus`` move, if it does not; None leaves the model as it is.

    Raises:
        ValueError: there is no such body, or it is not fixed to the world.
    """
    if bus is None:
        return
    body = spec.body(bus)
    names = [each.name for each in spec.bodies if each.name != "world"]
    if body is None or bus == "world":
        raise ValueError(f"plant.roles.bus: no body {bus!r}{nearest(bus, names)}")
    if any(joint.type == _FREE for joint in body.joints):
        return
    if body.parent.name != "world" or len(body.joints):
        raise ValueError(
            f"plant.roles.bus: {bus!r} cannot be freed: it is "
            + (f"on the body {body.parent.name!r}" if body.parent.name != "world" else "on a joint")
        )
    body.add_freejoint().name = bus


def _name(elements: Iterable[Any], called: Callable[[Any], str]) -> None:
    """Give each element without a name one that no other has."""
    elements = list(elements)
    taken = {element.name for element in elements}
    for element in elements:
        if not element.name:
            name, number = called(element), 1
            while name in taken:
                number += 1
                name = f"{called(element)}_{number}"
            element.name = name
            taken.add(name)


def _roots(spec: Any) -> str:
    """Return the names of the bodies on the world."""
    names = [body.name for body in spec.bodies if body.name != "world"]
    roots = [name for name in names if spec.body(name).parent.name == "world"]
    return ", ".join(map(repr, roots)) or "there is no body"


def _add_motors(spec: Any, patterns: Sequence[str]) -> None:
    """Give hinges that are to be wheels a torque motor where they have none, as all of a URDF."""
    turned = {name for motor in spec.actuators for name in (motor.name, motor.target)}
    for pattern in patterns:
        if not any(fnmatchcase(name, pattern) for name in turned):
            for joint in spec.joints:
                if joint.type == _HINGE and fnmatchcase(joint.name, pattern):
                    name = f"{joint.name}_motor"
                    motor = spec.add_actuator(name=name, target=joint.name, trntype=_ON_JOINT)
                    motor.set_to_motor()


def _set_options(spec: Any, *, lands: bool) -> None:
    option = spec.option
    option.gravity, option.wind = np.zeros(3), np.zeros(3)
    option.density = option.viscosity = 0.0
    off = int(_DISABLE.mjDSBL_AUTORESET)
    if not lands:
        off |= int(_DISABLE.mjDSBL_CONTACT)
    option.disableflags = (option.disableflags | off) & ~int(_DISABLE.mjDSBL_ACTUATION)
    option.enableflags &= ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)


def _command_in_si(motor: Any, scale: float) -> None:
    """Let an actuator's command be what it applies, which is ``scale`` times that."""
    gain = motor.gainprm[0]
    motor.gear = np.array(motor.gear) * (gain / scale)
    motor.gainprm[0] = 1.0
    motor.ctrlrange = np.sort(np.array(motor.ctrlrange) * scale)
    motor.forcerange = np.sort(np.array(motor.forcerange) * (scale / gain))


def _is_constrained(model: Any) -> bool:
    """Tell whether anything but contacts constrains the motion."""
    frictions = model.dof_frictionloss.any() or model.tendon_frictionloss.any()
    limits = model.jnt_limited.any() or model.tendon_limited.any()
    return bool(limits or frictions or model.neq)
