"""Migrates one parameter by the rules for its node."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase

import yaml

from controllers.nav2_params.file.nodes import is_of_nav2, is_wildcard, namespace_of
from controllers.nav2_params.file.tree import NAVIGATOR, TREE_PLUGINS
from controllers.nav2_params.file.tree_ids import PROGRESS_CHECKER
from controllers.nav2_params.file.yaml_edits import Entry, as_yaml
from controllers.nav2_params.migration.rules import (
    LYRICALS,
    OLD_TREE,
    OVERTAKEN,
    RENAMES,
    RESPELT,
    RESPELT_PACKAGES,
    UNKNOWN,
    Rename,
)
from controllers.nav2_params.migration.wildcards import Nodes, refuse_shared_name
from controllers.nav2_params.migration.work import Work, listed
from controllers.nav2_params.plugins import COSTMAP_LAYERS
from controllers.nav2_params.sections.costmaps import LEGACY_LAYERS
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import known_class


def migrate_entry(work: Work, full: str, nodes: Nodes, entry: Entry) -> None:
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
    name = work.named_by_trees.get(namespace_of(full.rpartition(".")[0]), "")
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
