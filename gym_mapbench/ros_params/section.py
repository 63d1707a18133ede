"""Section: one group of a parameter file, read key by key so that no key goes unnoticed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, TypeVar

from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.ros_params.findings import Findings
from gym_mapbench.ros_params.keys import Keys
from gym_mapbench.ros_params.nested import leaves, nest_dotted
from gym_mapbench.ros_params.templates import find_template, no_value
from gym_mapbench.ros_params.types import mistyped
from gym_mapbench.settings import Settings

S = TypeVar("S", bound=Settings)
RELEASE = "release"
"""The parameter of this project that names the release whose behaviour is modelled."""
MISSPELT_KEY = 0.8
"""Similarity from which on an unknown key is probably a misspelt known one."""


class Section:
    """One group of a parameter file.

    Args:
        name: Full dotted name, with which every error message begins.
        values: The group; dotted keys are expanded, and None is an empty group.
        findings: Collects all keys without effect.
        stand_in: Whether another plugin stands in for the one of this group, so that keys may have no counterpart.
        written: Full dotted name of the same group in a file that is written, where some groups have fixed names.

    Raises:
        ConfigError: If ``values`` is not a mapping, or gives a parameter twice.
    """

    def __init__(
        self, name: str, values: object, findings: Findings, stand_in: bool = False, written: str | None = None
    ) -> None:
        if values is not None and not isinstance(values, Mapping):
            raise ConfigError(f"{name}: expected a group of parameters, got {type(values).__name__}")
        self.name = name
        self.findings = findings
        self.stand_in = stand_in
        self.written = name if written is None else written
        self._spelt: dict[str, str] = {}
        self._given: dict[str, tuple[str, Any]] = {}
        try:
            self.values = nest_dotted(values or {})
        except ConfigError as error:
            raise ConfigError(f"{name}.{error}") from None

    def take_group(self, key: str, written: str | None = None) -> Section:
        """Take a group out, or an empty one if there is none; ``written`` is its name in a file that is written."""
        values = self.values.pop(key, None)
        return Section(f"{self.name}.{key}", values, self.findings, self.stand_in, f"{self.written}.{written or key}")

    def take_names(self, key: str, default: tuple[str, ...], least: int = 0) -> tuple[str, ...]:
        """Take out a list of at least ``least`` different names."""
        value = self.values.pop(key, default)
        self._refuse_template(key, value)
        if not isinstance(value, (list, tuple)):
            raise ConfigError(f"{self.name}.{key}: expected a list of names, got {_kind(value)}")
        for name in value:
            if not isinstance(name, str):
                raise ConfigError(f"{self.name}.{key}: expected a list of names, got {_kind(name)} among them")
        if len(value) < least or len(set(value)) < len(value):
            wanted = "at least one name, none" if least else "no name"
            raise ConfigError(f"{self.name}.{key}: expected {wanted} twice, got {list(value)}")
        return tuple(value)

    def take_name(self, key: str, default: str) -> str:
        """Take out one name."""
        value = self.values.pop(key, default)
        self._refuse_template(key, value)
        if not isinstance(value, str):
            raise ConfigError(f"{self.name}.{key}: expected a name, got {_kind(value)}")
        return value

    def rename(self, key: str, new: str) -> None:
        """Give a key another name; findings keep the name in the file."""
        self.values[new] = self.values.pop(key)
        self._spelt[new] = key

    def cap(self, key: str, most: float, why: str) -> None:
        """Lower a number that is too high to the highest possible one, and list that."""
        value = self.values.get(key)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and value > most:
            self.values[key] = most
            self.findings.add("replaced", f"{self.name}.{key}", f"taken as {most:g}: {why}")

    def correct(self, key: str, valid: Collection[int], corrected: int) -> None:
        """Take another number for one that is not valid, as Nav2 does with a warning, and list that."""
        value = self.values.get(key)
        if isinstance(value, int) and not isinstance(value, bool) and value not in valid:
            self.values[key] = corrected
            self.findings.add("replaced", f"{self.name}.{key}", f"taken as {corrected}, as in Nav2")

    def leave(self, key: str) -> None:
        """Take out a key and list it as unused."""
        self.values.pop(key, None)
        self.findings.add("unused", f"{self.name}.{key}")

    def leave_groups(self) -> None:
        """List the remaining groups as unused: no list of plugins names them, so ROS does not read them either."""
        for key in [key for key, value in self.values.items() if isinstance(value, Mapping)]:
            self.leave(key)

    def read(self, keys: Keys, valid: Collection[str]) -> dict[str, Any]:
        """Go through all keys and return the parameters among them, nested; all other keys become findings.

        Args:
            keys: The section's other keys.
            valid: Dotted names of its parameters, including those that only one release has.

        Raises:
            ConfigError: If the value of a parameter is a template.
        """
        kept: dict[str, Any] = {}
        given = dict(leaves(self.values))
        for key, value in given.items():
            name = key if key in valid else keys.renamed.get(key, key)
            if name not in valid or keys.why_not(name, self.findings.release) is not None:
                self._find(key, value, name, keys, valid)
            elif name != key and (name in given or name in kept):
                self.findings.add("unused", f"{self.name}.{key}", f"{name} is given as well, and counts")
            elif not self._left_to_robot(key, value, keys):
                kept[name] = value
                self._given[name] = self._spelt.get(key, key), value
                if name != key:
                    self.findings.add("renamed", f"{self.name}.{key}", name)
        return nest_dotted(kept)

    def _left_to_robot(self, key: str, value: object, keys: Keys) -> bool:
        """Whether the value is an unfilled template of the robot's shape, which the robot itself then gives.

        Raises:
            ConfigError: If it is an unfilled template of another parameter.
        """
        template = find_template(value)
        if template is None:
            return False
        if key not in keys.shape:
            raise no_value(f"{self.name}.{key}", template)
        self.findings.add(
            "template", f"{self.name}.{key}", f"{template.text} has no value; --define {template.name}=VALUE"
        )
        return True

    def _refuse_template(self, key: str, value: object) -> None:
        template = find_template(value)
        if template is not None:
            raise no_value(f"{self.name}.{key}", template)

    def build(self, settings: type[S], keys: Keys, **given: Any) -> S:
        """Read all keys into ``settings``; ``given`` are parameters that were read already."""
        names = [name for name in parameter_names(settings) if name != RELEASE]
        release = {RELEASE: self.findings.release} if RELEASE in settings.model_fields else {}
        return self.make(settings, {**self.read(keys, names), **release, **given})

    def make(self, settings: type[S], values: Mapping[str, Any]) -> S:
        """Make ``settings``; errors begin with the full name of the parameter. Values of a wrong type are findings."""
        try:
            made = settings(**values)
        except ConfigError as error:
            raise ConfigError(f"{self.name}.{error}{self._slip()}") from None
        if not self.stand_in:
            self._find_without_effect(made)
        return made

    def _find_without_effect(self, made: Settings) -> None:
        """List the given parameters that the plugin does not read, and numbers of another type than their parameter."""
        unread: Mapping[str, str] = getattr(made, "unread", {})
        for name, (key, value) in self._given.items():
            group = name.partition(".")[0]
            why = mistyped(type(made), name, value)
            if group in unread:
                self.findings.add("unused", f"{self.name}.{key}", unread[group])
            elif why:
                self.findings.add("mistyped", f"{self.name}.{key}", why)

    def _slip(self) -> str:
        """Name the first key that looks misspelt, which may be why a parameter is missing."""
        slips = (f for f in self.findings.found if f.kind == "unknown" and f.why and f.name.startswith(f"{self.name}."))
        return next((f"; {slip.name} is no parameter, {slip.why}" for slip in slips), "")

    def _find(self, given: str, value: object, name: str, keys: Keys, valid: Collection[str]) -> None:
        """List a key that is no parameter here; ``given`` is its name in the file, ``name`` its name here."""
        full, add = f"{self.name}.{given}", self.findings.add
        why = keys.why_not(name, self.findings.release)
        if name in keys.left_out:
            add("left_out", full)
        elif keys.is_ros_only(name):
            add("ros_only", full)
            self.findings.keep(f"{self.written}.{given}", value)
        elif self.stand_in:
            add("detail", full)
        elif why is not None:
            add("other_release", full, why)
        else:
            near = nearest_name(given, [*valid, *keys.renamed], MISSPELT_KEY)
            add("unknown", full, f"did you mean {near!r}?" if near else "")


def parameter_names(settings: type[Settings]) -> list[str]:
    """Return the dotted names of all options, including those of nested settings."""
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
