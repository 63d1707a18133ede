"""Migrates the parameters of one node, its plugins included."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fnmatch import fnmatchcase
from typing import Any

import yaml

from controllers.nav2_params.file.older import OLD_BEHAVIORS, OLD_NODES, todays_names
from controllers.nav2_params.file.yaml_edits import as_yaml, entries
from controllers.nav2_params.migration import monitor, smoothers
from controllers.nav2_params.migration.controllers import migrate_controller
from controllers.nav2_params.migration.entries import migrate_entry
from controllers.nav2_params.migration.lyrical import migrate_forms, move_path_handling
from controllers.nav2_params.migration.rules import NEW_DEFAULTS, STAMPED, STAMPED_NODES
from controllers.nav2_params.migration.wildcards import SERVER, Nodes, nodes_of
from controllers.nav2_params.migration.work import Work, children, controllers_in, listed
from controllers.nav2_params.sections.controllers import TREES_CHOICE
from gym_mapbench.errors import ConfigError


def migrate_node(
    work: Work, full: str, key: yaml.ScalarNode, group: yaml.MappingNode, inflation: Mapping[str, Any]
) -> None:
    """Migrate the parameters of one node."""
    node = key.value.rsplit("/", 1)[-1]
    if node == "recoveries_server":
        work.edits.rename(key, OLD_NODES[node])
        work.say(full, key.start_mark.line + 1, f"renamed to {OLD_NODES[node]}")
        _rename_behaviors(work, full, group)
    nodes = nodes_of(full, group)
    if SERVER not in nodes and any(part.section == full for parts in work.parts.values() for part in parts):
        nodes = (*nodes, SERVER)
    controllers = {
        name: replace(controller, parts=work.parts.get(controller.full, ()))
        for name, controller in (controllers_in(full, group) if SERVER in nodes else {}).items()
    }
    if SERVER in nodes:
        _refuse_dotted(full, group)
    for entry in entries(group):
        migrate_entry(work, full, nodes, entry)
    if monitor.NODE in nodes:
        monitor.migrate_monitor(work, full, group)
    if smoothers.NODE in nodes:
        smoothers.migrate_smoothers(work, full, group)
    moved = move_path_handling(work, full, group, controllers)
    for controller in controllers.values():
        migrate_controller(work, controller, inflation, moved)
    migrate_forms(work, controllers)
    _tell_defaults(work, full, nodes, group)


def _refuse_dotted(full: str, server: yaml.MappingNode) -> None:
    """Refuse a controller whose parameters stand beside its group, under dotted names.

    Raises:
        ConfigError: Naming the first such parameter.
    """
    given = {entry.name: entry for entry in children(server)}
    controllers = listed(given["controller_plugins"]) if "controller_plugins" in given else [TREES_CHOICE]
    for name in given:
        controller, dot, _ = name.partition(".")
        if dot and controller in controllers:
            raise ConfigError(f"{full}.{name}: expected in a group {controller!r}, got a dotted name beside it")


def _rename_behaviors(work: Work, full: str, group: yaml.MappingNode) -> None:
    """Give the recoveries of older releases the names for which the default tree asks."""
    for entry in children(group):
        names = listed(entry)
        if names != todays_names(names):
            work.edits.replace(entry, as_yaml(todays_names(names)))
        name, dot, rest = str(entry.key.value).partition(".")
        if name in OLD_BEHAVIORS:
            work.edits.rename(entry.key, f"{OLD_BEHAVIORS[name]}{dot}{rest}")
            work.say(f"{full}.{name}", entry.line, f"renamed to {OLD_BEHAVIORS[name]}")


def _tell_defaults(work: Work, full: str, nodes: Nodes, group: yaml.MappingNode) -> None:
    """Write out or name the defaults of the nodes that are others in Lyrical, and change what the robot does."""
    if work.target == "humble":
        return
    stamped = work.kilted or work.source == "lyrical"
    given = group.value and STAMPED in {entry.name for entry in children(group)}
    if not STAMPED_NODES.isdisjoint(nodes) and group.value and not given and stamped != (work.target == "lyrical"):
        source = "Kilted" if work.kilted else work.source.capitalize()
        message, unlike = "TwistStamped" if stamped else "Twist", "; Kilted publishes TwistStamped"
        why = f"since {source} publishes {message} by default{unlike if source == 'Jazzy' else ''}"
        work.write_out(full, group, STAMPED, stamped, why)
    if work.enters("lyrical"):
        for node in nodes:
            _tell_new_defaults(work, full, NEW_DEFAULTS.get(node, {}), group)


def _tell_new_defaults(work: Work, full: str, news: Mapping[str, str], group: yaml.MappingNode) -> None:
    """Name the parameters of a node's plugins that only Lyrical has, unless the file gives the first of them."""
    given = {entry.name: entry for entry in entries(group)}
    for name, entry in given.items():
        plugin, _, last = name.rpartition(".")
        for pattern, new in news.items() if last == "plugin" else ():
            first = f"{plugin}.{new.partition(' ')[0]}"
            if fnmatchcase(str(entry.value.value).replace("/", "::"), pattern) and first not in given:
                work.tell(f"{full}.{plugin}", f"new in Lyrical and at its default: {new}")
