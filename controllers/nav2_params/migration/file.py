"""Migrates a parameter file: its nodes are found, and each is migrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from controllers.nav2_params.file.document import PARAMETERS, parameter_groups
from controllers.nav2_params.file.nodes import Node, all_nodes, namespace_of
from controllers.nav2_params.file.recognition import recognise
from controllers.nav2_params.file.signs import kilted_key
from controllers.nav2_params.file.tree import NAVIGATOR
from controllers.nav2_params.file.tree_ids import PROGRESS_CHECKER
from controllers.nav2_params.file.wildcards import giving_sections, share
from controllers.nav2_params.file.yaml_edits import Edits
from controllers.nav2_params.migration.nodes import migrate_node
from controllers.nav2_params.migration.wildcards import SERVER, split_controllers
from controllers.nav2_params.migration.work import Work
from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import parse_yaml, read_document_text
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import first_unreadable


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
        kilted = kilted_key([*nodes, *shared.made]) if source is None and known == "jazzy" else ""
        kilted = shared.origins.get(kilted, kilted)
        work = Work(Edits(text), known, target, bool(kilted), _named_by_trees(nodes))
        if kilted and target != "humble":
            work.tell(kilted, "a key of Kilted, which publishes TwistStamped by default")
        groups = [] if root is None else list(parameter_groups(root, ""))
        work.parts = split_controllers(groups, giving_sections(nodes, SERVER), work)
        for full, key, group in groups:
            migrate_node(work, full, key, group, _inflation_layer(shared.nodes))
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
        namespace_of(node.full): str(node.group[PARAMETERS][PROGRESS_CHECKER])
        for node in nodes
        if (node.section == NAVIGATOR or node.is_wild)
        and node.group is not None
        and PROGRESS_CHECKER in (node.group[PARAMETERS] or ())
    }


def _inflation_layer(nodes: list[Node]) -> dict[str, Any]:
    """Return what Humble's ObstaclesCritic has to be told about the local costmap's inflation layer."""
    for node in nodes:
        if node.name == "local_costmap" and node.group is not None and isinstance(node.group[PARAMETERS], Mapping):
            layer = node.group[PARAMETERS].get("inflation_layer")
            layer = layer if isinstance(layer, Mapping) else {}
            names = ("cost_scaling_factor", "inflation_radius")
            return {f"ObstaclesCritic.{name}": layer[name] for name in names if name in layer}
    return {}
