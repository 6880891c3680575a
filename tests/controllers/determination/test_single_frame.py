"""TRIAD and the q method as estimators, in flight."""

import numpy as np
import pytest
from mjspace.controllers.determination.single_frame import SingleFrame

from mjspace import attitude as att
from mjspace.contract import Measurement
from mjspace.scenario.loading import load
from mjspace.simulation.assembly import assemble
from mjspace.simulation.initial_state import first_start
from mjspace.simulation.loop import fly, what_is_compiled

LAW = ("estimator.kind=single_frame:SingleFrame", "estimator.sun_noise='0.2 deg'",
       "estimator.field_noise='100 nT'")  # fmt: skip


@pytest.mark.parametrize("method", ["q_method", "triad"])
def test_its_error_is_that_of_the_sensors_and_it_holds_in_the_shadow(method: str) -> None:
    changes = (*LAW, f"estimator.method={method}", "duration='2400 s'", "checks=[]")
    built = assemble(
        *load("sun-magnetometer", [*changes, "environment.magnetic_field.model=dipole"])
    )
    assert what_is_compiled(built).startswith("compiled: sensors, law")
    blocks = list(fly(built, first_start(built, range(3)), range(3)))

    def rows(topic: str, field: str) -> np.ndarray:
        return np.concatenate([block.rows[topic][field] for block in blocks])

    dark = rows("/measurement", "sun_direction_valid")[..., 0] < 0.5
    error = np.linalg.norm(rows("/truth", "estimation_error"), axis=-1)
    # About the Sun's direction the field tells the angle, by 100 nT across 2e-5 T or more.
    assert 2e-3 < np.sqrt(np.mean(error[~dark] ** 2)) < 9e-3
    held = rows("/estimate", "attitude")[np.all(dark, axis=1)]
    assert len(held) > 200
    assert np.array_equal(held, np.broadcast_to(held[0], held.shape))


def test_exact_samples_give_the_attitude_and_none_the_identity() -> None:
    draw = np.random.default_rng(1)
    q, (sun, field) = att.normalize(draw.normal(size=(5, 4))), draw.normal(size=(2, 5, 3))
    sun = att.normalize(sun)
    seen = Measurement(
        sun_direction=att.rotate(att.conjugate(q), sun),
        magnetic_field=4e-5 * att.rotate(att.conjugate(q), field),
        sun_reference=sun,
        field_reference=4e-5 * field,
    )
    law = SingleFrame(sun_noise=1e-3, field_noise=1e-7)
    state, estimate = law.step(law.reset(seen), 0.0, seen)
    assert att.rotation_angle(estimate.attitude, q).max() < 1e-13
    dark = seen._replace(sun_direction=np.zeros((5, 3)))
    assert np.array_equal(law.step(state, 0.0, dark)[1].attitude, estimate.attitude)
    first = law.step(law.reset(dark), 0.0, dark)[1].attitude
    assert np.array_equal(first, np.tile([1.0, 0.0, 0.0, 0.0], (5, 1)))


def test_triad_trusts_the_sun_alone_and_the_q_method_both_by_their_weights() -> None:
    """Sun and field are measured apart by more than they are: who is turned, and by how much."""
    apart = 0.01  # rad, added to the angle between them
    q = att.normalize(np.array([0.3, -0.5, 0.7, 0.4]))
    sun, field = np.array([1.0, 0.0, 0.0]), np.array([0.6, 0.8, 0.0])
    moved = np.array([np.cos(np.arctan2(0.8, 0.6) + apart), np.sin(np.arctan2(0.8, 0.6) + apart)])
    strength, sun_noise, field_noise = 4e-5, 1e-3, 8e-8  # of the field's direction 2e-3
    seen = Measurement(
        sun_direction=att.rotate(att.conjugate(q), sun),
        magnetic_field=strength * att.rotate(att.conjugate(q), np.array([*moved, 0.0])),
        sun_reference=sun,
        field_reference=strength * field,
    )

    def off(method: str, **noise: float) -> float:
        """Return the angle [rad] from the Sun where it is to where the estimate has it."""
        gains = {"sun_noise": sun_noise, "field_noise": field_noise} | noise
        law = SingleFrame(method=method, **gains)
        estimate = law.step(law.reset(seen), 0.0, seen)[1].attitude
        found = att.rotate(estimate, seen.sun_direction)
        return float(np.arctan2(np.linalg.norm(np.cross(found, sun)), found @ sun))

    # Wahba's loss of two directions in a plane: each turns by the other's part of the weights, to
    # the third order in the angle, 1e-6 / 12.
    share = (strength / field_noise) ** 2 / ((strength / field_noise) ** 2 + sun_noise**-2)
    assert share == pytest.approx(0.2)
    assert off("q_method") == pytest.approx(share * apart, abs=1e-6)
    assert off("q_method", field_noise=strength * sun_noise) == pytest.approx(0.5 * apart, abs=1e-6)
    assert off("triad") < 1e-15
    assert off("triad", field_noise=strength * sun_noise) < 1e-15
