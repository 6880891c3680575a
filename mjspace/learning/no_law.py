"""A scenario that is flown without its law: what cannot be in it."""

from mjspace.errors import InputError
from mjspace.scenario.scenario import Scenario


def refuse_what_needs_a_law(scenario: Scenario) -> None:
    """Refuse a fault that begins with a signal of the law, and a dispersion of its gains.

    Raises:
        InputError: with the key.
    """
    for number, fault in enumerate(scenario.faults):
        signal = "" if fault.when is None else fault.when.signal
        if signal.removeprefix("/").startswith(("law.", "estimate.")):
            raise InputError(
                f"faults.{number}.when.signal: {signal}: an environment flies no law: give a "
                "signal of truth, measurement or command"
            )
    for number, dispersion in enumerate(scenario.dispersions):
        if {path[0] for path in dispersion.paths} & {"law", "estimator"}:
            raise InputError(
                f"dispersions.{number}.key: {dispersion.name}: an environment flies no law: leave "
                "it out"
            )
