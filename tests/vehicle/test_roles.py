"""What the motors of a user's own model are taken for."""

import numpy as np
import pytest
from own_models import SENSED, source

from mjspace.scenario.plant import Roles
from mjspace.vehicle import own_model
from mjspace.vehicle.roles import Recognized, places_and_directions


def recognized(text: str, **roles: object) -> Recognized:
    return own_model.prepare(own_model.read(source(text)), Roles(**roles))[0]


def names(found: Recognized, role: str) -> list[str]:
    return [motor.name for motor in getattr(found, role)]


def test_kinds_tell_wheels_thrusters_and_others() -> None:
    found = recognized(SENSED)
    assert names(found, "wheels") == ["m1", "m2", "rw3_motor"]
    assert [motor.drives for motor in found.wheels] == ["rw1", "rw2", "rw3"]
    assert names(found, "thrusters") == ["jet"]
    assert names(found, "others") == ["elbow_servo"]
    assert found.gimbals == ("elbow",)
    driven = found.driven
    assert driven.motors == ("m1", "m2", "rw3_motor", "jet", "elbow_servo")
    assert driven.wheels == ("rw1", "rw2", "rw3")
    assert driven.gimbals == ("elbow",)


def test_limits_are_of_torque_and_force() -> None:
    found = recognized(SENSED)
    limits = {motor.name: (motor.least, motor.largest) for motor in found.wheels}
    assert limits["m1"] == pytest.approx((-0.01, 0.01))
    assert limits["m2"] == pytest.approx((-0.02, 0.03))
    assert limits["rw3_motor"] == (-np.inf, np.inf)
    assert [motor.either_way for motor in found.wheels] == pytest.approx([0.01, 0.02, np.inf])
    assert (found.thrusters[0].least, found.thrusters[0].largest) == (0.0, 2.0)
    assert (found.others[0].least, found.others[0].largest) == (-1.0, 1.0)


def test_the_gain_of_a_motor_counts_as_its_gear_does() -> None:
    text = SENSED.replace(
        '<motor name="m2"', '<general gainprm="3" ctrlrange="-0.001 0.001" name="m2"'
    )
    spec = own_model.read(source(text))
    found, _ = own_model.prepare(spec, Roles())
    assert [(m.name, m.largest) for m in found.wheels[:2]] == [("m1", 0.01), ("m2", 0.003)]
    motor = spec.actuator("m2")
    assert (motor.gainprm[0], motor.gear[0]) == (1.0, 1.0)
    np.testing.assert_allclose(motor.ctrlrange, [-0.003, 0.003])


ROTOR = '<body name="r"><joint name="r" axis="0 0 1"/><geom type="cylinder" size=".03 .01"/></body>'


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ('<geom type="capsule" fromto="0 0 0 0 0 0.3" size="0.01" mass="0.5"/>', "it is on an arm"),
        ('<geom type="cylinder" size="0.03 0.01" mass="0.2"/>', "it is on a wheel, then a gimbal"),
    ],
)
def test_what_does_not_turn_on_the_bus_alone_is_no_wheel(place: str, reason: str) -> None:
    assert place in SENSED
    text = SENSED.replace(place, place + ROTOR).replace(
        "</actuator>", '<motor name="r" joint="r"/></actuator>'
    )
    wheels = names(recognized(text), "wheels")
    assert "r" not in wheels, reason
    assert ("rw3_motor" in wheels) is ("arm" in reason)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (("1 0 0", '1 0 0" range="-90 90'), "a stop"),
        (("1 0 0", '1 0 0" pos="0 0.01 0'), "off its axis"),
        (("1 0 0", "0 0 1"), "not its axis of symmetry"),
        (("1 0 0", '1 0 0" stiffness="1'), "a spring"),
        (('<motor name="m1"', '<velocity name="m1"'), "a servo"),
    ],
)
def test_what_is_no_wheel(change: tuple[str, str], reason: str) -> None:
    changed = SENSED.replace(*change, 1)
    assert changed != SENSED
    found = recognized(changed)
    assert "m1" not in names(found, "wheels"), reason
    assert "m1" in names(found, "others")


def test_patterns_choose_and_order_the_wheels() -> None:
    found = recognized(SENSED, wheels=["rw3", "m?"])
    assert names(found, "wheels") == ["rw3_motor", "m1", "m2"]
    found = recognized(SENSED, wheels=["m1"], thrusters=[])
    assert names(found, "wheels") == ["m1"]
    assert names(found, "thrusters") == []
    assert names(found, "others") == ["elbow_servo", "m2", "jet", "rw3_motor"]
    assert found.gimbals == ("elbow", "rw2", "rw3")


@pytest.mark.parametrize(
    ("roles", "message"),
    [
        ({"wheels": ["x*"]}, r"plant\.roles\.wheels: 'x\*' matches no motor.*m1, elbow_servo"),
        (
            {"wheels": ["elbow"]},
            "the motor 'elbow_servo' cannot be one of the wheels, which",
        ),
        ({"thrusters": ["m1"]}, "the motor 'm1' cannot be one of the thrusters, which are forces"),
        ({"bus": "hup"}, r"plant\.roles\.bus: no body 'hup': did you mean 'hub'\?"),
        ({"bus": "arm"}, "'arm' cannot be freed: it is on the body 'hub'"),
    ],
)
def test_roles_that_fit_nothing_are_refused(roles: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        recognized(SENSED, **roles)


BODY = '<body name="{}">{}<geom size="0.1" mass="1"/></body>'
MODEL = "<mujoco><worldbody>{}</worldbody></mujoco>"


@pytest.mark.parametrize(
    ("bodies", "message"),
    [
        ([("a", "")], "no free joint"),
        (
            [("a", '<joint name="j"/>')],
            "no free joint: .* which frees it: 'a'",
        ),
        ([("a", '<joint name="j"/>'), ("b", "<freejoint/>")], "the joint 'j' comes before 'b'"),
    ],
)
def test_models_that_cannot_fly_are_refused(bodies: list[tuple[str, str]], message: str) -> None:
    text = MODEL.format("".join(BODY.format(*each) for each in bodies))
    with pytest.raises(ValueError, match=message):
        recognized(text)


def test_a_body_that_is_named_as_bus_is_freed() -> None:
    spec = own_model.read(source(MODEL.format(BODY.format("a", ""))))
    own_model.prepare(spec, Roles(bus="a"))
    assert own_model.compiled(spec).nv == 6


def test_where_thrusters_push_and_how() -> None:
    spec = own_model.read(source(SENSED))
    found, model = own_model.prepare(spec, Roles())
    places, ways = places_and_directions(model, found.thrusters)
    np.testing.assert_allclose(places, [[0.0, 0.02, -0.15]], atol=1e-15)
    np.testing.assert_allclose(ways, [[1.0, 0.0, 0.0]], atol=1e-15)
