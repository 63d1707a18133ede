"""Sections for several nodes, such as ``/**``: their parameters count for every node whose name matches.

As in ROS since Humble, ``*`` stands for one part of a node's name and ``**`` for any number of parts, and of two values
the later one in the file counts, whichever section is more specific (rclcpp, ``parameter_map_from``). A node needs no
section of its own: it is made where a section for several nodes gives a parameter by which the node is known.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import takewhile
from typing import Any, NamedTuple

from controllers.nav2_params.file.document import PARAMETERS, written_name
from controllers.nav2_params.file.nodes import SECTIONS, Node, choose_node
from controllers.nav2_params.file.tree import TREE_FILES
from controllers.nav2_params.file.tree_ids import PORTS
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import Finding, Kind, leaves, nest_dotted, overlay

UNREAD: tuple[Kind, ...] = ("unknown", "unused", "other_release", "ros_only", "detail")
"""Kinds of findings about a parameter that a section does not read; another section may read it."""
PATTERNS = {"*": r"/\w+", "**": r"(/\w+)*"}
"""What a part of a section's name with a wildcard stands for."""
_OF_COSTMAPS = frozenset(
    {
        "footprint",
        "inflation_layer",
        "obstacle_layer",
        "plugins",
        "robot_radius",
        "rolling_window",
        "static_layer",
        "voxel_layer",
    }
)
TELLING: Mapping[str, frozenset[str]] = {
    "controller_server": frozenset(
        {
            "FollowPath",
            "controller_frequency",
            "controller_plugins",
            "failure_tolerance",
            "goal_checker_plugins",
            "path_handler_plugins",
            "progress_checker_plugin",
            "progress_checker_plugins",
        }
    ),
    "planner_server": frozenset({"GridBased", "expected_planner_frequency", "planner_plugins"}),
    **dict.fromkeys(COSTMAPS, _OF_COSTMAPS),
    "behavior_server": frozenset({"behavior_plugins", "cycle_frequency", "simulate_ahead_time"}),
    "bt_navigator": frozenset(
        {
            *TREE_FILES,
            *PORTS,
            "bt_loop_duration",
            "default_bt_xml_filename",
            "error_code_name_prefixes",
            "error_code_names",
            "navigators",
            "plugin_lib_names",
        }
    ),
    "smoother_server": frozenset({"smoother_plugins"}),
    "velocity_smoother": frozenset({"max_accel", "max_velocity", "smoothing_frequency"}),
    "collision_monitor": frozenset({"cmd_vel_in_topic", "polygons"}),
}
"""Section -> parameters and groups that its node has and no node of another kind."""


class Shared(NamedTuple):
    """The nodes of a file with the parameters of all sections that match their names.

    Args:
        nodes: The nodes; a section for several nodes is left only if it matches none that is read.
        origins: Full name of each parameter of a node that has parameters of such a section -> its name in the file.
        made: Those of the nodes that have no section of their own.
    """

    nodes: list[Node]
    origins: dict[str, str]
    made: list[Node]

    def told(self, found: Iterable[Finding], read: Iterable[str]) -> list[Finding]:
        """Return findings under the names in the file, without those on parameters that another section reads.

        Args:
            found: The findings.
            read: Full names of the sections that are read.
        """
        prefixes = tuple(f"{name}." for name in read)
        origins = {name: origin for name, origin in self.origins.items() if name.startswith(prefixes)}
        covered = [(finding, _covered(finding.name, origins)) for finding in found]
        unread = {name for finding, names in covered if finding.kind in UNREAD for name in names}
        taken = {origin for name, origin in origins.items() if name not in unread}
        told: dict[tuple[str, bool], Finding] = {}
        for number, (finding, names) in enumerate(covered):
            name = written_name(finding.name, origins)
            if name == finding.name:
                told[str(number), False] = finding
            elif finding.kind not in UNREAD or not any(origins[one] in taken for one in names):
                key, named = (name, finding.kind in UNREAD), replace(finding, name=name)
                told[key] = min(told.get(key, named), named, key=_vagueness)
        return list(told.values())


def share(nodes: list[Node]) -> Shared:
    """Give the parameters of sections for several nodes to the nodes that are read.

    Raises:
        ConfigError: If such a section, or a node that it matches, gives a parameter twice.
    """
    made = list(_made(nodes))
    nodes = [*nodes, *made]
    wild = [node for node in nodes if node.is_wild and node.group is not None]
    own = [node for node in nodes if node.section in SECTIONS and node.group is not None and node not in wild]
    for node in wild:
        if node.section in SECTIONS and not any(
            _matches(node, other) for other in own if other.section == node.section
        ):
            own.append(node)
    origins: dict[str, str] = {}
    given = {node.path: _with_shared(node, nodes, wild, origins) for node in own}
    spent = [node.path for node in wild if node not in own and any(_matches(node, other) for other in own)]
    left = [given.get(node.path, node) for node in nodes if node.path not in spent]
    return Shared(left, origins, [given[node.path] for node in made])


def giving_sections(nodes: list[Node], section: str) -> dict[str, bool]:
    """Return the full names of the sections that give the parameters of a node that is read, in the file's order.

    Args:
        nodes: The nodes of the file.
        section: The section that the node is.

    Returns:
        Full name -> whether the section serves no other costmap as well, which matters for costmaps alone.
    """
    read = share(nodes).nodes
    chosen, *others = [choose_node(name, read) for name in (section, *(name for name in COSTMAPS if name != section))]
    if chosen is None or chosen.group is None:
        return {}
    rivals = [other for other in others if other is not None and section in COSTMAPS]
    serving = [node for node in nodes if node.group is not None and _gives(node, chosen)]
    return {node.full: not any(_gives(node, rival) for rival in rivals) for node in serving}


def _gives(node: Node, read: Node) -> bool:
    """Whether ROS gives the parameters of a section to a node."""
    return node.path == read.path or (node.is_wild and _matches(node, read))


def _made(nodes: list[Node]) -> Iterator[Node]:
    """Yield an empty node for each section that the file lacks, and that a section for several nodes is known to serve.

    The node is in the longest namespace that such a section names, so that all sections that match the node count.
    """
    given = {node.section for node in nodes}
    wild = [(node, _parameters(node).keys()) for node in nodes if node.is_wild and node.group is not None]
    for section in [name for name in TELLING if wild and name not in given]:
        places = [place for node, keys in wild if section in told_sections(keys) for place in _places(node, section)]
        if places:
            yield max(places, key=lambda place: len(place.path))


def told_sections(keys: Iterable[str]) -> tuple[str, ...]:
    """Return the sections that these parameters and groups of a section for several nodes are for."""
    given = set(keys)
    return tuple(section for section, telling in TELLING.items() if given & telling)


def _places(wild: Node, section: str) -> Iterator[Node]:
    """Yield the node of a section, without parameters, in the namespace of a section for several nodes."""
    space = tuple(takewhile(lambda part: "*" not in part, _parts(wild)))
    is_of_costmap = bool(space) and space[-1] in COSTMAPS
    doubled = section in COSTMAPS and not is_of_costmap
    node = Node((*space, section, section) if doubled else (*space, section), {PARAMETERS: {}})
    if _matches(wild, node) and not (is_of_costmap and space[-1] != section):
        yield node


def _with_shared(node: Node, nodes: list[Node], wild: list[Node], origins: dict[str, str]) -> Node:
    """Return a node with the parameters of all sections that match it, and note where each of them is."""
    giving = [other for other in nodes if other is node or (other in wild and _matches(other, node))]
    if len(giving) == 1 or node.group is None:
        return node
    values: dict[str, Any] = {}
    for other in giving:
        parameters = _parameters(other)
        values = overlay(values, parameters)
        origins |= {f"{node.full}.{key}": f"{other.full}.{key}" for key, _ in leaves(parameters)}
    return node._replace(group={**node.group, PARAMETERS: values})


def _parameters(node: Node) -> dict[str, Any]:
    """Return the parameters of a node, nested."""
    values = None if node.group is None else node.group[PARAMETERS]
    if values is not None and not isinstance(values, Mapping):
        raise ConfigError(f"{node.full}: expected a group of parameters, got {type(values).__name__}")
    try:
        return nest_dotted(values or {})
    except ConfigError as error:
        raise ConfigError(f"{node.full}.{error}") from None


def _parts(node: Node) -> list[str]:
    return [part for key in node.path for part in key.split("/") if part]


def _matches(wild: Node, node: Node) -> bool:
    """Whether a section is for a node; one for any node of a name stands for the node without a namespace."""
    names = [part for part in _parts(node) if "*" not in part]
    if node.section in COSTMAPS and names[-2:] != [node.name] * 2:
        names.append(node.name)
    pattern = "".join(PATTERNS.get(part, re.escape(f"/{part}")) for part in _parts(wild))
    return re.fullmatch(pattern, "".join(f"/{name}" for name in names)) is not None


def _covered(name: str, origins: Mapping[str, str]) -> list[str]:
    """Return the parameters that a finding is about: one, or all of a group."""
    return [one for one in origins if one == name or one.startswith(f"{name}.")]


def _vagueness(finding: Finding) -> tuple[bool, bool]:
    """Order findings of several sections on one parameter: known elsewhere before unknown, with a reason first."""
    return finding.kind in ("unknown", "unused"), not finding.why
