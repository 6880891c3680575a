"""Sloshing propellant: its frequencies, damping and momentum, against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from compiled_flights import SHORT_BLOCKS, Flown, assert_same, flown
from moving_parts import HELD, built, decay_of, fly

from mjspace.errors import InputError

pytestmark = SHORT_BLOCKS

MASS, BUS, INERTIA = 20.0, 80.0, np.array([30.0, 40.0, 25.0])
SPRING = {"model": "spring", "mass": MASS, "frequency": "0.6 Hz"}
PENDULUM = {"model": "pendulum", "mass": MASS, "arm": 0.4}
RATE = 2.0 * np.pi * 0.6
FREE = {"mass": BUS, "bus_inertia": np.diag(INERTIA).tolist(), "wheels": {"axes": []}}

ROCKET = """
<mujoco>
  <worldbody>
    <body name="stage">
      <freejoint/>
      <inertial pos="0 0 0" mass="80" diaginertia="30 40 25"/>
      <geom type="cylinder" size="0.5 1" mass="0"/>
      <site name="engine" pos="0 0 -1"/>
    </body>
  </worldbody>
  <actuator><motor name="engine" site="engine" gear="0 0 1 0 0 0" ctrlrange="0 1000"/></actuator>
</mujoco>
"""
BURN = """
from typing import NamedTuple
import numpy as np
class Command(NamedTuple):
    thruster_force: np.ndarray
class Burn:
    batched = True
    def __init__(self, thrust: float):
        self.thrust = thrust
    def reset(self, measurement, reference):
        return None
    def step(self, state, time, measurement, reference):
        return None, Command(np.full((*measurement.rate.shape[:-1], 1), self.thrust)), ()
"""


def burn(folder: Path, thrust: float, tank: dict[str, Any], start: dict[str, float]) -> Flown:
    """Return the flight of a stage under constant thrust, whose pendulum starts off its rest."""
    (folder / "rocket.xml").write_text(ROCKET)
    (folder / "burn.py").write_text(BURN)
    return fly(
        {"model": "rocket.xml", "slosh": {"tank": tank}},
        folder=folder,
        law={"kind": "burn.py:Burn", "thrust": thrust},
        initial={"joint_position": start},
        duration=8.0,
    )


@pytest.mark.parametrize("ratio", [0.0, 0.05])
def test_a_spring_in_a_held_tank_has_the_frequency_and_damping_of_the_keys(ratio: float) -> None:
    tank = SPRING | {"damping_ratio": ratio, "position": [0.3, 0, 0.2], "euler": [0, "30 deg", 0]}
    start = {"joint_position": {"tank_slide_x": 0.02, "tank_slide_y": 0.01}}
    flight = fly(HELD | {"slosh": {"tank": tank}}, initial=start)
    for component in (0, 1):
        place = flight.rows["/truth.tank_displacement"][:, 0, component]
        assert place[0] == pytest.approx(0.02 / (component + 1), rel=1e-12)
        frequency, damping = decay_of(place, 0.01)
        assert frequency == pytest.approx(RATE, rel=1e-6)
        assert damping == pytest.approx(ratio, abs=1e-6)


def test_a_spring_off_the_centre_of_mass_swings_with_the_bus() -> None:
    """The slide's two ends are free: w^2 = k (1/m + 1/M + d^2/I), d off the slide's line."""
    above = 0.7
    plant = FREE | {"slosh": {"tank": SPRING | {"position": [0, 0, above]}}}
    flight = fly(plant, initial={"joint_position": {"tank_slide_x": 1e-4}})
    frequency, _ = decay_of(flight.rows["/truth.tank_displacement"][:, 0, 0], 0.01)
    stiffness = MASS * RATE**2
    # The slosh itself turns with the bus: its own moment of inertia is nil.
    inverse = 1.0 / MASS + 1.0 / BUS + above**2 / INERTIA[1]
    assert frequency == pytest.approx(np.sqrt(stiffness * inverse), rel=1e-5)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_a_pendulum_in_an_accelerated_stage_swings_with_it(tmp_path: Path, axis: str) -> None:
    """Hung in the bus's centre of mass it pulls there: w^2 = (a/L) (1 + m/M) = F/(M L)."""
    thrust = 300.0
    flight = burn(tmp_path, thrust, PENDULUM, {f"tank_swing_{axis}": 5e-3})
    place = flight.rows["/truth.tank_displacement"][:, 0, 1 if axis == "x" else 0]
    frequency, damping = decay_of(place, 0.01)
    # The amplitude's share is A^2/16 = 1.6e-6.
    assert frequency == pytest.approx(np.sqrt(thrust / (BUS * 0.4)), rel=5e-6)
    assert damping == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("length", [{"arm": 0.4}, {"frequency": np.sqrt(2.5 / 0.4) / (2 * np.pi)}])
def test_a_light_pendulum_has_frequency_and_damping_of_its_acceleration(
    tmp_path: Path, length: dict[str, float]
) -> None:
    tank = {"model": "pendulum", "mass": 8e-4, "acceleration": 2.5, "damping_ratio": 0.03}
    flight = burn(tmp_path, 2.5 * BUS, tank | length, {"tank_swing_y": 2e-3})
    frequency, damping = decay_of(flight.rows["/truth.tank_displacement"][:, 0, 0], 0.01)
    # The stage of 80 kg gives way by 1e-5 of the mass: 5e-6 of the frequency.
    assert frequency == pytest.approx(np.sqrt(2.5 / 0.4), rel=1e-5)
    assert damping == pytest.approx(0.03, rel=1e-4)


def test_without_acceleration_a_pendulum_stays_where_it_is() -> None:
    plant = FREE | {"slosh": {"tank": PENDULUM | {"position": [0.1, 0, 0.3]}}}
    flight = fly(plant, initial={"joint_position": {"tank_swing_x": 0.3}}, duration=0.5)
    place = flight.rows["/truth.tank_displacement"][:, 0]
    assert np.abs(place - [0.0, 0.4 * np.sin(0.3)]).max() < 1e-12


@pytest.mark.parametrize("tank", [SPRING, PENDULUM])
def test_momentum_and_energy_are_conserved(tank: dict[str, Any]) -> None:
    joint = "tank_slide_x" if tank is SPRING else "tank_swing_x"
    start = {"rate": [0.3, -0.2, 0.4], "joint_position": {joint: 0.05}}
    plant = FREE | {"slosh": {"tank": tank | {"position": [0.1, 0.05, 0.4]}}}
    rows = fly(plant, initial=start).rows
    momentum, energy = rows["/truth.momentum"][:, 0], rows["/truth.energy"][:, 0, 0]
    if tank is SPRING:
        energy = energy + 0.5 * MASS * RATE**2 * np.sum(
            rows["/truth.tank_displacement"][:, 0] ** 2, axis=-1
        )
    # RK4 at 2 ms and 0.6 Hz: (w h)^4 = 3e-9 of a part of 20 N m s, measured below 2e-11.
    assert np.abs(momentum - momentum[0]).max() < 1e-10
    assert np.ptp(energy) < 1e-10


def test_slosh_flies_compiled_bit_for_bit() -> None:
    start = {"rate": [0.3, -0.2, 0.4], "joint_position": {"tank_slide_x": 0.05}}
    tanks = {"tank": SPRING, "upper": PENDULUM | {"position": [0, 0, 0.5]}}
    assembly = built({"slosh": tanks}, initial=start)
    compiled = flown(assembly)
    assert compiled.compiled.startswith("compiled: sensors, law, actuators and step effects")
    assert_same(compiled, flown(assembly, compiled=False))


@pytest.mark.parametrize(
    ("tank", "text"),
    [
        (SPRING | {"frequency": None}, "tank.frequency: missing, a spring needs it"),
        (SPRING | {"arm": 1.0}, "tank.arm: a spring has none, a pendulum has"),
        (PENDULUM | {"frequency": 1.0}, "tank: a pendulum has either an arm or a frequency"),
        (PENDULUM | {"arm": None}, "tank: a pendulum has either an arm or a frequency"),
        (PENDULUM | {"damping_ratio": 0.1}, "tank.acceleration: missing, .*damping"),
        (
            PENDULUM | {"arm": None, "frequency": 1.0},
            "tank.acceleration: missing, .*frequency",
        ),
        (PENDULUM | {"model": "ball"}, "tank.model: got 'ball'"),
    ],
)
def test_unfit_keys_are_refused(tank: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=f"plant.slosh.{text}"):
        built({"slosh": {"tank": tank}})
