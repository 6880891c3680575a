"""A scenario's sensors, by name: their kinds, and which quantity each measures."""

from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ValidationInfo

from mjspace.contract import REPORTED_BY_PLANT
from mjspace.errors import nearest
from mjspace.scenario.declared import DeclaredIn
from mjspace.scenario.environment import Environment
from mjspace.scenario.fields import SensorName

KINDS = {
    "attitude": "mjspace.sensors.star_tracker:StarTracker",
    "rate": "mjspace.sensors.gyro:Gyro",
    "wheel_speed": "mjspace.sensors.tachometer:Tachometer",
    "position": "mjspace.sensors.position:PositionFix",
    "velocity": "mjspace.sensors.velocity:VelocityFix",
    "altitude": "mjspace.sensors.altimeter:Altimeter",
    "ground_velocity": "mjspace.sensors.velocimeter:Velocimeter",
    "specific_force": "mjspace.sensors.accelerometer:Accelerometer",
    "magnetic_field": "mjspace.sensors.magnetometer:Magnetometer",
    "field_reference": "mjspace.sensors.field_reference:FieldReference",
    "sun_reference": "mjspace.sensors.sun_reference:SunReference",
    "nadir": "mjspace.sensors.horizon:HorizonSensor",
    "sun_direction": "mjspace.sensors.sun_sensor:SunSensor",
    "sun_cosines": "mjspace.sensors.sun_sensor:CoarseSunSensor",
    "gnss_position": "mjspace.sensors.gnss:GnssPosition",
    "gnss_velocity": "mjspace.sensors.gnss:GnssVelocity",
    "model": "mjspace.sensors.model_sensor:OfModel",
}
"""The sensor of each quantity, "module:Class": the class is imported when a scenario is read. Those
of "model" are the sensors that the vehicle's own model has."""
ALWAYS = ("attitude", "rate", "wheel_speed")
"""Quantities that an ideal sensor measures where the scenario declares none."""

_VALID = "_valid"
"""After a sensor's name: whether its sample is."""


def kind_of(quantity: str) -> Any:
    """Return the class of the sensors that measure the ``quantity``.

    Raises:
        ValueError: none does, with the near names.
    """
    if quantity not in KINDS:
        raise ValueError(f"no sensor measures {quantity!r}{nearest(str(quantity), KINDS)}")
    return DeclaredIn(KINDS[quantity]).table


def kinds() -> list[type[BaseModel]]:
    """Return the class of each kind of sensor."""
    return [kind_of(quantity) for quantity in KINDS]


def _with_quantities(tables: Any) -> Any:
    """Return the tables, each with its quantity, after those of the ideal sensors."""
    if not isinstance(tables, dict):
        return tables
    named = {
        name: {"measures": name, **table} if isinstance(table, dict) else table
        for name, table in tables.items()
    }
    measured = [
        table["measures"] if isinstance(table, dict) else getattr(table, "measures", None)
        for table in named.values()
    ]
    ideal = {name: {"measures": name} for name in ALWAYS if name not in measured}
    return {**ideal, **named}


def _of_its_kind(table: Any, info: ValidationInfo) -> Any:
    """Return the sensor that a table describes."""
    if isinstance(table, BaseModel):
        return table
    if not isinstance(table, dict):
        raise ValueError(f"got {table!r}, should be a table")
    return kind_of(table["measures"]).model_validate(table, context=info.context)


Sensors = Annotated[
    dict[SensorName, Annotated[Any, BeforeValidator(_of_its_kind)]],
    BeforeValidator(_with_quantities),
]
"""The sensors by their names, in the order in which the scenario declares them."""


def check_sensors(sensors: dict[str, Any], environment: Environment) -> None:
    """Refuse a sensor whose name is taken, or that has nothing to measure.

    Raises:
        ValueError: with the sensor's key.
    """
    for name, sensor in sensors.items():
        if name != sensor.measures and name in (*KINDS, *REPORTED_BY_PLANT):
            raise ValueError(
                f"sensors.{name}: {name} is a quantity, which this sensor does not measure: call "
                "it otherwise"
            )
        if name.endswith(_VALID):
            raise ValueError(
                f"sensors.{name}: a law reads by such a name whether a sample is valid: call it "
                "otherwise"
            )
        try:
            sensor.check_environment(environment)
        except ValueError as error:
            raise ValueError(f"sensors.{name}: {error}") from None
