"""Turns a parameter file of one distribution into one of another, and lists everything that was done.

Outdated names are replaced, classes are spelt as the release wants them, parameters whose default changed are written
out with the old value, and keys without a counterpart are taken out and listed. Comments and templates stay.

Source: Nav2's migration guides, and the tables of the controllers' own parameters.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import yaml

from controllers.nav2_params import lyrical_migration
from controllers.nav2_params.controller_migration import migrate_controller
from controllers.nav2_params.controllers_section import TREES_CHOICE
from controllers.nav2_params.costmap_section import LEGACY_LAYERS
from controllers.nav2_params.document import PARAMETERS
from controllers.nav2_params.migration_rules import (
    LYRICALS,
    NEW_DEFAULTS,
    OLD_TREE,
    OVERTAKEN,
    RENAMES,
    RESPELT,
    RESPELT_PACKAGES,
    STAMPED,
    STAMPED_NODES,
    TREE_PLUGINS,
    UNKNOWN,
    Rename,
)
from controllers.nav2_params.migration_work import Work, children, controllers_in, listed
from controllers.nav2_params.monitor_migration import NODE as MONITOR
from controllers.nav2_params.monitor_migration import migrate_monitor
from controllers.nav2_params.nodes import Node, all_nodes, is_of_nav2, is_wildcard
from controllers.nav2_params.older import OLD_BEHAVIORS, OLD_NODES, todays_names
from controllers.nav2_params.plugins import COSTMAP_LAYERS
from controllers.nav2_params.recognition import recognise
from controllers.nav2_params.signs import kilted_key
from controllers.nav2_params.smoother_migration import NODE as SMOOTHER_SERVER
from controllers.nav2_params.smoother_migration import migrate_smoothers
from controllers.nav2_params.tree_file import NAVIGATOR
from controllers.nav2_params.tree_ids import PROGRESS_CHECKER
from controllers.nav2_params.wildcard_migration import (
    SERVER,
    Nodes,
    nodes_of,
    refuse_shared_name,
    split_controllers,
)
from controllers.nav2_params.wildcards import giving_sections, share
from controllers.nav2_params.yaml_edits import Edits, Entry, as_yaml, entries
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml, read_document_text
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import first_unreadable, known_class


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
    done: tuple[str, ...]
    lost: tuple[str, ...]


def migrate_file(path: str | Path, target: Release, source: Release | None = None) -> Migration:
    """Migrate a parameter file.

    Args:
        path: The file; it is not changed.
        target: The distribution to migrate to.
        source: The distribution for which the file is written; None to recognise it. A file that is recognised as
            Jazzy's and has a key of Kilted's publishes TwistStamped by default.

    Raises:
        ConfigError: If the file cannot be read, is not a parameter file, mixes the distributions, has a controller or
            a parameter in a section for several nodes where it cannot be converted, or does not say which of several
            progress checkers is the one for Humble.
    """
    text = read_document_text(path)
    values, root = _parse(text, path)
    try:
        nodes = all_nodes(values)
        known = source or recognise(nodes).release
        shared = share(nodes)
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    kilted = kilted_key([*nodes, *shared.made]) if source is None and known == "jazzy" else ""
    kilted = shared.origins.get(kilted, kilted)
    work = Work(Edits(text), known, target, bool(kilted), _named_by_trees(nodes))
    if kilted and target != "humble":
        work.tell(kilted, "a key of Kilted, which publishes TwistStamped by default")
    try:
        groups = [] if root is None else list(parameter_groups(root, ""))
        work.parts = split_controllers(groups, giving_sections(nodes, SERVER), work)
        for full, key, group in groups:
            _migrate_node(work, full, key, group, _inflation_layer(shared.nodes))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from None
    return Migration(work.edits.apply(), known, target, tuple(work.done), tuple(work.lost))


def _parse(text: str, path: str | Path) -> tuple[Any, yaml.Node | None]:
    """Read a file; a template that YAML cannot hold is named."""
    try:
        return parse_yaml(text, path)
    except ConfigError:
        found = first_unreadable(text)
        if found is None:
            raise
        where = f"{path}: line {found[0]}"
        raise ConfigError(f"{where}: expected a value or quotes around the template {found[1].text}") from None


def _named_by_trees(nodes: list[Node]) -> dict[str, str]:
    """Return the progress checker that each navigator says its tree names, by the namespace."""
    return {
        _namespace(node.full): str(node.group[PARAMETERS][PROGRESS_CHECKER])
        for node in nodes
        if (node.section == NAVIGATOR or node.is_wild)
        and node.group is not None
        and PROGRESS_CHECKER in (node.group[PARAMETERS] or ())
    }


def _namespace(full: str) -> str:
    return full[: max(full.rfind("."), full.rfind("/")) + 1]


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
        if key.value != PARAMETERS:
            yield from parameter_groups(value, f"{prefix}{key.value}.")


def _migrate_node(
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
        _migrate_entry(work, full, nodes, entry)
    if MONITOR in nodes:
        migrate_monitor(work, full, group)
    if SMOOTHER_SERVER in nodes:
        migrate_smoothers(work, full, group)
    moved = lyrical_migration.move_path_handling(work, full, group, controllers)
    for controller in controllers.values():
        migrate_controller(work, controller, inflation, moved)
    lyrical_migration.migrate_forms(work, controllers)
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


def _migrate_entry(work: Work, full: str, nodes: Nodes, entry: Entry) -> None:
    """Migrate one parameter by the rules for its node, or for the nodes of a section for several nodes."""
    if "bt_navigator" in nodes and entry.name == entry.value.value == OLD_TREE:
        default = f"without a file, {work.target.capitalize()} takes its default tree"
        work.take_out(full, entry, f"a word that an older launch file replaces by a file; {default}")
        return
    for rename in RENAMES[work.target]:
        applies = work.source in rename.sources and _is_for(rename.node, nodes)
        if applies and fnmatchcase(entry.name, rename.old):
            refuse_shared_name(full, rename.node, entry)
            _rename(work, full, entry, rename)
            return
    if _is_unknown(work, full, nodes, entry):
        work.take_out(full, entry, f"{work.target.capitalize()} has no such parameter")
        return
    if entry.name == TREE_PLUGINS and work.target != "humble":
        _trim_tree_plugins(work, full, entry)
    if not RESPELT.isdisjoint(nodes) and entry.name.endswith(".plugin"):
        _respell(work, full, entry)
    if work.target != "lyrical" and known_class(entry.value.value, LEGACY_LAYERS):
        new = COSTMAP_LAYERS["inflation_layer"].names[work.target]
        work.edits.replace(entry, as_yaml(new))
        work.say(f"{full}.{entry.name}", entry.line, f"written {new}, which finds the same distances")


def _is_unknown(work: Work, full: str, nodes: Nodes, entry: Entry) -> bool:
    """Whether a key means nothing in the target."""
    siblings = {key.value for key, _ in entry.group.value}
    if "behavior_server" in nodes and OVERTAKEN.get(work.target, {}).get(entry.name) in siblings:
        refuse_shared_name(full, "behavior_server", entry)
        return True
    lyricals = LYRICALS if work.leaves("lyrical") else {}
    of_nodes = [*UNKNOWN[work.target].items(), *lyricals.items()]
    patterns = [pattern for name, patterns in of_nodes if _is_for(name, nodes) for pattern in patterns]
    return any(fnmatchcase(entry.name, pattern) for pattern in patterns)


def _is_for(pattern: str, nodes: Nodes) -> bool:
    """Whether a rule is for one of the nodes; a rule for every node is for those of Nav2."""
    return any(is_of_nav2(node) if pattern == "*" else fnmatchcase(node, pattern) for node in nodes)


def _trim_tree_plugins(work: Work, full: str, entry: Entry) -> None:
    """Leave only third parties' plugins of the behaviour tree; since Jazzy, Nav2 loads its own by itself."""
    others = [name for name in listed(entry) if not name.startswith("nav2_")]
    if others:
        work.edits.replace(entry, as_yaml(others))
    else:
        work.edits.remove(entry)
    target = work.target.capitalize()
    work.say(f"{full}.{entry.name}", entry.line, f"Nav2's own plugins taken out: {target} loads them by itself")


def _rename(work: Work, full: str, entry: Entry, rename: Rename) -> None:
    """Give a parameter its new name, and its value the new form, unless the new name is given as well."""
    goes = OVERTAKEN.get(work.target, {}).get(rename.new) == entry.name
    if not goes and any(key.value == rename.new for key, _ in entry.group.value):
        return
    if rename.listed is False and isinstance(entry.value, yaml.SequenceNode) and not entry.value.value:
        target = work.target.capitalize()
        work.take_out(full, entry, f"{target} always has one; without the key, it takes its default")
        return
    head = entry.key.value.rpartition(".")[0]
    work.edits.rename(entry.key, f"{head}.{rename.new}" if head else rename.new)
    work.say(full + "." + entry.name, entry.line, f"renamed to {rename.new}")
    _reform(work, full, entry, rename)


def _reform(work: Work, full: str, entry: Entry, rename: Rename) -> None:
    """Give the value of a renamed parameter the new form."""
    before, after = rename.ending
    if rename.listed is True and isinstance(entry.value, yaml.ScalarNode):
        work.edits.replace(entry, f"[{as_yaml(entry.value.value)}]")
    elif rename.listed is False and isinstance(entry.value, yaml.SequenceNode):
        names = listed(entry)
        chosen = _chosen(work, f"{full}.{entry.name}", names)
        work.edits.replace(entry, as_yaml(chosen))
        for other in names:
            if other != chosen:
                work.lose(full, entry, f"{work.target.capitalize()} has one, {chosen}; {other} does not count")
    elif before != after and isinstance(entry.value, yaml.SequenceNode):
        work.edits.replace(entry, as_yaml([name.removesuffix(before) + after for name in listed(entry)]))


def _chosen(work: Work, full: str, names: Sequence[str]) -> str:
    """Return the plugin of a list that the tree names, or else the only one.

    Raises:
        ConfigError: If the tree names none of several, or one that the list does not have.
    """
    name = work.named_by_trees.get(_namespace(full.rpartition(".")[0]), "")
    if name and name not in names:
        raise ConfigError(f"{full}: expected {name!r} among them, as {NAVIGATOR}.{PROGRESS_CHECKER} says, got {names}")
    if not name and len(names) > 1:
        raise ConfigError(
            f"{full}: {work.target.capitalize()} has one progress checker, got {', '.join(names)}; name the one of "
            f"your tree with {NAVIGATOR}.{PROGRESS_CHECKER}"
        )
    return name or names[0]


def _respell(work: Work, full: str, entry: Entry) -> None:
    """Write the class of a plugin as the release wants it."""
    old = str(entry.value.value)
    package, _, name = old.replace("::", "/").partition("/")
    separator = "/" if work.target == "humble" else "::"
    new = package.replace("nav2_recoveries", "nav2_behaviors") + separator + name.replace("/", "::")
    if old.startswith(RESPELT_PACKAGES if is_wildcard(full) else "nav2_") and name and new != old:
        work.edits.replace(entry, as_yaml(new))
        work.say(f"{full}.{entry.name}", entry.line, f"written {new}")


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


def _inflation_layer(nodes: list[Node]) -> dict[str, Any]:
    """Return what Humble's ObstaclesCritic has to be told about the local costmap's inflation layer."""
    for node in nodes:
        if node.name == "local_costmap" and node.group is not None and isinstance(node.group[PARAMETERS], Mapping):
            layer = node.group[PARAMETERS].get("inflation_layer")
            layer = layer if isinstance(layer, Mapping) else {}
            names = ("cost_scaling_factor", "inflation_radius")
            return {f"ObstaclesCritic.{name}": layer[name] for name in names if name in layer}
    return {}
