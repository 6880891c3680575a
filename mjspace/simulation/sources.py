"""The user's own code in a log: the files that define it, and the names that it has there."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mjspace.errors import input_error_at
from mjspace.scenario.metrics import Metric
from mjspace.scenario.trust import Trust
from mjspace.scenario.user_files import files_of, source_of


def in_log(role: str, kind: str, found: Any, sources: dict[str, bytes]) -> str:
    """Add the files that define what was ``found``; return its ``kind`` as the log knows it.

    A file of one's own is in the log as <role>.py or, with what it needs of its folder, in <role>/.
    """
    text, beside = source_of(found).encode(), files_of(found)
    sources[f"{role}.py"] = text
    place, _, name = kind.partition(":")
    if not place.endswith(".py"):
        return kind
    if not beside:
        return f"{role}.py:{name}"
    file = Path(place).name
    sources |= {f"{role}/{other}": content for other, content in {file: text, **beside}.items()}
    return f"{role}/{file}:{name}"


def metric_functions(
    metrics: list[Metric], trust: Trust, sources: dict[str, bytes]
) -> tuple[dict[str, Callable[..., Any]], list[Metric]]:
    """Return the functions of the metrics by their names, and the metrics as flown.

    Their files are added to ``sources``, each once.

    Raises:
        InputError: one cannot be loaded, or is no function of ``(time, signals)``.
    """
    functions: dict[str, Callable[..., Any]] = {}
    flown, roles = [], dict[str, str]()
    for number, metric in enumerate(metrics):
        if metric.function is None:
            flown.append(metric)
            continue
        with input_error_at(f"metrics.{number}.function"):
            found = trust.load(metric.function)
            _refuse_other_than_function(metric.function, found)
            place = metric.function.partition(":")[0]
            role = roles.setdefault(place, f"metrics{len(roles) or ''}")
            name = in_log(role, metric.function, found, sources)
        functions[metric.name] = found
        flown.append(metric.model_copy(update={"function": name}))
    return functions, flown


def _refuse_other_than_function(kind: str, found: Any) -> None:
    if not inspect.isfunction(found):
        raise ValueError(f"{kind} is a {type(found).__name__}, should be a function")
    try:
        inspect.signature(found).bind(None, None)
    except TypeError:
        given = f"{kind}{inspect.signature(found)}"
        raise ValueError(f"{given}: should take (time, signals)") from None
