"""What the parameters of all controllers share: dotted and nested keys, defaults by release, and lists of critics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import field_validator, model_validator

from controllers.releases import RELEASES, Release
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.settings import Settings


def nest_dotted(params: Mapping[str, Any]) -> dict[str, Any]:
    """Expand dotted keys: ``{"PathAlign.scale": 32.0}`` becomes ``{"PathAlign": {"scale": 32.0}}``.

    Raises:
        ConfigError: If a key is given twice, or both as a value and as a group.
    """
    nested: dict[str, Any] = {}
    for key, value in params.items():
        _insert(nested, str(key).split("."), value, str(key))
    return nested


def _insert(target: dict[str, Any], names: list[str], value: Any, key: str) -> None:
    """Put ``value`` under the nested ``names``; a mapping is merged into the group of that name."""
    for name in names[:-1]:
        target = target.setdefault(name, {})
        if not isinstance(target, dict):
            raise ConfigError(f"{key}: expected {name!r} to be a group of parameters, got {target!r}")
    last = names[-1]
    if isinstance(value, Mapping):
        group = target.setdefault(last, {})
        if not isinstance(group, dict):
            raise ConfigError(f"{key}: expected one value, got both {group!r} and a group of parameters")
        for inner, inner_value in value.items():
            _insert(group, str(inner).split("."), inner_value, f"{key}.{inner}")
    elif last in target:
        raise ConfigError(f"{key}: expected one value, got {target[last]!r} and {value!r}")
    else:
        target[last] = value


def overlay(below: Mapping[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    """Lay one nested mapping over another: groups are merged, values are replaced."""
    merged = dict(below)
    for key, value in above.items():
        both = isinstance(value, Mapping) and isinstance(merged.get(key), Mapping)
        merged[key] = overlay(merged[key], value) if both else value
    return merged


def value_at(values: object, name: str) -> object:
    """Return the value under a dotted name in nested mappings or settings; None if there is none."""
    for part in name.split("."):
        values = values.get(part) if isinstance(values, Mapping) else getattr(values, part, None)
    return values


class ReleaseSettings(Settings):
    """Parameters that depend on the release of Nav2: in their defaults, and some in whether they exist.

    The defaults of the fields are those of Humble. A parameter that the release does not have is None, and is refused
    if it is given.

    Attributes:
        DEFAULTS: Release -> dotted name -> default, where it differs from that of the field.
        MISSING: Release -> dotted name of a parameter it does not have -> what it does instead.
        OURS: Dotted names of the parameters that no release of Nav2 has.

    Args:
        release: The release of Nav2 whose behaviour this is.
    """

    DEFAULTS: ClassVar[Mapping[Release, Mapping[str, Any]]] = {}
    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = {}
    OURS: ClassVar[frozenset[str]] = frozenset({"release"})
    release: Release = "humble"

    @model_validator(mode="before")
    @classmethod
    def _of_the_release(cls, values: Any) -> Any:
        """Nest dotted keys, refuse what the release does not have, and fill in its defaults."""
        if not isinstance(values, Mapping):
            return values
        given = nest_dotted(values)
        release = given.get("release", "humble")
        if release not in RELEASES:
            return given
        for name, instead in cls.MISSING.get(release, {}).items():
            if value_at(given, name) is not None:
                raise ConfigError(f"{name}: Nav2 {release.capitalize()} has no such parameter: {instead}")
        return overlay(nest_dotted(cls.DEFAULTS.get(release, {})), given)

    @model_validator(mode="after")
    def _has_all_of_it(self) -> Self:
        for name, default in self.DEFAULTS.get(self.release, {}).items():
            if default is not None and value_at(self, name) is None:
                raise ConfigError(f"{name}: expected a value, got none")
        return self


class CriticSettings(Settings):
    """Parameters of one critic of any controller."""


class SettingsWithCritics(ReleaseSettings):
    """Parameters of a controller that lists its ``critics``; each critic has a group of parameters under its name."""

    @field_validator("critics", check_fields=False)
    @classmethod
    def _known(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        names = cls.critic_names()
        if not value:
            raise ConfigError(f"expected at least one of {', '.join(names)}, got none")
        for name in value:
            if name not in names:
                raise unknown_name("critic", name, names)
        return value

    @classmethod
    def critic_names(cls) -> tuple[str, ...]:
        """Names of all critics there are."""
        return tuple(name for name, field in cls.model_fields.items() if isinstance(field.default, CriticSettings))
