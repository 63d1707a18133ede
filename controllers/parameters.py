"""The shape of ROS parameters: dotted keys and nested mappings are two spellings of one thing; lists of critics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pydantic import field_validator, model_validator

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
    """Put ``value`` under the path ``names``; a mapping is merged into the group of that name."""
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


class CriticSettings(Settings):
    """Parameters of one critic of any controller."""


class SettingsWithCritics(Settings):
    """Parameters of a controller that asks the ``critics`` it lists; each has a group of parameters of its name."""

    @model_validator(mode="before")
    @classmethod
    def _nest(cls, values: Any) -> Any:
        return nest_dotted(values) if isinstance(values, Mapping) else values

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
