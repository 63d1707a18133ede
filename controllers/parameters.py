"""Base classes of the controllers' parameters: lists of critics."""

from __future__ import annotations

from collections.abc import Mapping

from pydantic import field_validator

from gym_mapbench.errors import ConfigError, refuse_unknown
from gym_mapbench.ros_params import ReleaseSettings
from gym_mapbench.settings import Settings


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
    def unread(self) -> Mapping[str, str]:
        """Names of the critics that are not listed, and whose parameters Nav2 does not read -> why."""
        unlisted = set(self.critic_names()) - set(self.critics)  # type: ignore[attr-defined]
        return dict.fromkeys(unlisted, "critics does not list it")

    @classmethod
    def critic_names(cls) -> tuple[str, ...]:
        """Names of all critics there are."""
        return tuple(name for name, field in cls.model_fields.items() if isinstance(field.default, CriticSettings))
