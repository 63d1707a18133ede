"""Nested groups of parameters, and the dotted names of their values."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from gym_mapbench.errors import ConfigError


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


def leaves(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the dotted names and values of a nested mapping."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
