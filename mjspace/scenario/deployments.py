"""The table of a part that is deployed in flight: a boom that is driven out, a yo-yo let loose."""

from typing import Annotated

from mjspace.scenario.fields import Positive, Si, Table, Time


class Deployment(Table):
    """When a boom or a yo-yo goes out, and how."""

    at: Time
    """When it begins; until then it is held."""
    length: Annotated[Positive, Si("m")] | None = None
    """Of a boom: where its tip goes, from the part's origin."""
    rate: Annotated[Positive, Si("m/s")] | None = None
    """Of a boom: how fast."""
    ramp: Time = 0.0
    """Of a boom: for how long the rate grows evenly, and falls again at the end."""
    bandwidth: Annotated[Positive, Si("rad/s")] = 1.0
    """Of the boom's position loop, critically damped: well above the spin, or the pull on the tip
    wins; well below one over the integration step."""
    unwound: Annotated[Positive, Si("rad")] = 0.1
    """Of a yo-yo: cord off the drum while it is held. With none, turning and sliding would be one
    motion."""
