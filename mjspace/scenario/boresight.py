"""Boresights: where instruments look, and what the log has of each."""

from mjspace.scenario.fields import Table, Unit3

ANGLES = {
    "nadir_angle": "nadir",
    "limb_angle": "the planet's limb",
    "sun_angle": "the Sun",
    "moon_angle": "the Moon",
}
"""What /truth has of each boresight [rad], after its name and an underscore, and from what."""


class Boresight(Table):
    """Where an instrument fixed to the bus looks.

    In an orbit the log has its angles for checks and events: ``truth.NAME_nadir_angle`` from the
    planet's centre, ``truth.NAME_limb_angle`` from the edge of its disc, less than 0 where it looks
    at the planet, and, around the Earth from an epoch on, ``truth.NAME_sun_angle`` and
    ``truth.NAME_moon_angle`` [rad].
    """

    axis: Unit3
    """Body axes; normalized."""
