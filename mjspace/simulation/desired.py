"""The desired motion of what is flown control period by control period."""

from functools import lru_cache

import numpy as np

from mjspace.contract import DesiredMotion
from mjspace.simulation.assembly import Assembly
from mjspace.simulation.initial_state import last_period
from mjspace.simulation.loop import BLOCK_PERIODS
from mjspace.simulation.user_code import reference_at


class Desired:
    """The scenario's reference, evaluated for a block of control periods at once."""

    def __init__(self, assembly: Assembly) -> None:
        control, last = assembly.scenario.rates.control, last_period(assembly.scenario)

        @lru_cache(maxsize=1)
        def block(number: int) -> DesiredMotion:
            first = number * BLOCK_PERIODS
            end = min(first + BLOCK_PERIODS, last + 1)
            times = np.arange(first, end, dtype=np.float64) * control
            return reference_at(assembly.reference, times)

        self._block = block

    def at(self, period: int) -> DesiredMotion:
        """Return the desired motion at the control instant of that number, without vehicle axis.

        Raises:
            FlightError: the reference raised, or returned what is none.
        """
        number, row = divmod(period, BLOCK_PERIODS)
        block = self._block(number)
        return type(block)(*(values[row] for values in block))
