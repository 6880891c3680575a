"""Magnetorquers: coils whose magnetic moment the field of the Earth turns, and with it the bus."""

from dataclasses import dataclass, field
from math import exp, inf
from typing import Annotated, Any, ClassVar

import numpy as np
from pydantic import Field, model_validator

from mjspace.actuators.base import (
    DIPOLE,
    Actuator,
    ActuatorTable,
    Context,
    Fields,
    Input,
    State,
    together,
)
from mjspace.contract import Array, Measurement
from mjspace.gufunc import gufunc
from mjspace.scenario.fields import (
    Each,
    Si,
    Table,
    Time,
    Unit3,
    of_each,
    refuse_other_count,
)


class Magnetorquers(ActuatorTable, Table):
    """Coils whose magnetic moment the Earth's field turns: one for each axis."""

    axes: Annotated[list[Unit3], Field(min_length=1)] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
    """Axes of the coils in body axes, one row for each; normalized."""
    dipole_limit: Annotated[Each, Si("A m^2")] | None = None
    """Largest magnetic moment of all or of each; none when left out."""
    time_constant: Time = 0.0
    """With which the moment follows its command."""

    @model_validator(mode="after")
    def _one_for_each(self) -> "Magnetorquers":
        refuse_other_count("dipole_limit", self.dipole_limit, len(self.axes), "axes")
        return self

    def actuator(self, context: Context) -> "CoilSet":
        """Return the coils."""
        axes = np.array(self.axes) / np.linalg.norm(self.axes, axis=1, keepdims=True)
        return CoilSet(axes, self.dipole_limit or inf, self.time_constant)


@dataclass(frozen=True)
class CoilSet(Actuator):
    """Coils with a pseudo-inverse allocation.

    They apply the moment; its torque, moment x field, is the environment's, and changes
    with the attitude in every stage of the integrator.
    """

    axes: Array
    """Unit axes in body axes, shape (n, 3)."""
    dipole_limit: Array | list[float] | float = inf
    """Largest moment of all or of each [A m^2], shape (n,)."""
    time_constant: float = 0.0
    """With which each follows its command [s]."""
    logged_as: ClassVar[str] = "magnetic_moment"
    unit: ClassVar[str] = "A m^2"
    takes: ClassVar[Fields] = {"dipole": (3, "A m^2")}
    drives: ClassVar[Input] = DIPOLE
    allocation: Array = field(init=False, repr=False)
    """Moments of the coils for each unit of the whole, shape (n, 3)."""
    _limits: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "allocation", np.linalg.pinv(self.axes.T))
        object.__setattr__(self, "_limits", of_each(self.dipole_limit, len(self.axes)))

    @property
    def stateful(self) -> bool:
        """Whether the moments lag."""
        return self.time_constant > 0.0

    def reset(self, vehicles: int) -> State:
        """Return the coils without current: "coil_moment" (N, n) [A m^2], where they lag."""
        return {"coil_moment": np.zeros((vehicles, len(self.axes)))} if self.stateful else {}

    def limits(self) -> dict[str, tuple[Array, Array]]:
        """Return the moment that the coils together have about each axis."""
        largest = together(self.axes, self._limits)
        return {"dipole": (-largest, largest)}

    def act(
        self, state: State, command: Any, truth: Measurement, step: float
    ) -> tuple[State, Array, Array]:
        """Return (state, moment on the whole, nothing) for ``step`` [s]; moment (N, 3), body axes.

        Of all that make the command's ``dipole``, the moments are those of least norm, each then
        limited and, where it lags, the mean over the step. Saturation is not reported as an event:
        it is how the B-dot law works.
        """
        before = state.get("coil_moment", np.zeros((len(truth.rate), len(self.axes))))
        kept = exp(-step / self.time_constant) if self.stateful else 0.0
        mean = (1.0 - kept) * self.time_constant / step
        after, moment = _moments.ufunc(
            command.dipole, before, self.allocation, self.axes, self._limits, [kept, mean]
        )
        return {"coil_moment": after} if self.stateful else {}, moment, np.zeros((len(moment), 0))


# Products are written out: BLAS may round one vehicle's differently in a batch than alone.
@gufunc(
    ["void(f8[:], f8[:], f8[:, :], f8[:, :], f8[:], f8[:], f8[:], f8[:])"],
    "(k),(n),(n,k),(n,k),(n),(m)->(n),(k)",
)
def _moments(
    commanded: Any,
    before: Any,
    allocation: Any,
    axes: Any,
    limit: Any,
    how: Any,
    after: Any,
    moment: Any,
) -> None:
    kept, mean = how[0], how[1]
    for k in range(commanded.size):
        moment[k] = 0.0
    for i in range(before.size):
        target = 0.0
        for k in range(commanded.size):
            target += allocation[i, k] * commanded[k]
        target = min(max(target, -limit[i]), limit[i])
        after[i] = target + (before[i] - target) * kept
        applied = target + (before[i] - target) * mean
        for k in range(commanded.size):
            moment[k] += axes[i, k] * applied
