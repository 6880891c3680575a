"""Flexible panels: frequencies, damping, momentum and energy, against closed forms."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from compiled_flights import SHORT_BLOCKS, assert_same, flown
from moving_parts import HELD, PANEL, SIDES, built, decay_of, fly, modes, position_of

from mjspace.errors import InputError
from mjspace.vehicle import stability

pytestmark = SHORT_BLOCKS

RATE = 2.0 * np.pi * 0.5
BEAM = {"first": 1.87510407, "second": 4.69409113}
"""Roots of cos x cosh x = -1, of a uniform cantilever."""


def panels(*sides: str, **keys: object) -> dict[str, dict[str, Any]]:
    return {"panels": {side: PANEL | SIDES[side] | keys for side in sides}}


@pytest.mark.parametrize("segments", [1, 2, 4, 8])
def test_first_cantilevered_frequency_is_that_of_the_key(segments: int) -> None:
    frequencies, _ = modes(built(HELD | panels("left", segments=segments)))
    # The bus of 1e8 kg m^2 gives way by 30/1e8 of the stiffness; measured 2e-7.
    assert frequencies[0] == pytest.approx(RATE, rel=5e-7)


# Of the chain's own equations, integrated segment by segment by hand, as no part of mjspace is.
@pytest.mark.parametrize(("segments", "ratio"), [(2, 5.1511), (4, 5.8777), (8, 6.1592)])
def test_second_frequency_approaches_the_beams(segments: int, ratio: float) -> None:
    frequencies, _ = modes(built(HELD | panels("left", segments=segments)))
    assert frequencies[1] / frequencies[0] == pytest.approx(ratio, abs=1e-4)
    beam = (BEAM["second"] / BEAM["first"]) ** 2  # 6.267
    # Of second order in the length of a segment.
    assert 0.7 < (1.0 - ratio / beam) * segments**2 < 1.15


@pytest.mark.parametrize("ratio", [0.0, 0.02])
def test_a_free_decay_has_the_frequency_and_the_damping_of_the_keys(ratio: float) -> None:
    plant = HELD | panels("left", damping_ratio=ratio)
    still = built(plant)
    shape = modes(still)[1][:, 0]
    # A tip of 3 mm: the frequency's change with the amplitude is below 1e-6.
    start = position_of(still, 1e-3 * shape / np.abs(shape).max())
    flight = fly(plant, initial={"joint_position": start}, duration=6.0)
    tip = flight.rows["/truth.left_deflection"][:, 0, 0]
    frequency, damping = decay_of(tip, 0.01)
    assert frequency == pytest.approx(RATE, rel=1e-5)
    assert damping == pytest.approx(ratio, abs=1e-6)
    crest = round(2.0 / np.sqrt(1.0 - ratio**2) / 0.01)  # one period later
    decrement = np.log(tip[0] / tip[crest])
    assert decrement == pytest.approx(2.0 * np.pi * ratio / np.sqrt(1.0 - ratio**2), abs=2e-4)


def test_free_frequency_of_one_segment_is_that_derived_by_hand() -> None:
    """A plate on a spring and a bus, in a plane: theta of the bus, q of the hinge.

    With the reduced mass u = m M/(m + M) and the plate's centre at x = r + L/2 the energy is
    1/2 (I + Ip + u x^2) theta'^2 + (Ip + u x L/2) theta' q' + 1/2 (Ip + u L^2/4) q'^2 + 1/2 k q^2.
    """
    bus, inertia, r, m, length = 60.0, 8.0, 0.4, 10.0, 3.0
    wheelless = {"mass": bus, "bus_inertia": np.diag([inertia, 9.0, 10.0]).tolist()}
    plant = wheelless | {"wheels": {"axes": []}} | panels("left", segments=1)
    own, reduced, x = m * length**2 / 12.0, m * bus / (m + bus), r + length / 2.0
    stiffness = RATE**2 * m * length**2 / 3.0
    whole, coupled, alone = (
        inertia + own + reduced * x**2,
        own + reduced * x * length / 2.0,
        own + reduced * length**2 / 4.0,
    )
    expected = np.sqrt(stiffness / (alone - coupled**2 / whole))
    assert modes(built(plant))[0][-1] == pytest.approx(expected, rel=1e-8)
    flight = fly(plant, initial={"joint_position": {"left_hinge_0": 1e-3}}, duration=3.0)
    frequency, _ = decay_of(flight.rows["/truth.left_deflection"][:, 0, 0], 0.01)
    assert frequency == pytest.approx(expected, rel=1e-5)  # measured 1e-6, of the amplitude


@pytest.mark.parametrize("segments", [1, 4])
def test_free_frequency_with_two_panels_is_that_of_hybrid_coordinates(segments: int) -> None:
    """P. W. Likins's hybrid coordinates: w_ff^2 = w^2/(1 - sum delta^2/I) of one mode a panel.

    delta is the coupling of a mode of unit modal mass to the bus's rate, I the inertia of all.
    """
    inertia, r, m, length = 8.0, 0.4, 10.0, 3.0
    bus = {"mass": 60.0, "bus_inertia": np.diag([inertia, 9.0, 10.0]).tolist()}
    plant = bus | {"wheels": {"axes": []}} | panels("left", "right", segments=segments)
    whole = inertia + 2.0 * (m * length**2 / 12.0 + m * (r + length / 2.0) ** 2)
    held = built(HELD | panels("left", segments=segments))
    rates, shapes = modes(held)
    matrix = stability.mass_matrix(held.vehicle.model)
    delta = matrix[3, 6:] @ shapes[6:]  # of shapes with unit modal mass, to the rate about x
    if segments == 1:
        expected = RATE / np.sqrt(1.0 - 2.0 * delta[0] ** 2 / whole)
    else:
        # Of several modes: (w_i^2) x = w_ff^2 (1 - 2 delta delta^T/I) x.
        reduced = np.eye(segments) - 2.0 * np.outer(delta, delta) / whole
        expected = np.sqrt(scipy.linalg.eigh(np.diag(rates**2), reduced, eigvals_only=True)[0])
    found = modes(built(plant))[0]
    # What holds the panel for delta gives way by 1e-7, which 1 - sum delta^2/I = 0.09 enlarges.
    assert np.abs(found / expected - 1.0).min() < 5e-6


def test_momentum_and_energy_are_conserved_to_the_order_of_the_integrator() -> None:
    joints = {"left_hinge_0": 0.05, "right_hinge_2": -0.08}  # with modes up to 14 Hz
    start = {"joint_position": joints, "rate": [0.1, 0.2, 0.05]}
    plant = panels("left", "right")
    errors = []
    for step in (4e-3, 2e-3):
        rates = {"physics": step, "control": 2e-2}
        assembly = built(plant, initial=start, rates=rates)
        rows = flown(assembly).rows
        momentum, energy = rows["/truth.momentum"][:, 0], rows["/truth.energy"][:, 0, 0]
        model = assembly.vehicle.model
        for side in SIDES:
            first = model.joint(f"{side}_hinge_0").id
            angles = rows[f"/truth.{side}_hinge_angle"][:, 0]
            energy = energy + 0.5 * angles**2 @ model.jnt_stiffness[first : first + 4]
        errors.append([np.abs(momentum - momentum[0]).max(), np.ptp(energy)])
    # Measured 2e-7 of 12 N m s, and 1.4e-4 of 7 J; at half the step a 28th and a 31st.
    assert errors[1][0] < 4e-7
    assert errors[1][1] < 3e-4
    assert np.all(np.array(errors[0]) > 16.0 * np.array(errors[1]))


def test_a_panel_flies_compiled_bit_for_bit() -> None:
    start = {"joint_position": {"left_hinge_0": 0.05}, "rate": [0.1, 0.2, 0.05]}
    assembly = built(panels("left", damping_ratio=0.01), initial=start)
    compiled = flown(assembly)
    assert compiled.compiled.startswith("compiled: sensors, law, actuators and step effects")
    assert_same(compiled, flown(assembly, compiled=False))


def test_mass_counts_as_that_of_parts() -> None:
    plain, with_panels = built({}).vehicle, built(panels("left", "right")).vehicle
    assert np.array_equal(plain.inertia, with_panels.inertia)
    assert with_panels.model.body_subtreemass[1] == plain.model.body_subtreemass[1] + 20.0
    whole = {"vehicle_mass": 120.0, "vehicle_inertia": np.diag([120.0, 30.0, 120.0]).tolist()}
    told = built(whole | panels("left", "right")).vehicle
    # Less the wheels' axial inertia, as every law's.
    assert np.allclose(told.inertia, np.diag([119.95, 29.95, 119.95]), rtol=1e-15)
    assert stability.mass_matrix(told.model)[3, 3] == pytest.approx(120.0, rel=1e-12)


OWN = """
<mujoco>
  <compiler {compiler}/>
  <default><joint armature="0.1" damping="2"/></default>
  <worldbody>
    <body name="hull"><freejoint/><geom type="box" size="0.4 0.4 0.4" mass="60"/></body>
  </worldbody>
</mujoco>
"""


def test_a_model_of_ones_own_has_them_in_its_inertia_and_no_say_in_them(tmp_path: Path) -> None:
    (tmp_path / "box.xml").write_text(OWN.format(compiler='boundmass="4" inertiafromgeom="true"'))
    assembly = built({"model": "box.xml"} | panels("left", "right"), folder=tmp_path)
    model = assembly.vehicle.model
    assert not model.dof_armature.any()
    assert not model.dof_damping.any()
    each = 10.0 * 3.0**2 / 12.0 + 10.0 * 1.9**2
    assert assembly.vehicle.inertia[0, 0] == pytest.approx(60 * 0.8**2 / 6 + 2 * each, rel=1e-12)


def test_a_model_that_scales_all_masses_is_refused(tmp_path: Path) -> None:
    (tmp_path / "box.xml").write_text(OWN.format(compiler='settotalmass="70"'))
    with pytest.raises(InputError, match=r"^plant.model: its settotalmass, 70 kg, .* mass of left"):
        built({"model": "box.xml"} | panels("left"), folder=tmp_path)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"frequency": "0.5 s"}, "plant.panels.left.frequency.* has the unit 's', should be"),
        ({"segments": 0}, "plant.panels.left.segments: got 0"),
        ({"damping_ratio": 1.0}, "plant.panels.left.damping_ratio: got 1"),
        ({"stiffness": 1.0}, "plant.panels.left.stiffness: no such key"),
        ({"frequency": "200 Hz"}, "left_hinge_1' has .*; use a step below"),
    ],
)
def test_unfit_keys_are_refused(keys: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text):
        built(panels("left", **keys))
