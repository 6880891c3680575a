"""The compiled model that flew in a log."""

import warnings
from typing import Any

from mjspace.environment.install import userdata_size
from mjspace.log.flown_scenario import model_of
from mjspace.log.reader import Log
from mjspace.scenario.scenario import Scenario
from mjspace.vehicle.logged_model import logged_model
from mjspace.vehicle.vehicle import build


def flown_model(log: Log, scenario: Scenario) -> Any:
    """Return the ``mujoco.MjModel`` that flew in the log, under its ``scenario``.

    Raises:
        InputError: the log does not hold it, or it is damaged.
    """
    size = userdata_size(scenario.environment, scenario.plant)
    with warnings.catch_warnings(action="ignore"):  # it was said when it flew
        source = model_of(log, scenario)
        here = build(scenario.plant, scenario.rates, userdata=size, source=source).model
    packed = log.attachment("model.mjb.gz")
    return logged_model(here, packed, log.metadata, log.shape("/state", "physics"))
