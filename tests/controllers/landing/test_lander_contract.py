"""What each lander law must do: purity, any leading axes, either quaternion, one cut for good."""

from typing import Any

import numpy as np
import pytest
from lander_laws import LANDS_BEHIND_LAGS, PRINTED
from lander_oracle import slope_of
from mjspace.controllers.landing.descent import SineDescent
from mjspace.controllers.landing.guidance import BezierDescent
from mjspace.controllers.landing.lander import VariableStructure
from mjspace.controllers.landing.lander_vectoring import ThrustVectoring

from mjspace import attitude as att
from mjspace.contract import Array, Measurement, Trajectory

LAWS = {
    "O3": (LANDS_BEHIND_LAGS, SineDescent()),
    "printed": (PRINTED, SineDescent()),
    "vectoring": (ThrustVectoring(control_period=0.02), BezierDescent()),
}
laws = pytest.mark.parametrize(("law", "source"), LAWS.values(), ids=LAWS)


def readings(count: int, rows: int) -> list[Measurement]:
    """Return measurements of dispersed vehicles that no law may write to."""
    rng = np.random.default_rng(5)
    found = []
    for _ in range(rows):
        tilt = att.from_rotation_vector(rng.normal(0.0, 0.2, (count, 3)))
        seen = Measurement(
            att.multiply(att.from_rotation_vector(np.array([0.0, 0.0, 0.6435])), tilt),
            rng.normal(0.0, 0.05, (count, 3)),
            np.zeros((count, 0)),
            position=rng.normal((2000.0, 1500.0, 1000.0), 20.0, (count, 3)),
            velocity=rng.normal((-19.0, -14.0, -10.0), 2.0, (count, 3)),
            contact=np.zeros((count, 1)),
        )
        for array in seen:
            array.flags.writeable = False
        found.append(seen)
    return found


def wanted(source: Any, rows: int) -> list[Trajectory]:
    parts = source.at(0.02 * np.arange(rows))
    for array in parts:
        array.flags.writeable = False
    return [Trajectory(*(part[k] for part in parts)) for k in range(rows)]


def of(seen: Measurement, rows: slice, lead: tuple[int, ...] = (1,)) -> Measurement:
    cut = (a[rows] if len(a) else np.zeros((len(seen.rate[rows]), 0)) for a in seen)
    return Measurement(*(a.reshape(*lead, a.shape[-1]) for a in cut))


def fields(result: tuple[Any, ...]) -> list[Array]:
    return [array for part in result for array in part]


@laws
def test_alone_and_in_a_batch_are_the_same_bits(law: Any, source: Any) -> None:
    flight, reference = readings(16, 20), wanted(source, 20)
    state = law.reset(flight[0], reference[0])
    lone = [law.reset(of(flight[0], slice(i, i + 1)), reference[0]) for i in range(16)]
    shapes = [array.shape for array in state]
    for k in range(20):
        result = law.step(state, 0.02 * k, flight[k], reference[k])
        again = law.step(state, 0.02 * k, flight[k], reference[k])
        for one, other in zip(fields(result), fields(again), strict=True):
            assert np.array_equal(one, other)
            assert one.shape[0] == 16
            assert one.ndim == 2
            assert not any(np.shares_memory(one, given) for given in (*state, *flight[k]))
        for i in range(16):
            rows = slice(i, i + 1)
            alone = law.step(lone[i], 0.02 * k, of(flight[k], rows), reference[k])
            lone[i] = alone[0]
            for one, other in zip(fields(result), fields(alone), strict=True):
                assert np.array_equal(one[rows], other)
        state = result[0]
        assert [array.shape for array in state] == shapes


@laws
def test_any_leading_axes_will_do(law: Any, source: Any) -> None:
    seen, reference = readings(6, 1)[0], wanted(source, 1)[0]
    flat = law.step(law.reset(seen, reference), 0.0, seen, reference)
    for lead in ((2, 3), ()):
        some = of(seen, slice(0, int(np.prod(lead))), lead)
        result = law.step(law.reset(some, reference), 0.0, some, reference)
        for one, other in zip(fields(result), fields(flat), strict=True):
            assert one.shape[:-1] == lead
            assert np.array_equal(one.reshape(-1, one.shape[-1]), other[: int(np.prod(lead))])


@laws
def test_either_sign_of_either_quaternion(law: Any, source: Any) -> None:
    seen, reference = readings(5, 1)[0], wanted(source, 1)[0]
    state = law.reset(seen, reference)
    plain = law.step(state, 0.0, seen, reference)
    for flipped, other in (
        (seen._replace(attitude=-seen.attitude), reference),
        (seen, reference._replace(attitude=-reference.attitude)),
    ):
        result = law.step(state, 0.0, flipped, other)
        assert all(np.array_equal(a, b) for a, b in zip(fields(plain), fields(result), strict=True))


@laws
def test_engine_is_cut_at_contact_for_good(law: Any, source: Any) -> None:
    seen, reference = readings(3, 1)[0], wanted(source, 1)[0]
    state = law.reset(seen, reference)
    bounced = seen._replace(contact=np.array([[0.0], [1.0], [0.0]]))
    state, command, _ = law.step(state, 0.0, bounced, reference)
    _, later, _ = law.step(state, 0.02, seen, reference)
    for given in (command, later):
        assert given.thrust[1] == 0.0
        assert not given.gimbal[1].any()
        assert np.all(given.thrust[[0, 2]] >= 0.0)
        assert given.gimbal[[0, 2]].all()
    blind = seen._replace(contact=np.zeros((3, 0)))  # no such sensor
    assert not law.step(law.reset(blind, reference), 0.0, blind, reference)[0].cut.any()


@laws
def test_a_bad_measurement_is_not_hidden(law: Any, source: Any) -> None:
    seen, reference = readings(2, 1)[0], wanted(source, 1)[0]
    position = seen.position.copy()
    position[0, 2] = np.nan
    with np.errstate(invalid="ignore"):  # NumPy may warn of it, too
        _, command, _ = law.step(
            law.reset(seen, reference), 0.0, seen._replace(position=position), reference
        )
    assert np.isnan(command.thrust[0]).all()
    assert np.isfinite(command.thrust[1]).all()


def test_the_gimbals_turn_the_thrust_as_the_command_says() -> None:
    """The outer ring turns about our y by b2, and the nozzle in it about our -x by b1."""
    b1, b2 = 0.2, -0.3
    ring = att.from_rotation_vector(np.array([0.0, b2, 0.0]))
    nozzle = att.from_rotation_vector(np.array([-b1, 0.0, 0.0]))
    thrust = att.rotate(att.multiply(ring, nozzle), np.array([0.0, 0.0, 160.0]))
    torque = np.cross([0.0, 0.0, -1.0], thrust)
    place = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    pushed, coasting = (slope_of(np.array([*place, F, b1, b2, 0.0])) for F in (160.0, 0.0))
    found = pushed - coasting
    np.testing.assert_allclose(100.0 * found[[4, 5, 3]], thrust, rtol=1e-12)
    np.testing.assert_allclose(found[[11, 12, 10]] * [90.0, 80.0, 100.0], torque, atol=1e-12)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (
            lambda: VariableStructure(coordinates="local"),
            "'local', should be one of polar, scaled, frozen",
        ),
        (lambda: VariableStructure(surface_gain=np.zeros(3)), "should have no zero"),
        (
            lambda: VariableStructure(thrust_range=np.array([9.0, 1.0])),
            "thrust_range: .* the least, then",
        ),
        (
            lambda: ThrustVectoring(control_period=0.0),
            "control_period: got 0 s, should be greater than 0",
        ),
        (lambda: ThrustVectoring(control_period=0.02, integral_gain=0.02), "less than .* = 0.0128"),
        (lambda: ThrustVectoring(control_period=0.02, thrust_range=np.zeros(2)), "thrust_range"),
    ],
)
def test_gains_that_cannot_work_are_refused(build: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        build()
