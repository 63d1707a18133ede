"""ReleaseSettings: parameters of a plugin whose defaults, or whose existence, depend on the release of Nav2."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from pydantic import model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params.nested import nest_dotted, overlay, value_at
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
