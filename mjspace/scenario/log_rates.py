"""How often each topic is logged."""

from typing import Annotated

from mjspace.scenario.fields import Interval, Positive, Table
from mjspace.units import whole_number

_AT_LEAST = {"tf": 0.01, "location": 1.0}
"""s between rows for viewers: every body's frame, and the place on the Earth."""

LogPeriod = Annotated[Positive, Interval("s")]


class LogRates(Table):
    """How often a topic is logged: a period, ``"1 s"``, or a frequency, ``"100 Hz"``.

    A whole number of control periods. The first and the last control period are always logged, and
    checks and events are of every control period.
    """

    default: LogPeriod | None = None
    """Of each topic that has no key of its own; every control period when left out."""
    state: LogPeriod | None = None
    """Where a replay can start."""
    truth: LogPeriod | None = None
    measurement: LogPeriod | None = None
    estimate: LogPeriod | None = None
    reference: LogPeriod | None = None
    command: LogPeriod | None = None
    law: LogPeriod | None = None
    disturbance: LogPeriod | None = None
    tf: LogPeriod | None = None
    """Frames of the bodies, for viewers; when left out as ``default``, but at most 100 Hz."""
    location: LogPeriod | None = None
    """Where above the Earth the vehicle is, for viewers; when left out as ``default``, but at most
    1 Hz. Logged where an orbit around the Earth and its epoch are known."""

    def every(self, control: float) -> dict[str, int]:
        """Return how many control periods of ``control`` [s] there are to a row, by topic.

        Raises:
            ValueError: not a whole number of them, with the key and the nearest right periods.
        """
        found = {}
        for key in type(self).model_fields:
            period = getattr(self, key)
            if period is not None:
                found[key] = whole_number(period, control, f"log.{key}", "rates.control")
        default = found.pop("default", 1)
        topics = [key for key in type(self).model_fields if key != "default"]
        least = {key: round(_AT_LEAST.get(key, 0.0) / control) for key in topics}
        return {f"/{key}": found.get(key, max(default, least[key])) for key in topics}
