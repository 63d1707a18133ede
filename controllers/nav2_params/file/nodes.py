"""Finds the nodes of a parameter file and the section that each is, whatever the release and the namespace."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from controllers.nav2_params.file import keys
from controllers.nav2_params.file.document import PARAMETERS
from controllers.nav2_params.file.older import OLD_NODES, modernised
from gym_mapbench.costmap import COSTMAPS, FILTER_SERVERS
from gym_mapbench.errors import ConfigError, nearest_name
from gym_mapbench.ros_params import Findings, Keys, Section

SECTIONS = (
    "controller_server",
    "planner_server",
    *COSTMAPS,
    "behavior_server",
    "bt_navigator",
    "smoother_server",
    "velocity_smoother",
    "collision_monitor",
)
FOR_NO_NODE = "no section that is read has such a name; write the parameters under the nodes that they are for"
MISSPELT_NODE = 0.85
"""Similarity from which on an unknown node is probably a misspelt one that is read."""
MISSPELT_GROUP = 0.85
"""Similarity from which on a key of a node is probably the misspelt group of its parameters."""


class Node(NamedTuple):
    """A node of the file.

    Args:
        path: Its keys, namespaces included.
        group: The mapping under it; None if it has no parameters.
    """

    path: tuple[str, ...]
    group: Mapping[Any, Any] | None

    @property
    def full(self) -> str:
        """Full dotted name."""
        return ".".join(self.path)

    @property
    def name(self) -> str:
        """Name without namespaces."""
        return self.path[-1].rsplit("/", 1)[-1]

    @property
    def section(self) -> str:
        """Name of the section that the node is, in today's spelling."""
        return OLD_NODES.get(self.name, self.name)

    @property
    def is_in_place(self) -> bool:
        """Whether ROS gives the parameters to the node; that of a costmap is in a namespace of its own name."""
        names = [name for key in self.path for name in key.split("/") if name]
        return self.name not in COSTMAPS or names[-2:] == [self.name] * 2 or self.is_wild

    @property
    def is_wild(self) -> bool:
        """Whether the section is for several nodes."""
        return any(map(is_wildcard, self.path))

    @property
    def rank(self) -> tuple[bool, bool, bool, int]:
        """Order among nodes of one section: today's name first, a costmap in its own namespace, then few namespaces."""
        return self.group is None, self.name in OLD_NODES or not self.is_in_place, self.is_wild, len(self.path)


def all_nodes(document: object) -> list[Node]:
    """Return every node of a document, in the document's order.

    Raises:
        ConfigError: If the document is not a parameter file, or a section that is read has keys and no parameters.
    """
    if document is None:
        raise ConfigError("expected the nodes of a nav2_params.yaml, but the file is empty")
    if not isinstance(document, Mapping):
        raise ConfigError(f"expected the nodes of a nav2_params.yaml, got {type(document).__name__}")
    nodes = [Node(*found) for found in _walk(document, ())]
    _refuse_bare(nodes)
    return nodes


def _refuse_bare(nodes: list[Node]) -> None:
    """Refuse a section that is read and has keys without the group of parameters, which ROS cannot read."""
    given = {node.section for node in nodes if node.group is not None}
    for path in (node.path for node in nodes if node.group is None):
        for length, key in enumerate(path[1:], 1):
            around = Node(path[:length], None)
            if around.section in SECTIONS and around.section not in given and key != around.name:
                got = f", got {key!r}" if nearest_name(key.lower(), [PARAMETERS], MISSPELT_GROUP) else ""
                raise ConfigError(f"{around.full}: expected a group {PARAMETERS!r} in it, as in ROS{got}")


def namespace_of(full: str) -> str:
    """Return the namespaces in front of the full name of a node, with the last separator."""
    return full[: max(full.rfind("."), full.rfind("/")) + 1]


def is_wildcard(name: str) -> bool:
    """Whether a name stands for several nodes."""
    return "*" in name


def is_of_nav2(name: str) -> bool:
    """Whether a node is one of Nav2's, or a wildcard that stands for these as well."""
    return OLD_NODES.get(name, name) in SECTIONS or _is_beside_driving(name) or is_wildcard(name)


def _is_beside_driving(name: str) -> bool:
    """Whether a node is one of Nav2's that has no part in driving itself."""
    return name in keys.ROS_ONLY_NODES or name.endswith((*keys.INNER_NODES, *FILTER_SERVERS))


def find_sections(nodes: list[Node], findings: Findings) -> dict[str, Section]:
    """Open the sections that are read; all other nodes become findings.

    Raises:
        ConfigError: If the file has none of these sections, or one has no parameters, or its name is misspelt.
    """
    nodes = [node for node in nodes if not _is_outdated(node, findings)]
    chosen = {name: choose_node(name, nodes) for name in SECTIONS}
    sections = {}
    for node in nodes:
        if node.section not in SECTIONS:
            _leave(node, findings, {name for name in SECTIONS if chosen[name] is None})
        elif (other := chosen[node.section]) is not None and node is not other:
            _leave_second(node, other, findings)
        else:
            sections[node.section] = _open(node, findings)
    if not sections:
        raise ConfigError(f"expected a section of at least one of {', '.join(SECTIONS)}, found none")
    return sections


def _is_outdated(node: Node, findings: Findings) -> bool:
    """Whether only releases before Humble have a node, whose files are read as Humble's; it becomes a finding."""
    outdated = node.name in OLD_NODES and findings.release != "humble"
    if outdated:
        why = f"a node of older releases; Nav2 {findings.release.capitalize()} has {node.section}"
        findings.add("other_release", node.full, why)
    return outdated


def choose_node(name: str, nodes: list[Node]) -> Node | None:
    """Return the node that is read as a section; None if there is none."""
    return min((node for node in nodes if node.section == name), key=lambda node: node.rank, default=None)


def _open(node: Node, findings: Findings) -> Section:
    """Open a section, with its names in today's spelling."""
    if node.group is None:
        raise ConfigError(f"{node.full}: expected a group {PARAMETERS!r} in it, as in ROS")
    if not node.is_in_place:
        findings.add(
            "misplaced", node.full, f"expected under {node.full}.{node.name}, the costmap's namespace and name"
        )
    if node.name in OLD_NODES:
        findings.add("renamed", node.full, node.section)
    section = Section(node.full, node.group[PARAMETERS], findings, written=node.section)
    section.values = modernised(node.name, section.values, node.full, findings)
    return section


def _leave(node: Node, findings: Findings, missing: set[str]) -> None:
    """List a node that is not read; refuse it if it looks like a misspelt section that is missing."""
    known = _is_beside_driving(node.name) or any(part in node.name for part in keys.LOCALISATION)
    near = None if known else nearest_name(node.name, missing, MISSPELT_NODE)
    if near:
        raise ConfigError(f"{node.full}: unknown section; did you mean {near!r}?")
    if known or _serves_ros(node.group):
        findings.add("ros_only", node.full)
    else:
        findings.add("left_out", node.full, FOR_NO_NODE if is_wildcard(node.name) else "")


def _leave_second(node: Node, other: Node, findings: Findings) -> None:
    """List a section that is there once more; in another namespace it is that of another robot."""
    if node.path[:-1] == other.path[:-1] or node.group is None or not node.is_in_place:
        findings.add("unused", node.full, f"a second section for {node.section}")
    else:
        findings.add("left_out", node.full, f"a second section for {node.section}; {other.full} counts")


def _serves_ros(group: Mapping[Any, Any] | None) -> bool:
    """Whether a node has only parameters that serve ROS alone."""
    parameters = None if group is None else group[PARAMETERS]
    return isinstance(parameters, Mapping) and all(Keys().is_ros_only(str(key)) for key in parameters)


def _walk(
    group: Mapping[Any, Any], path: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], Mapping[Any, Any] | None]]:
    """Yield every node with its path, namespaces included; a key that is not a node comes with None.

    A node may be a namespace as well: ROS gives the parameters of both.
    """
    for key, value in group.items():
        here = (*path, str(key))
        if isinstance(value, Mapping) and PARAMETERS in value:
            yield here, value
            yield from _walk({inner: beside for inner, beside in value.items() if inner != PARAMETERS}, here)
        elif isinstance(value, Mapping) and any(isinstance(inner, Mapping) for inner in value.values()):
            yield from _walk(value, here)
        else:
            yield here, None
