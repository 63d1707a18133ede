"""Turns a parameter file of one distribution into one of the other, and lists everything that was done.

Outdated names are replaced, classes are spelt as the release wants them, parameters whose default changed are written
out with the old value, and keys without a counterpart are taken out and listed. Comments and templates stay.

Source: Nav2's migration guides, and the tables of the controllers' own parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import yaml

from controllers.descriptor import Nav2Controller
from controllers.nav2_params.document import PARAMETERS
from controllers.nav2_params.migration_rules import (
    OVERTAKEN,
    RENAMES,
    RESPELT,
    TREE_PLUGINS,
    UNKNOWN,
    Rename,
)
from controllers.nav2_params.nodes import Node, all_nodes
from controllers.nav2_params.older import OLD_NODES
from controllers.nav2_params.plugins import CONTROLLERS, controller_kind
from controllers.nav2_params.recognition import recognise
from controllers.nav2_params.yaml_edits import Edits, Entry, as_yaml, entries
from controllers.releases import Release
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml, read_document_text


@dataclass(frozen=True)
class Migration:
    """A migrated file.

    Args:
        text: The text of the migrated file.
        source: The distribution for which the file was written.
        target: The distribution for which it is written now.
        done: The changes, one line each.
        lost: Keys without a counterpart, one line each.
    """

    text: str
    source: Release
    target: Release
    done: tuple[str, ...] = ()
    lost: tuple[str, ...] = ()


def migrate_file(path: str | Path, target: Release, source: Release | None = None) -> Migration:
    """Migrate a parameter file.

    Args:
        path: The file; it is not changed.
        target: The distribution to migrate to.
        source: The distribution for which the file is written; None to recognise it.

    Raises:
        ConfigError: If the file cannot be read, is not a parameter file, or mixes the distributions.
    """
    text = read_document_text(path)
    values, root = parse_yaml(text, path)
    try:
        nodes = all_nodes(values)
        known = source or recognise(nodes).release
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    work = _Work(Edits(text), known, target, _inflation_layer(nodes))
    if root is not None:
        for full, key, group in parameter_groups(root, ""):
            work.migrate_node(full, key, group)
    return Migration(work.edits.apply(), known, target, tuple(work.done), tuple(work.lost))


def parameter_groups(group: yaml.Node, prefix: str) -> Iterator[tuple[str, yaml.ScalarNode, yaml.MappingNode]]:
    """Yield the full name, the key and the parameters of every node."""
    if not isinstance(group, yaml.MappingNode):
        return
    for key, value in group.value:
        if not isinstance(value, yaml.MappingNode) or not isinstance(key, yaml.ScalarNode):
            continue
        inner = [below for name, below in value.value if name.value == PARAMETERS]
        if inner and isinstance(inner[0], yaml.MappingNode):
            yield f"{prefix}{key.value}", key, inner[0]
        else:
            yield from parameter_groups(value, f"{prefix}{key.value}.")


@dataclass
class _Work:
    """One migration under way."""

    edits: Edits
    source: Release
    target: Release
    inflation: Mapping[str, Any]
    done: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=list)

    def migrate_node(self, full: str, key: yaml.ScalarNode, group: yaml.MappingNode) -> None:
        """Migrate the parameters of one node."""
        node = key.value.rsplit("/", 1)[-1]
        if node == "recoveries_server":
            self.edits.rename(key, OLD_NODES[node])
            self.say(full, key.start_mark.line + 1, f"renamed to {OLD_NODES[node]}")
        controllers = _controllers(group) if node == "controller_server" else {}
        for entry in entries(group):
            self.migrate_entry(full, node, entry)
        for name, (inner, plugin) in controllers.items():
            self.migrate_controller(f"{full}.{name}", inner, plugin)

    def migrate_entry(self, full: str, node: str, entry: Entry) -> None:
        """Migrate one parameter by the rules for its node."""
        for rename in RENAMES[self.target]:
            if fnmatchcase(node, rename.node) and fnmatchcase(entry.name, rename.old):
                self.rename(full, entry, rename)
                return
        if self.is_unknown(node, entry):
            self.edits.remove(entry)
            self.lose(full, entry, f"taken out: {self.target.capitalize()} has no such parameter")
            return
        if entry.name == TREE_PLUGINS and self.target == "jazzy":
            self.trim_tree_plugins(full, entry)
        if node in RESPELT and entry.name.endswith(".plugin"):
            self.respell(full, entry)

    def is_unknown(self, node: str, entry: Entry) -> bool:
        """Whether a key means nothing in the target."""
        siblings = {key.value for key, _ in entry.group.value}
        if node == "behavior_server" and OVERTAKEN.get(self.target, {}).get(entry.name) in siblings:
            return True
        of_nodes = UNKNOWN[self.target].items()
        patterns = [pattern for name, patterns in of_nodes if fnmatchcase(node, name) for pattern in patterns]
        return any(fnmatchcase(entry.name, pattern) for pattern in patterns)

    def trim_tree_plugins(self, full: str, entry: Entry) -> None:
        """Leave only third parties' plugins of the behaviour tree; Jazzy loads Nav2's own by itself."""
        others = [name for name in _listed(entry) if not name.startswith("nav2_")]
        if others:
            self.edits.replace(entry, as_yaml(others))
        else:
            self.edits.remove(entry)
        self.say(f"{full}.{entry.name}", entry.line, "Nav2's own plugins taken out: Jazzy loads them by itself")

    def rename(self, full: str, entry: Entry, rename: Rename) -> None:
        """Give a parameter its new name, and its value the new form, unless the new name is given as well."""
        goes = OVERTAKEN.get(self.target, {}).get(rename.new) == entry.name
        if not goes and any(key.value == rename.new for key, _ in entry.group.value):
            return
        head = entry.key.value.rpartition(".")[0]
        self.edits.rename(entry.key, f"{head}.{rename.new}" if head else rename.new)
        self.say(full + "." + entry.name, entry.line, f"renamed to {rename.new}")
        if rename.listed is True and isinstance(entry.value, yaml.ScalarNode):
            self.edits.replace(entry, f"[{as_yaml(entry.value.value)}]")
        elif rename.listed is False and isinstance(entry.value, yaml.SequenceNode) and entry.value.value:
            first, *others = _listed(entry) or [""]
            self.edits.replace(entry, as_yaml(first))
            for other in others:
                self.lose(full, entry, f"only the first counts in {self.target.capitalize()}, {other} does not")

    def respell(self, full: str, entry: Entry) -> None:
        """Write the class of a plugin as the release wants it."""
        old = str(entry.value.value)
        package, _, name = old.replace("::", "/").partition("/")
        separator = "/" if self.target == "humble" else "::"
        new = package.replace("nav2_recoveries", "nav2_behaviors") + separator + name.replace("/", "::")
        if old.startswith("nav2_") and name and new != old:
            self.edits.replace(entry, as_yaml(new))
            self.say(f"{full}.{entry.name}", entry.line, f"written {new}")

    def migrate_controller(self, full: str, group: yaml.MappingNode, plugin: Nav2Controller) -> None:
        """Migrate a controller by what its own parameters say about the releases."""
        given = {entry.name: entry for entry in entries(group)}
        missing = plugin.keys.missing.get(self.target, {})
        for name in [name for name in missing if name in given]:
            if not self.exchange(full, given[name], plugin):
                self.edits.remove(given[name])
                self.lose(full, given[name], f"taken out: {missing[name]}")
        self.replace_critics(full, given, plugin)
        written = plugin.changed_defaults(self.source, self.target)
        for name, value in written.items():
            self.write_out(full, group, given, name, value, f"{self.source.capitalize()}'s default")
        layer = self.inflation if self.target == "humble" != self.source else {}
        for name, value in layer.items():
            self.write_out(full, group, given, name, value, "the local costmap's")
        self.tell_new(full, {*given, *layer}, given, plugin)

    def write_out(
        self, full: str, group: yaml.MappingNode, given: Mapping[str, Entry], name: str, value: Any, why: str
    ) -> None:
        """Write out a parameter that is not given, unless it belongs to a critic that the controller does not list."""
        critic = name.partition(".")[0] if "." in name else None
        if name in given or not _asks(given, critic):
            return
        holder = _group_of(given.get(critic or ""))
        self.edits.insert(holder or group, name.partition(".")[2] if holder else name, value)
        self.done.append(f"{full}.{name}: written out as {value}, {why}")

    def tell_new(self, full: str, known: set[str], given: Mapping[str, Entry], plugin: Nav2Controller) -> None:
        """Say which parameters are new in the target and not yet ``known``, and what their defaults are."""
        new = plugin.keys.missing.get(self.source, {}).keys() - plugin.keys.missing.get(self.target, {}).keys()
        exchanged = {f"{old.rpartition('.')[0]}.{name}" for old, (name, _) in plugin.exchanged.items() if old in given}
        named = [name for name in plugin.parameters if name in new - exchanged - plugin.our_keys - known]
        asked = [name for name in named if _asks(given, name.partition(".")[0] if "." in name else None)]
        if asked:
            said = ", ".join(f"{name} {plugin.default(name, self.target)}" for name in asked)
            self.done.append(f"{full}: new in {self.target.capitalize()} and at its default: {said}")

    def exchange(self, full: str, entry: Entry, plugin: Nav2Controller) -> bool:
        """Exchange a parameter for the other release's, if the plugin knows one; return whether it does."""
        new, values = plugin.exchanged.get(entry.name, ("", {}))
        value = values.get(str(entry.value.value).lower())
        if value is None:
            return False
        head = entry.key.value.rpartition(".")[0]
        self.edits.rename(entry.key, f"{head}.{new}" if head else new)
        self.edits.replace(entry, value)
        self.say(f"{full}.{entry.name}", entry.line, f"now {new}: {value}")
        return True

    def replace_critics(self, full: str, given: Mapping[str, Entry], plugin: Nav2Controller) -> None:
        """Replace critics that only the source has."""
        critics = given.get("critics")
        listed = _listed(critics)
        only = plugin.old_critics.get(self.source, {}) if self.source != self.target else {}
        for old, new in only.items():
            if critics is not None and old in listed and new not in listed:
                self.edits.replace(critics, as_yaml([new if name == old else name for name in listed]))
                if old in given:
                    self.edits.rename(given[old].key, new)
                self.say(f"{full}.{old}", critics.line, f"replaced by {new}")

    def say(self, full: str, line: int, what: str) -> None:
        """Add a line about a change."""
        self.done.append(f"line {line}: {full}: {what}")

    def lose(self, full: str, entry: Entry, what: str) -> None:
        """Add a line about a key without a counterpart."""
        self.lost.append(f"line {entry.line}: {full}.{entry.name}: {what}")


def _controllers(group: yaml.MappingNode) -> dict[str, tuple[yaml.MappingNode, Nav2Controller]]:
    """Return the groups of the controllers that are built here, by name, with their plugins."""
    found = {}
    for entry in entries(group):
        inner = {below.name: below.value.value for below in entries(entry.value)}
        kind = controller_kind(inner)
        if kind is not None and isinstance(entry.value, yaml.MappingNode):
            found[entry.name] = (entry.value, CONTROLLERS[kind])
    return found


def _inflation_layer(nodes: list[Node]) -> dict[str, Any]:
    """Return what Humble's ObstaclesCritic has to be told about the local costmap's inflation layer."""
    for node in nodes:
        if node.name == "local_costmap" and node.group is not None and isinstance(node.group[PARAMETERS], Mapping):
            layer = node.group[PARAMETERS].get("inflation_layer")
            layer = layer if isinstance(layer, Mapping) else {}
            names = ("cost_scaling_factor", "inflation_radius")
            return {f"ObstaclesCritic.{name}": layer[name] for name in names if name in layer}
    return {}


def _group_of(entry: Entry | None) -> yaml.MappingNode | None:
    """Return the mapping under a key, None if there is none or it is empty."""
    value = None if entry is None else entry.value
    return value if isinstance(value, yaml.MappingNode) and value.value else None


def _listed(entry: Entry | None) -> list[str]:
    """Return the texts of a list; none if there is no list."""
    items = entry.value.value if entry is not None and isinstance(entry.value, yaml.SequenceNode) else []
    return [item.value for item in items if isinstance(item, yaml.ScalarNode)]


def _asks(given: Mapping[str, Entry], critic: str | None) -> bool:
    """Whether a controller lists a critic; true for None, which stands for parameters that belong to no critic."""
    return critic is None or critic in _listed(given.get("critics"))
