"""Work: one migration under way, its edits of the text and its report."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import yaml

from controllers.descriptor import Nav2Controller
from controllers.nav2_params.file.yaml_edits import Edits, Entry, as_yaml, entries
from controllers.nav2_params.plugins import CONTROLLERS, SHIMS, controller_kind
from controllers.parameters import SettingsWithCritics
from controllers.rotation_shim.plugin import OWN_OF_SHIM, PRIMARY
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import RosPlugin, nest_dotted


class Part(NamedTuple):
    """What a section gives of a controller whose class stands in another section.

    Args:
        section: Full name of the section.
        full: Full name of the group in it.
        group: The mapping.
    """

    section: str
    full: str
    group: yaml.MappingNode


@dataclass
class Work:
    """One migration under way.

    Args:
        edits: The changes of the text.
        source: The distribution for which the file was written.
        target: The distribution to which it is migrated.
        kilted: Whether the file is Kilted's, which publishes TwistStamped by default, unlike Jazzy.
        named_by_trees: The progress checker that the tree names, by the namespace of its navigator.
        parts: Full name of a controller whose parameters stand in several sections -> those beside its class's section.
        done: The changes, one line each.
        lost: Keys without a counterpart, one line each.
    """

    edits: Edits
    source: Release
    target: Release
    kilted: bool
    named_by_trees: Mapping[str, str]
    parts: Mapping[str, Sequence[Part]] = field(default_factory=dict)
    done: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    def enters(self, release: Release) -> bool:
        """Return whether the file becomes one of a distribution of which it was not."""
        return self.target == release != self.source

    def leaves(self, release: Release) -> bool:
        """Return whether the file was one of a distribution, and is no longer."""
        return self.source == release != self.target

    def crosses(self, release: Release) -> bool:
        """Return whether the file becomes one of a distribution, or was one and is no longer."""
        return self.enters(release) or self.leaves(release)

    def say(self, full: str, line: int, what: str) -> None:
        """Add a line about a change."""
        self.done.append(f"line {line}: {self._written(full)}: {what}")

    def tell(self, full: str, what: str) -> None:
        """Add a line about a change that has no line in the file."""
        self.done.append(f"{full}: {what}")

    def lose(self, full: str, entry: Entry, what: str) -> None:
        """Add a line about a key without a counterpart."""
        self.lost.append(f"line {entry.line}: {self._written(f'{full}.{entry.name}')}: {what}")

    def take_out(self, full: str, entry: Entry, why: str) -> None:
        """Remove a key without a counterpart."""
        self.edits.remove(entry)
        self.lose(full, entry, f"taken out: {why}")

    def write_out(self, full: str, group: yaml.MappingNode, name: str, value: Any, why: str) -> None:
        """Insert a parameter that the file does not give."""
        self.edits.insert(group, name, value)
        self.tell(f"{full}.{name}", f"written out as {as_yaml(value)}, {why}")

    def _written(self, full: str) -> str:
        """Return the name that a controller's parameter has in the file, whichever section gives it."""
        for controller, parts in self.parts.items():
            for part in parts if full.startswith(f"{controller}.") else ():
                inner = full.removeprefix(f"{controller}.")
                if any(entry.name == inner for entry in entries(part.group)):
                    return f"{part.full}.{inner}"
        return full


@dataclass(frozen=True)
class ControllerGroup:
    """The group of a controller that is built here.

    Args:
        full: Its full name.
        group: The mapping.
        kind: Its plugin, by the name in :data:`~controllers.nav2_params.plugins.CONTROLLERS`.
        parts: What other sections give of it.
    """

    full: str
    group: yaml.MappingNode
    kind: str
    parts: Sequence[Part] = ()

    @property
    def plugin(self) -> Nav2Controller:
        """Its description."""
        return CONTROLLERS[self.kind]

    @property
    def primary(self) -> str:
        """The kind of the controller that follows the path: that inside a Rotation Shim, or else itself."""
        return SHIMS.get(self.kind, self.kind)

    @property
    def given(self) -> dict[str, Entry]:
        """Its parameters and groups by dotted name; those of a primary controller stand beside the others."""
        return {_beside(entry.name): entry for group in self.groups for entry in entries(group)}

    @property
    def groups(self) -> list[yaml.MappingNode]:
        """The mappings of all sections that give its parameters."""
        return [self.group, *(part.group for part in self.parts)]

    def children(self) -> Iterator[Entry]:
        """Yield the parameters and groups that stand in these mappings themselves."""
        for group in self.groups:
            yield from children(group)


def controllers_in(full: str, server: yaml.MappingNode) -> dict[str, ControllerGroup]:
    """Return the groups of the controllers that are built here, by name; those of primary controllers are not."""
    found = {}
    for entry in entries(server):
        kind = None if entry.name.endswith(f".{PRIMARY}") else controller_kind(values_in(entry.value))
        if kind is not None and isinstance(entry.value, yaml.MappingNode):
            found[entry.name] = ControllerGroup(f"{full}.{entry.name}", entry.value, kind)
    return found


def _beside(name: str) -> str:
    inner = name.removeprefix(f"{PRIMARY}.")
    return name if inner in OWN_OF_SHIM else inner


def values_in(node: yaml.Node) -> dict[str, Any]:
    """Return the single values below a mapping, nested; none if a name stands for a value and a group."""
    single = {entry.name: entry.value.value for entry in entries(node) if isinstance(entry.value, yaml.ScalarNode)}
    try:
        return nest_dotted(single)
    except ConfigError:
        return {}


def value_of(entry: Entry) -> Any:
    """Return the value of a parameter."""
    return yaml.safe_load(entry.value.value) if isinstance(entry.value, yaml.ScalarNode) else listed(entry)


def listed(entry: Entry | None) -> list[str]:
    """Return the texts of a list; none if there is no list."""
    items = entry.value.value if entry is not None and isinstance(entry.value, yaml.SequenceNode) else []
    return [item.value for item in items if isinstance(item, yaml.ScalarNode)]


def critic_of(plugin: Nav2Controller, name: str) -> str | None:
    """Return the critic to which a parameter belongs; None for parameters that belong to no critic."""
    params, first = plugin.params, name.partition(".")[0]
    return first if issubclass(params, SettingsWithCritics) and first in params.critic_names() else None


def asks(given: Mapping[str, Entry], critic: str | None) -> bool:
    """Whether a controller lists a critic; true for None, which stands for parameters that belong to no critic."""
    return critic is None or critic in listed(given.get("critics"))


def children(group: yaml.MappingNode) -> Iterator[Entry]:
    """Yield the parameters and groups that stand in a mapping itself."""
    for key, value in group.value:
        if isinstance(key, yaml.ScalarNode):
            yield Entry(key.value, group, key, value)


def placed(work: Work, controller: ControllerGroup, name: str) -> str:
    """Return the name under which a new parameter of a controller stands in its group in the target."""
    into_primary = work.enters("lyrical") and controller.kind in SHIMS
    return f"{PRIMARY}.{name}" if into_primary and name.partition(".")[0] not in OWN_OF_SHIM else name


def tell_awakened(work: Work, full: str, given: Mapping[str, Entry], plugin: RosPlugin) -> None:
    """Name the given parameters that the source ignores and the target reads."""
    missing = plugin.keys.missing
    for name in missing.get(work.source, {}):
        if name in given and name in plugin.parameters and name not in missing.get(work.target, {}):
            source, target = work.source.capitalize(), work.target.capitalize()
            work.say(f"{full}.{name}", given[name].line, f"counts in {target}, and not in {source}")
