"""Reading of a behaviour tree: subtrees are put in place, and every port has its value."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any
from xml.etree.ElementTree import Element

from controllers.tree_xml.checks import check_values, check_variables
from controllers.tree_xml.includes import DEEPEST, parse_xml
from controllers.tree_xml.labels import TreeError, label_of, type_of
from controllers.tree_xml.nodes import NODES, PORT_RELEASES, WITHOUT_EFFECT, Name, Required, TreeNode
from controllers.tree_xml.scopes import Constants, Scope
from controllers.tree_xml.unbuilt import CONDITIONS, NO_SCRIPTS, UNBUILT
from controllers.tree_xml.values import value_of
from gym_mapbench.errors import ConfigError, nearest_name, unknown_name
from gym_mapbench.releases import RELEASES, Release

SUBTREES = ("SubTree", "SubTreePlus")
MOST_NODES = 10_000
"""Largest number of nodes of a tree, with those of its subtrees at each place; its depth is counted like that, too."""


@lru_cache(maxsize=64)
def read_tree(xml: str, release: Release) -> TreeNode:
    """Read the main tree of a file.

    Args:
        xml: The text of the file.
        release: The release of Nav2, which decides which nodes there are.

    Returns:
        The root, whose subtrees are in place.

    Raises:
        ConfigError: If it is not a behaviour tree, a node or a port is not built here, or a value is wrong.
    """
    root = parse_xml(xml)
    if root.find("BehaviorTree") is None:
        raise ConfigError("expected <root> with a <BehaviorTree> in it, got none")
    trees = {tree.get("ID", ""): tree for tree in root.findall("BehaviorTree")}
    if len(trees) < len(root.findall("BehaviorTree")):
        raise ConfigError(f"BehaviorTree: expected a different ID for each, got {sorted(trees)}")
    main = root.get("main_tree_to_execute")
    if main is None and len(trees) > 1:
        raise ConfigError(f"main_tree_to_execute: expected one of {sorted(trees)}, got none")
    reader = _Reader(trees, release)
    tree = reader.tree(next(iter(trees)) if main is None else main, Scope())
    reader.refuse_late_names(tree)
    check_variables(tree)
    check_values(tree)
    return tree


class _Reader:
    """Reads the trees of one file."""

    def __init__(self, trees: Mapping[str, Element], release: Release) -> None:
        self._trees, self._release = trees, release
        self._constants = Constants(release)
        self._subtrees = self._nodes = self._depth = 0

    def tree(self, name: str, scope: Scope) -> TreeNode:
        """Read the tree of an ID."""
        if name not in self._trees:
            raise unknown_name("tree", name, self._trees)
        inside = list(self._trees[name])
        if len(inside) != 1:
            raise TreeError(f"BehaviorTree {name}: expected one node in it, got {len(inside)}", name)
        try:
            return self._node(inside[0], scope)
        except TreeError:
            raise
        except ConfigError as error:
            raise TreeError(str(error), name) from None

    def refuse_late_names(self, tree: TreeNode) -> None:
        """Refuse names that change during the run, as a ``SetBlackboard`` behind their node sets them."""
        late = {f"{{{name}}}" for name in self._constants.assigned}
        for node in tree.walk():
            for port, value in node.ports.items():
                if isinstance(NODES[node.name].ports[port], Name) and value in late:
                    raise ConfigError(f"{node.label}.{port}: expected a name that does not change, got {value}")

    def _node(self, element: Element, scope: Scope) -> TreeNode:
        self._depth += 1
        self._nodes += 1
        if self._depth > DEEPEST or self._nodes > MOST_NODES:
            raise ConfigError(f"expected at most {MOST_NODES} nodes, {DEEPEST} deep, got more")
        name = type_of(element)
        self._refuse_scripts(element)
        node = self._subtree(element, scope) if name in SUBTREES else self._known_node(name, element, scope)
        self._depth -= 1
        return node

    def _refuse_scripts(self, element: Element) -> None:
        for key in [key for key in element.attrib if key in CONDITIONS and self._release != "humble"]:
            raise ConfigError(f"{label_of(element)}.{key}: {NO_SCRIPTS}")

    def _known_node(self, name: str, element: Element, scope: Scope) -> TreeNode:
        label = label_of(element)
        self._refuse_unbuilt(name, label)
        node_type = NODES[name]
        ports = self._ports(name, element, scope)
        children = tuple(self._node(child, scope) for child in element)
        if len(children) != node_type.children and not (node_type.children < 0 and children):
            expected = "one or more" if node_type.children < 0 else node_type.children
            raise ConfigError(f"{label}: expected {expected} children, got {len(children)}")
        return TreeNode(name, ports, children, label)

    def _refuse_unbuilt(self, name: str, label: str) -> None:
        """Refuse a node that is not built here, or that the release does not have."""
        known = [other for other, node_type in NODES.items() if self._release in node_type.releases]
        if name in UNBUILT:
            raise ConfigError(f"{label}: {UNBUILT[name]}")
        if name in NODES and name not in known:
            having = " and ".join(release.capitalize() for release in NODES[name].releases)
            raise ConfigError(f"{label}: a node of {having}, which {self._release.capitalize()} does not have")
        if name not in known:
            near = nearest_name(name, known)
            raise ConfigError(f"{label}: a node that is not built here" + (f"; did you mean {near!r}?" if near else ""))

    def _ports(self, name: str, element: Element, scope: Scope) -> dict[str, Any]:
        """Return the values of all ports of a node."""
        ports, label = NODES[name].ports, label_of(element)
        given = {key: value for key, value in element.items() if key not in WITHOUT_EFFECT}
        known = {*ports, *(() if NODES[name].children else ("error_code_id",))}
        known = {key for key in known if self._release in PORT_RELEASES.get(key, RELEASES)}
        for key in given:
            if key not in known:
                raise ConfigError(f"{label}: {unknown_name('port', key, known)}")
        values = {}
        for key, port in ports.items():
            if isinstance(port, Required) and key not in known:
                continue
            try:
                values[key] = value_of(key, port, given.get(key), scope, self._constants)
            except ConfigError as error:
                raise ConfigError(f"{label}.{key}: {error}") from None
        if name == "SetBlackboard":
            self._constants.assign(values["output_key"], values["value"])
        return values

    def _subtree(self, element: Element, scope: Scope) -> TreeNode:
        name = element.get("ID", "")
        if name in scope.around:
            raise ConfigError(f"{element.tag} {name}: expected a tree without itself in it")
        self._subtrees += 1
        return self.tree(name, scope.inside(self._subtrees, element, self._constants))
