"""SearchSpace: the parameters that a tuning may change, with their bounds; from the package or from a YAML file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path
from typing import Any, Self

from pydantic import Field, model_validator

from controllers.nav2_params.plugins import PRIMARIES, SHIMS
from controllers.nav2_params.values import Value, unused_critics, values_of
from evolution.driving import DriveSettings
from gym_mapbench.errors import ArgumentError, ConfigError, unknown_name
from gym_mapbench.files.bundled import read_bundled
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.settings import Settings

FILE = "search_space.yaml"
DIGITS = 3
"""Significant digits of a sampled number, so that a parameter file stays readable."""


class ParameterRange(Settings):
    """The values that one parameter may take: an interval, a list of choices, or the value of another parameter.

    Args:
        low: Lower bound of a number.
        high: Upper bound of a number.
        log: Whether the logarithm is sampled uniformly.
        integer: Whether the number is whole.
        choices: Values to choose from, instead of bounds.
        same_as: Name of the tuned parameter whose value this parameter takes, instead of bounds.
    """

    low: float | None = None
    high: float | None = None
    log: bool = False
    integer: bool = False
    choices: tuple[bool | int | float | str, ...] = ()
    same_as: str | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        bounds = (self.low is not None) + (self.high is not None)
        if (bounds == 2) + bool(self.choices) + (self.same_as is not None) != 1 or bounds == 1:
            raise ConfigError("expected low and high, choices, or same_as")
        if self.low is not None and self.high is not None:
            self._check_bounds(self.low, self.high)
        return self

    def _check_bounds(self, low: float, high: float) -> None:
        if not low < high:
            raise ConfigError(f"expected low below high, got low {low:g} and high {high:g}")
        if self.log and low <= 0:
            raise ConfigError(f"expected low above 0 with log, got {low:g}")
        if self.integer and not (low.is_integer() and high.is_integer()):
            raise ConfigError(f"expected whole numbers as bounds of an integer, got {low:g} and {high:g}")

    def examples(self) -> list[Value]:
        """Return values to try: all choices, or two numbers inside of the bounds."""
        if self.low is None or self.high is None:
            return list(self.choices)
        inside = [self.low + share * (self.high - self.low) for share in (0.382, 0.618)]
        return [self.rounded(round(one) if self.integer else one) for one in inside]

    def nearest(self, value: Value) -> Value:
        """Return the allowed value that is nearest to a value; the first choice if the value is none of them."""
        if self.choices:
            return value if value in self.choices else self.choices[0]
        assert self.low is not None
        assert self.high is not None
        number = min(max(float(value), self.low), self.high)
        return round(number) if self.integer else number

    def rounded(self, value: Value) -> Value:
        """Return a sampled value as it is written into a parameter file; it stays within the bounds."""
        if self.choices or self.integer or isinstance(value, str | bool) or not value:
            return value
        return self.nearest(round(value, DIGITS - 1 - math.floor(math.log10(abs(value)))))


class SearchSpace(Settings):
    """The tuned parameters.

    Args:
        extends: Whether the parameters of the shipped search space are tuned as well.
        parameters: By name, the values that a parameter may take. A name is that of a parameter of the controller, as
            ``PathAlign.scale``, or of a costmap, as ``local_costmap.inflation_layer.inflation_radius``.
    """

    extends: bool = False
    parameters: dict[str, ParameterRange] = Field(default_factory=dict)

    @property
    def sampled(self) -> dict[str, ParameterRange]:
        """The parameters that have a value of their own."""
        return {name: one for name, one in self.parameters.items() if one.same_as is None}

    def completed(self, sampled: Mapping[str, Value]) -> dict[str, Value]:
        """Return the values of all tuned parameters, rounded, from those that have a value of their own."""
        rounded = {name: self.parameters[name].rounded(value) for name, value in sampled.items()}
        return {name: rounded[one.same_as or name] for name, one in self.parameters.items()}

    def without(self, names: frozenset[str]) -> Self:
        """Return the space without some parameters, and without those that take the value of one of them."""
        kept = {k: one for k, one in self.parameters.items() if k not in names and one.same_as not in names}
        return self.replace(parameters=kept)


def space_names() -> tuple[str, ...]:
    """Return the kinds of controllers for which the package has a search space."""
    return tuple(name for name in PRIMARIES if (files("controllers") / name / FILE).is_file())


def shipped_space(kind: str) -> SearchSpace:
    """Return the search space that the package has for a kind of controller.

    Raises:
        ConfigError: If there is none.
    """
    primary = SHIMS.get(kind, kind)
    if primary not in space_names():
        expected = f"expected the file of a search space, as there is none for the controller {kind!r}"
        raise ArgumentError("space", expected)
    return SearchSpace.from_mapping(read_bundled("controllers", primary, FILE), FILE)


def shipped_document(kind: str) -> dict[str, Any]:
    """Return a shipped search space as the content of a file; errors as for :func:`shipped_space`."""
    return shipped_space(kind).model_dump(mode="json", exclude_defaults=True)


def read_space(path: str | Path) -> SearchSpace:
    """Read the file of a search space.

    Raises:
        ConfigError: If it cannot be read, names no parameter, or has bounds the wrong way round.
    """
    space = SearchSpace.from_mapping(read_yaml(path), str(path))
    if not space.parameters:
        raise ConfigError(f"{path}: parameters: expected at least one parameter, got none")
    return space


def space_for(settings: DriveSettings, controller: str, path: str | Path | None = None) -> SearchSpace:
    """Return the search space of a tuning.

    Parameters of the shipped space that the release or the parameter file does not use are left out.

    Args:
        settings: World and navigation.
        controller: The controller, by its name or kind.
        path: A file; None for the shipped space.

    Raises:
        ConfigError: If a name of the file is no parameter that is in use.
    """
    navigation = settings.navigation
    kind = navigation.controller(controller).kind
    own = None if path is None else read_space(path)
    known = values_of(navigation, controller)
    off = unused_critics(navigation, controller)
    usable = {name: value for name, value in known.items() if name.partition(".")[0] not in off}
    if own is not None:
        _check_names(own, known, usable, str(path))
        if not own.extends:
            return own
    shipped = shipped_space(kind)
    shipped = shipped.without(frozenset(shipped.parameters) - frozenset(usable))
    more = {} if own is None else own.parameters
    return SearchSpace(parameters={**shipped.parameters, **more})


def _check_names(space: SearchSpace, known: Mapping[str, Any], usable: Mapping[str, Any], path: str) -> None:
    """Refuse names that are no parameter, or a parameter without effect."""
    for name, one in space.parameters.items():
        if name not in known:
            raise ConfigError(f"{path}: {unknown_name('parameter', name, usable)}")
        if name not in usable:
            critic = name.partition(".")[0]
            raise ConfigError(f"{path}: {name}: expected a critic that the controller lists, got {critic}")
        if one.same_as is not None and (one.same_as not in space.parameters or space.parameters[one.same_as].same_as):
            raise ConfigError(f"{path}: {name}: same_as: expected a parameter of the space, got {one.same_as!r}")
