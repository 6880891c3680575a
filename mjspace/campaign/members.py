"""A campaign's members: the scenario with what each has drawn, and proof that it arrived."""

import copy
import hashlib
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import ValidationError

from mjspace.campaign import draws
from mjspace.errors import FlightError, InputError, input_error_at, nearest
from mjspace.scenario.construct import plain
from mjspace.scenario.dispersions import Dispersion, path_of, refuse_mode_outside
from mjspace.scenario.loading import read, to_toml, validated
from mjspace.scenario.plant import Initial
from mjspace.scenario.scenario import Scenario
from mjspace.scenario.trust import files_noted
from mjspace.simulation.assembly import Assembly, assemble, starting_at

STATE = {
    "initial.position": ("qpos", slice(0, 3)),
    "initial.attitude": ("qpos", slice(3, 7)),
    "initial.velocity": ("qvel", slice(0, 3)),
    "initial.rate": ("qvel", slice(3, 6)),
}
"""Where the bus's initial state stands in an assembly."""


@dataclass(frozen=True)
class Campaign:
    """What is flown: a scenario, ``count`` members of it, and the ``seed`` of all of them."""

    scenario: str
    """Its name or path."""
    overrides: tuple[str, ...]
    """As ``--set`` takes them."""
    count: int
    seed: int | None = None
    """The scenario's own when left out."""
    trust: bool = False

    @property
    def all_overrides(self) -> tuple[str, ...]:
        """The overrides with the seed's."""
        return self.overrides if self.seed is None else (*self.overrides, f"seed={self.seed}")


@dataclass(frozen=True)
class Population:
    """The members of a campaign, of which none is built before it is needed."""

    campaign: Campaign
    table: Mapping[str, Any]
    """The scenario as it is written, with the overrides."""
    path: Path
    """Of its file."""
    folder: Path
    """Where the files that it names are: its own, but on another machine."""
    origins: Mapping[str, str]
    """The option that set each overridden key."""
    nominal: Assembly
    files: Mapping[str, Path]
    """The user's files that were read, by the names that the scenario gives them."""
    nominal_is_of_table: bool = True
    """Whether nothing but draws has changed since the nominal one was assembled."""

    @property
    def scenario(self) -> Scenario:
        """The scenario without draws, as flown."""
        return self.nominal.scenario

    @property
    def dispersions(self) -> list[Dispersion]:
        """What differs from member to member."""
        return self.scenario.dispersions

    @cached_property
    def own_values(self) -> list[Any]:
        """The scenario's own value of each dispersion; of a set a list."""
        found = []
        for each in self.dispersions:
            own = [value_at(self.written, path) for path in each.paths]
            found.append(own[0] if each.keys is None else own)
        return found

    @cached_property
    def written(self) -> Any:
        """The scenario with every default written out."""
        return plain(self.scenario.model_dump(mode="python"))

    @cached_property
    def identity(self) -> dict[str, Any]:
        """What makes two campaigns the same, but for the number of members."""
        sources = {n: hashlib.sha256(c).hexdigest() for n, c in self.nominal.sources.items()}
        return {"scenario": to_toml(self.scenario), "sources": sources}

    def with_values(self, values: Mapping[tuple[str, ...], Any]) -> "Population":
        """Return the members with other values at these paths of the scenario, in SI."""
        table = copy.deepcopy(dict(self.table))
        for path, value in values.items():
            put(table, self.written, path, value)
        return replace(self, table=table, nominal_is_of_table=False)

    def drawn(self, members: Sequence[int]) -> list[list[Any]]:
        """Return the value of each dispersion of each of the members."""
        found = self.scenario
        rows = draws.uniforms(
            found.sampling, found.seed, members, self.campaign.count, self.dispersions
        )
        return [draws.values(self.dispersions, self.own_values, row) for row in rows]

    def member(self, number: int) -> tuple[Assembly, list[Any]]:
        """Return the member's assembly, and its draws.

        Raises:
            InputError: the scenario does not admit what was drawn.
            FlightError: a draw did not arrive in what is to fly.
        """
        (drawn,) = self.drawn([number])
        return self.built(drawn, f"member {number} of the campaign"), drawn

    def built(self, drawn: Sequence[Any], name: str) -> Assembly:
        """Return the assembly with these draws; errors call it by ``name``.

        Raises:
            InputError: the scenario does not admit what was drawn.
            FlightError: a draw did not arrive in what is to fly.
        """
        table = copy.deepcopy(dict(self.table))
        table.pop("dispersions", None)
        for dispersion, value in zip(self.dispersions, drawn, strict=True):
            for key, part in dispersion.by_key(value).items():
                put(table, self.written, path_of(key), _with_unit(dispersion, part))
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # the scenario's own have been shown
                assembly = self._elsewhere(table) or self._assembled(table)
        except InputError as error:
            raise InputError(f"{name}: {error}") from error
        flown = assembly.scenario
        written = plain(flown.model_dump(mode="python", include=self._dispersed))
        for dispersion, value in zip(self.dispersions, drawn, strict=True):
            for key, part in dispersion.by_key(value).items():
                require_arrival(assembly, written, dispersion, key, part, name)
        return assembly

    @cached_property
    def _dispersed(self) -> set[str]:
        """The tables of the scenario in which members differ."""
        return {path[0] for each in self.dispersions for path in each.paths}

    @cached_property
    def _undispersed(self) -> Scenario:
        """The scenario without draws and without dispersions, as flown."""
        return self.scenario.model_copy(update={"dispersions": []})

    def _elsewhere(self, table: Mapping[str, Any]) -> Assembly | None:
        """Return the nominal assembly with another start, in a tenth of the time of a new one.

        None where the members differ in more than their start, or this one cannot start so.
        """
        if not self.nominal_is_of_table or self._dispersed != {"initial"}:
            return None
        try:
            initial = Initial.model_validate(table["initial"])
        except ValidationError:
            return None
        still = replace(self.nominal, scenario=self._undispersed)
        return starting_at(still, initial)

    def _assembled(self, table: dict[str, Any]) -> Assembly:
        scenario = validated(table, str(self.path), self.origins)
        return assemble(
            scenario,
            self.folder,
            trust=self.campaign.trust,
            vehicle=self._same_vehicle(scenario),
        )

    def _same_vehicle(self, scenario: Scenario) -> Any:
        """Return the nominal vehicle; None if that of the ``scenario`` is another."""
        parts = ("plant", "environment", "rates")
        same = all(getattr(scenario, part) == getattr(self.scenario, part) for part in parts)
        return self.nominal.vehicle if same else None


def population(campaign: Campaign, *, alike: bool = False) -> Population:
    """Return the members of the campaign; its files are read.

    Raises:
        InputError: bad input, in one line; unless they may be ``alike``, that they would be.
    """
    table, path, origins = read(campaign.scenario, campaign.all_overrides)
    found = populated(campaign, table, path, path.parent, origins)
    differ = found.dispersions or found.scenario.faults or found.nominal.sensors([0]).ticks
    if not (differ or alike):
        raise InputError(f"{path}: dispersions: none, and no noise: every member would be alike")
    return found


def populated(
    campaign: Campaign,
    table: Mapping[str, Any],
    path: Path,
    folder: Path,
    origins: Mapping[str, str],
) -> Population:
    """Return the members of a scenario's ``table``, with the files in the ``folder``.

    Raises:
        InputError: bad input, in one line.
    """
    scenario = validated(dict(table), str(path), origins)
    with files_noted() as files:
        nominal = assemble(scenario, folder, trust=campaign.trust)
    found = Population(campaign, table, path, folder, origins, nominal, files)
    for number, dispersion in enumerate(scenario.dispersions):
        with input_error_at(f"{path}: dispersions.{number}.{'keys' if dispersion.keys else 'key'}"):
            for key in dispersion.all_keys:
                _refuse_unfit(dispersion, key, value_at(found.written, path_of(key)))
    return found


def value_at(table: Any, path: Sequence[str]) -> Any:
    """Return what stands at the path in a scenario with every default written out.

    Raises:
        ValueError: nothing does, with the names that are near.
    """
    place = table
    for number, part in enumerate(path):
        if isinstance(place, list) and part.isdigit() and int(part) < len(place):
            place = place[int(part)]
        elif isinstance(place, Mapping) and part in place:
            place = place[part]
        else:
            where = ".".join(path[:number]) or "the scenario"
            have = place if isinstance(place, Mapping) else map(str, range(_length(place)))
            raise ValueError(f"{'.'.join(path)}: no {part!r} in {where}{nearest(part, have)}")
    return place


def put(table: Any, written: Any, path: Sequence[str], value: Any) -> None:
    """Set the value at the path of a scenario's ``table``.

    A list that the table leaves out, or gives as one number for all, is taken from the scenario
    with every default ``written`` out.
    """
    *parents, last = path
    place, known = table, written
    for part in parents:
        at = int(part) if isinstance(place, list) else part
        known = known[at]
        if isinstance(known, list) and not isinstance(_at(place, at), list):
            place[at] = copy.deepcopy(known)
        elif isinstance(place, dict):
            place.setdefault(part, {})
        place = place[at]
    place[int(last) if isinstance(place, list) else last] = value


def require_arrival(
    assembly: Assembly, written: Any, dispersion: Dispersion, key: str, drawn: Any, name: str
) -> None:
    """Read the value of a ``key`` back from what is to fly, and refuse another than was drawn.

    ``written`` is the assembly's scenario with every default written out.

    Raises:
        FlightError: with the key and both values.
    """
    flown = value_at(written, path_of(key))
    period = _unit(dispersion) == "Hz" and flown == 1.0 / drawn
    arrived = flown == drawn or period
    place, _, index = key.partition("[")
    if arrived and place in STATE:
        where, part = STATE[place]
        flown = getattr(assembly, where)[part]
        flown = float(flown[int(index[:-1])]) if index else flown.tolist()
        # A quaternion is normalized.
        arrived = bool(np.allclose(flown, drawn, rtol=1e-3 * ("attitude" in place), atol=0.0))
    if not arrived:
        raise FlightError(
            f"dispersion {key} did not arrive: {name} drew {drawn}, and would fly with {flown}"
        )


def _refuse_unfit(dispersion: Dispersion, key: str, own: Any) -> None:
    """Refuse a distribution that the scenario's own value of the key does not go with."""
    if dispersion.distribution in draws.WIDTH:
        size = 4 if dispersion.distribution == "random_attitude" else 3
        if not (own is None or (isinstance(own, list) and len(own) == size)):
            raise ValueError(f"{key} is {own!r}, should be {size} numbers")
        return
    if own is not None and (isinstance(own, bool) or not isinstance(own, int | float)):
        raise ValueError(f"{key} is {own!r}, should be a number: give an index, [0]")
    if dispersion.keys is not None and own is None:
        raise ValueError(f"{key} has no value of its own, about which it could be drawn")
    takes = {"normal": "mean", "triangular": "mode"}.get(dispersion.distribution)
    if dispersion.keys is None and takes and own is None and getattr(dispersion, takes) is None:
        raise ValueError(f"{key} has no value of its own: give {takes}")
    refuse_mode_outside(dispersion, own if dispersion.mode is None else dispersion.mode)


def _with_unit(dispersion: Dispersion, drawn: Any) -> Any:
    """Return a draw as the scenario reads it: with the unit, which it judges, if it has one."""
    unit = _unit(dispersion)
    if not unit:
        return drawn
    each = drawn if isinstance(drawn, list) else [drawn]
    texts = [f"{float(number)!r} {unit}" for number in each]
    return texts if isinstance(drawn, list) else texts[0]


def _unit(dispersion: Dispersion) -> str:
    return next((each.unit for each in dispersion.quantities), "")


def _at(place: Any, at: Any) -> Any:
    return place.get(at) if isinstance(place, dict) else place[at]


def _length(place: Any) -> int:
    return len(place) if isinstance(place, list) else 0
