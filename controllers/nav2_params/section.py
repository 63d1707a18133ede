"""Section: one group of a parameter file, read key by key so that none goes unnoticed."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Any, TypeVar

from controllers.nav2_params.findings import Findings
from controllers.nav2_params.keys import Keys
from controllers.parameters import nest_dotted
from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.settings import Settings

S = TypeVar("S", bound=Settings)


class Section:
    """One group of a parameter file.

    Args:
        name: Full dotted name; opens every error message.
        values: The group; dotted keys are expanded, None is an empty group.
        findings: Where the full names of all keys without effect are collected, and of those to be refused.

    Raises:
        ConfigError: If ``values`` is not a mapping, or gives a parameter twice.
    """

    def __init__(self, name: str, values: object, findings: Findings) -> None:
        if values is not None and not isinstance(values, Mapping):
            raise ConfigError(f"{name}: expected a group of parameters, got {type(values).__name__}")
        self.name = name
        self.findings = findings
        try:
            self.values = nest_dotted(values or {})
        except ConfigError as error:
            raise ConfigError(f"{name}.{error}") from None

    def take_group(self, key: str) -> Section:
        """Take a group out; an empty one if there is none."""
        return Section(f"{self.name}.{key}", self.values.pop(key, None), self.findings)

    def take_names(self, key: str, default: tuple[str, ...], least: int = 0) -> tuple[str, ...]:
        """Take a list of at least so many names out."""
        value = self.values.pop(key, default)
        if not isinstance(value, (list, tuple)) or not all(isinstance(name, str) for name in value):
            raise ConfigError(f"{self.name}.{key}: expected a list of names, got {_kind(value)}")
        if len(value) < least or len(set(value)) < len(value):
            wanted = "at least one name, none" if least else "no name"
            raise ConfigError(f"{self.name}.{key}: expected {wanted} twice, got {list(value)}")
        return tuple(value)

    def take_name(self, key: str, default: str) -> str:
        """Take one name out."""
        value = self.values.pop(key, default)
        if not isinstance(value, str):
            raise ConfigError(f"{self.name}.{key}: expected a name, got {_kind(value)}")
        return value

    def leave(self, key: str) -> None:
        """Take a key out and list it as unused."""
        self.values.pop(key, None)
        self.findings.unused.append(f"{self.name}.{key}")

    def leave_groups(self) -> None:
        """Leave the groups that remain: no list of plugins names them, so ROS does not read them either."""
        for key in [key for key, value in self.values.items() if isinstance(value, Mapping)]:
            self.leave(key)

    def read(self, keys: Keys, valid: Collection[str]) -> dict[str, Any]:
        """Sort all keys and return, nested, the parameters among them; the findings get the others.

        Args:
            keys: What is known of this section's other keys.
            valid: Dotted names of its parameters.

        Raises:
            ConfigError: If a key is given under two names.
        """
        kept: dict[str, Any] = {}
        for given, value in leaves(self.values):
            name = keys.renamed.get(given, given)
            if name in kept:
                raise ConfigError(f"{self.name}.{given}: already given under another name")
            if name in valid:
                kept[name] = value
            else:
                self._find(given, name, keys, valid)
        return nest_dotted(kept)

    def build(self, settings: type[S], keys: Keys, **given: Any) -> S:
        """Read all keys into ``settings``; ``given`` are parameters read already."""
        return self.make(settings, {**self.read(keys, parameter_names(settings)), **given})

    def make(self, settings: type[S], values: Mapping[str, Any]) -> S:
        """Make ``settings``; errors open with the full name of the parameter."""
        try:
            return settings(**values)
        except ConfigError as error:
            raise ConfigError(f"{self.name}.{error}") from None

    def _find(self, given: str, name: str, keys: Keys, valid: Collection[str]) -> None:
        """List a key that is no parameter here; ``name`` is its name in Humble."""
        full, findings = f"{self.name}.{given}", self.findings
        if name in keys.unmodelled:
            findings.unmodelled.append(full)
        elif keys.is_ros_only(name):
            findings.ros_only.append(full)
        elif name in keys.newer_only:
            findings.newer[full] = keys.newer_only[name]
        else:
            findings.unknown[full] = nearest_name(given, [*valid, *keys.renamed]) or ""


def leaves(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of a nested mapping."""
    for key, value in values.items():
        if isinstance(value, Mapping):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def parameter_names(settings: type[Settings]) -> list[str]:
    """Dotted names of all options, those of nested settings included."""
    names = []
    for name, field in settings.model_fields.items():
        inner = field.annotation
        if isinstance(inner, type) and issubclass(inner, Settings):
            names += [f"{name}.{below}" for below in parameter_names(inner)]
        else:
            names.append(name)
    return names


def _kind(value: object) -> str:
    return f"{value!r}" if isinstance(value, (str, int, float)) else type(value).__name__
