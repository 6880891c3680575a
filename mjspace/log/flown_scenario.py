"""The scenario that a log says was flown."""

from mjspace.errors import input_error_at
from mjspace.log.reader import Log
from mjspace.scenario import raw
from mjspace.scenario.loading import validate
from mjspace.scenario.model_source import ModelSource, source_of
from mjspace.scenario.scenario import Scenario


def scenario_of(log: Log) -> Scenario:
    """Return the scenario as flown, with every default and gain written out.

    Raises:
        InputError: the log does not hold it, or it is not valid for this version of mjspace.
    """
    text = log.attachment("scenario.toml")
    with input_error_at(f"{log.path}: the attachment 'scenario.toml'"):
        table = raw.parsed(text.decode())
    table.pop("verdict", None)  # of logs from before checks said how they are expected to come out
    return validate(table, f"the scenario in {log.path}", context={"flown": True})


def model_of(log: Log, scenario: Scenario) -> ModelSource | None:
    """Return the user's own model that flew in a log under its ``scenario``; None for another.

    Raises:
        ValueError: the log lacks one of its files, or the attachment is damaged.
    """
    if not scenario.plant.is_own:
        return None
    folder, _, _ = scenario.plant.model.rpartition("/")

    def read(path: str) -> bytes | None:
        name = f"{folder}/{path}"
        return log.attachment(name) if name in log.attachments else None

    return source_of(scenario.plant.model, read)
