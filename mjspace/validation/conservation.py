"""Conservation of momentum and energy of a model in free flight."""

import copy
from collections.abc import Iterator
from typing import Any, NamedTuple

import mujoco
import numpy as np

from mjspace.contract import Array
from mjspace.validation import meter, model_ties, stand
from mjspace.validation.benchmark import Bound, Conditions
from mjspace.validation.results import Row

MINUTE = 60.0  # s, for which conservation is observed and steps are advised
MOST_STEPS = 600_000
"""Largest number of steps of the flight of a single body (60,000 for a minute at 1 ms); a model of
n dofs gets 1 + n / 10 times fewer."""
CONSERVED = 1e-8
"""Allowed relative drift in a minute: a thousandth of a star tracker's resolution."""
STRUCK = 1e-6
"""Likewise where a stop is hit: in such a step no integrator has its order."""


class Bus(NamedTuple):
    """Momentum and energy of the bus, the scale of drifts."""

    momentum: float  # N m s
    energy: float  # J


class Flight:
    """A free flight, with the conserved quantities that can be judged."""

    def __init__(self, model: Any, start: Any, tolerance: float) -> None:
        """Fly ``model`` from ``start`` (``MjData``).

        ``tolerance`` is that of the file's constraint solver, in place of the model's.
        """
        self._model, self._start, self._tolerance = model, start, tolerance
        self._most = int(MOST_STEPS / (1.0 + model.nv / 10.0))
        self.duration = min(MINUTE, self._most * model.opt.timestep)
        self._record = self._fly(model)
        self._held = model_ties.to_the_world(model)
        self._soft = model_ties.soft(model)
        self.hits_stops = self._reaches_stops()
        self._bus = _of_the_bus(model, start)

    def _fly(self, model: Any) -> stand.Record:
        return stand.fly(
            Conditions(model.opt.timestep), model, copy.copy(self._start), self.duration
        )

    def _reaches_stops(self) -> bool:
        """Tell whether a joint or tendon reached its stop: without stops the flight differs."""
        if not model_ties.has_stops(self._model):
            return False
        unstopped = copy.copy(self._model)
        unstopped.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_LIMIT
        return not np.array_equal(self._fly(unstopped).qpos[-1], self._record.qpos[-1])

    def broken_off(self) -> float | None:
        """Return the time [s] at which the state ceased to be finite, else None."""
        finite = (
            np.isfinite(self._record.qvel[-1]).all() and np.isfinite(self._record.qpos[-1]).all()
        )
        return None if finite else float(self._record.time[-1] - self._record.time[0])

    def rows(self) -> Iterator[Row]:
        """Yield the conserved quantities as measured; none of a flight that ended early."""
        if self.broken_off() is not None:
            return
        if self._bus is not None and not self._held:
            most = STRUCK if self.hits_stops else CONSERVED
            reason = "no external torque: drift is the integrator's error, or armature"
            if self.hits_stops:
                reason += ", or of the steps in which a stop is hit, where it has no order"
            if self._soft:
                reason += ", or the misalignment of a soft constraint, whose force gives a torque"
            spin, offset = self._drifts(self._record)
            yield Row.judged(Bound("angular momentum", "of the bus", most, reason), spin)
            reason = "it moves on a straight line, independently of internal motion"
            yield Row.judged(Bound("centre of mass", "m", most, reason), offset)
        if self._hides_energy():
            return
        kinetic = meter.kinetic_energy(self._record)
        energy = kinetic + meter.potential_energy(self._record)
        size = kinetic[0] if self._bus is None else self._bus.energy
        taken = model_ties.dissipators(self._model)
        if taken:
            reason = f"{' and '.join(taken)} can only dissipate energy"
            bound = Bound("energy gained", "of the bus", CONSERVED, reason)
            yield Row.judged(bound, float(np.diff(energy).max(initial=0.0) / size))
        else:
            bound = Bound("energy", "of the bus", CONSERVED, "nothing in the model dissipates")
            yield Row.judged(bound, meter.drift(energy, size))

    def unjudged(self) -> Iterator[str]:
        """Yield the conserved quantities that were not judged, with the reason."""
        if self._held:
            yield f"momentum: the world acts on the moving bodies, by {', '.join(self._held)}"
        hidden = self._hides_energy()
        if hidden:
            yield f"energy: that of {' and '.join(hidden)} is not in MuJoCo's sum"
        if self.duration < MINUTE:
            yield (
                f"conservation beyond {self.duration:g} s: a minute would be more than "
                f"{self._most} steps of {self._model.opt.timestep:g} s"
            )

    def advice(self) -> Iterator[str]:
        """Yield how to conserve momentum better, where the solver's tolerance is the cause."""
        if self._bus is None or self._held or not self._constrained() or self._tolerance == 0.0:
            return
        if self.broken_off() is not None:
            return
        lax = copy.copy(self._model)
        lax.opt.tolerance = self._tolerance
        spin, offset = self._drifts(self._fly(lax))
        exact_spin, exact_offset = self._drifts(self._record)
        if max(spin, offset) > CONSERVED and (
            exact_spin < 0.1 * spin or exact_offset < 0.1 * offset
        ):
            yield (
                f"the constraint solver's tolerance is 0 here, as in a scenario's flight: with its "
                f"own of {self._tolerance:g} its residual acts like an external force, angular "
                f"momentum drifts by {spin:.2g} instead of {exact_spin:.2g}, the centre of mass by "
                f"{offset:.2g} m instead of {exact_offset:.2g} m; elsewhere it takes an "
                '<option tolerance="0"/>'
            )

    def _drifts(self, record: stand.Record) -> tuple[float, float]:
        """Return the drift of angular momentum over the bus's, and of the centre of mass [m]."""
        assert self._bus is not None
        place = meter.centre_of_mass(record)
        since = record.time - record.time[0]
        straight = place[0] + np.outer(since, _mean_velocity(record))
        return (
            meter.drift(meter.angular_momentum(record), self._bus.momentum),
            float(np.linalg.norm(place - straight, axis=1).max()),
        )

    def _constrained(self) -> bool:
        """Tell whether the constraint solver has anything to solve in the flight."""
        return bool(self._soft or self.hits_stops or model_ties.has_friction(self._model))

    def _hides_energy(self) -> list[str]:
        """Return what stores or dissipates energy that MuJoCo does not sum."""
        hidden = [f"soft constraints ({', '.join(self._soft)})"] if self._soft else []
        hidden += ["stops that are reached"] if self.hits_stops else []
        hidden += ["springs that yield"] if model_ties.springs_yield(self._model) else []
        hidden += ["flexes"] if self._model.nflex else []
        return hidden + (["plugins"] if self._model.nplugin else [])


def _of_the_bus(model: Any, start: Any) -> Bus | None:
    """Return momentum and energy of the first free body's rotation; None for a fixed base.

    The wheels' own spin is left out, since a fast wheel would hide the errors of the bus.
    """
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if not free.size:
        return None
    matrix = np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, start)
    mujoco.mj_fullM(model, start, matrix)
    turning = slice(model.jnt_dofadr[free[0]] + 3, model.jnt_dofadr[free[0]] + 6)
    rate = start.qvel[turning]
    momentum = matrix[turning, turning] @ rate
    return Bus(float(np.linalg.norm(momentum)), float(0.5 * rate @ momentum))


def _mean_velocity(record: stand.Record) -> Array:
    mass = record.model.body_mass[record.model.body_treeid >= 0].sum()
    velocity: Array = meter.linear_momentum(record)[0] / mass
    return velocity
