"""Terms of the native environment: what registers them, and which machine code flies them."""

import subprocess
import sys
from typing import Any

import mujoco
import numba
import numpy as np
import pytest

from mjspace.contract import Array
from mjspace.environment import kernel, struct_offsets, terms
from mjspace.environment.install import userdata
from mjspace.environment.orbit import Orbit
from mjspace.environment.torque_ripple import TorqueRipple
from mjspace.scenario.environment import Environment

BODY = """<mujoco><size nuserdata="40"/><worldbody><body name="bus"><freejoint/>
  <inertial pos="0 0 0" mass="50" diaginertia="12 14 5"/></body></worldbody></mujoco>"""


def test_kinds_of_blocks_are_those_of_logs() -> None:
    names = {kind: vars(kernel)["__name__"] for kind, kernel in terms.kernels().items()}
    assert names == {
        1: "tidal",
        2: "body_torque",
        3: "inertial_torque",
        5: "ripple",
        6: "central",
        7: "magnetic",
        8: "friction",
        9: "drag",
        10: "connect",
        11: "press",
        12: "magnetic",
        13: "drag_along",
        14: "vibrate",
        15: "magnetize",
    }


def test_two_terms_of_one_kind_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(TorqueRipple, "kernels", {6: None})
    message = "CentralGravity and TorqueRipple both have blocks of kind 6: 16 is free"
    with pytest.raises(ValueError, match=message):
        terms.kernels()


def test_a_payload_of_another_size_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def pack(self: Orbit, model: Any, environment: Environment) -> Array:
        return np.zeros(11)

    monkeypatch.setattr(Orbit, "pack", pack)
    outside = Environment(orbit=Orbit(semi_major_axis=7e6))
    with pytest.raises(ValueError, match=r"Orbit.pack returned .* \(11,\), should be \(10,\)"):
        userdata(mujoco.MjModel.from_xml_string(BODY), outside)


def test_changed_terms_are_never_flown_by_cached_machine_code(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    # the time to compile is the terms'
    monkeypatch.setattr(kernel, "add_forces", numba.njit(lambda userdata, time, bodies: None))

    def hits(version: int) -> int:
        return kernel.passive_callback(*struct_offsets.find(), version).cache_hits

    assert [hits(1), hits(1), hits(3)] == [0, 1, 0]


def test_the_version_of_the_terms_is_that_of_their_text(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Any
) -> None:
    (tmp_path / "term.py").write_text("1.0")
    monkeypatch.setattr(kernel, "__file__", str(tmp_path / "kernel.py"))
    before = kernel.version_of_terms()
    assert before == kernel.version_of_terms() != 0
    (tmp_path / "term.py").write_text("1.1")
    assert kernel.version_of_terms() != before


def test_the_environment_is_read_without_the_compiler_and_the_physics() -> None:
    code = (
        "import sys; sys.modules.update(numba=None, mujoco=None)\n"
        "from mjspace.scenario.environment import Environment\n"
        "orbit = {'semi_major_axis': '7000 km'}\n"
        "Environment.model_validate({'orbit': orbit, 'magnetic_field': {}})"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
