"""Base classes of the controllers' parameters: defaults by release, and lists of critics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import field_validator, model_validator

from controllers.releases import RELEASES, Release
from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.ros_params import nest_dotted, overlay, value_at
from gym_mapbench.settings import Settings


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
            refuse_unknown("critic", name, names)
        return value

    @property
    def unread(self) -> frozenset[str]:
        """Names of the critics that are not listed; Nav2 does not read their parameters."""
        return frozenset(self.critic_names()) - frozenset(self.critics)  # type: ignore[attr-defined]

    @classmethod
    def critic_names(cls) -> tuple[str, ...]:
        """Names of all critics there are."""
        return tuple(name for name, field in cls.model_fields.items() if isinstance(field.default, CriticSettings))
