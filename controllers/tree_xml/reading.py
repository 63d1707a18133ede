"""Reading of a behaviour tree: subtrees are put in place, and every port has its value."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from controllers.releases import RELEASES, Release
from controllers.tree_xml.nodes import (
    NEWER_PORTS,
    NODES,
    SELECTORS,
    WITHOUT_EFFECT,
    Above,
    Name,
    Number,
    Port,
    Switch,
    Times,
    TreeNode,
    Variable,
)
from gym_mapbench.errors import ConfigError, unknown_name

COMPACT = ("Action", "Condition", "Control", "Decorator")
"""Elements that name their node by ``ID``."""
SUBTREES = ("SubTree", "SubTreePlus")
SHARED = ("__shared_blackboard", "__autoremap", "_autoremap")
"""Attributes by which all variables of a subtree are those of the tree around it."""
SWITCHES = {"true": True, "1": True, "false": False, "0": False}
GOAL = "goal"
SMOOTH = "SmoothPath"
SMOOTHER = "smoother_id"
"""The port with which each leaf may name another smoother; the other ports name one plugin in the whole tree."""
WRITTEN_PATHS = {"ComputePathToPose": "path", "TruncatePathLocal": "output_path", SMOOTH: "smoothed_path"}
WRITTEN_CODES = ("ComputePathToPose", "FollowPath", SMOOTH)
DEEPEST, MOST_NODES = 100, 10_000
"""Largest depth and largest number of nodes of a tree, with those of its subtrees at each place."""
CLEAR = "ClearEntireCostmap"
COSTMAPS = ("local_costmap", "global_costmap")


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
    root = _parse(xml)
    trees = {tree.get("ID", ""): tree for tree in root.findall("BehaviorTree")}
    if len(trees) < len(root.findall("BehaviorTree")):
        raise ConfigError(f"BehaviorTree: expected a different ID for each, got {sorted(trees)}")
    main = root.get("main_tree_to_execute")
    if main is None and len(trees) > 1:
        raise ConfigError(f"main_tree_to_execute: expected one of {sorted(trees)}, got none")
    tree = _Reader(trees, release).tree(next(iter(trees)) if main is None else main, _Scope())
    _check_variables(tree)
    _check_values(tree)
    return tree


def plugin_names(tree: TreeNode) -> dict[str, str]:
    """Return, by port such as ``planner_id``, the plugins that a tree names; a plugin comes once for all leaves.

    Raises:
        ConfigError: If two leaves name two plugins by the same port: here one plans, one follows, one checks.
    """
    selected = selected_plugins(tree)
    found: dict[str, str] = {}
    for node in tree.walk():
        for port, value in node.ports.items():
            if port == SMOOTHER or not port.endswith("_id") or not isinstance(NODES[node.name].ports[port], Name):
                continue
            name = name_in(value, selected)
            if name and found.setdefault(port, name) != name:
                raise ConfigError(f"{port}: expected one in the whole tree, got {found[port]!r} and {name!r}")
    return found


def selected_plugins(tree: TreeNode) -> dict[str, str]:
    """Return the plugins that selectors put into variables, by the variable as a port gives it: ``{name}``."""
    return {
        f"{{{node.ports[f'selected_{of}']}}}": node.ports[f"default_{of}"]
        for node in tree.walk()
        if (of := SELECTORS.get(node.name))
    }


def name_in(value: str, selected: Mapping[str, str]) -> str:
    """Return the plugin that a port's value names, itself or by a variable of a selector; empty if it names none."""
    return selected.get(value, "" if value.startswith("{") else value)


def smooths_paths(tree: TreeNode) -> bool:
    """Whether a tree asks for a path smoother."""
    return any(node.name == SMOOTH for node in tree.walk())


def named_smoothers(tree: TreeNode) -> list[str]:
    """Return the smoothers for which the leaves of a tree ask, each once; an empty name stands for the only one."""
    selected = selected_plugins(tree)
    asked = [node.ports[SMOOTHER] for node in tree.walk() if node.name == SMOOTH]
    return list(dict.fromkeys(name_in(value, selected) for value in asked))


def cleared_costmap(ports: Mapping[str, Any]) -> str:
    """Return which costmap a ``ClearEntireCostmap`` with these ports clears, ``local`` or ``global``."""
    return "local" if COSTMAPS[0] in ports["service_name"] else "global"


def named_layers(ports: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the layers that a ``ClearEntireCostmap`` with these ports names; none for all."""
    return tuple(filter(None, ports["plugins"].split(";")))


def cleared_layers(tree: TreeNode, which: str) -> tuple[str, ...]:
    """Return the layers that all clears of the costmap ``local`` or ``global`` name."""
    clears = (node.ports for node in tree.walk() if node.name == CLEAR)
    return tuple(name for ports in clears if cleared_costmap(ports) == which for name in named_layers(ports))


def _parse(xml: str) -> Element:
    try:
        root: Element = fromstring(xml, forbid_dtd=True)
    except DefusedXmlException as error:
        raise ConfigError(f"expected plain XML without entities ({type(error).__name__})") from None
    except (ParseError, ValueError) as error:
        raise ConfigError(f"not an XML file ({error})") from None
    if root.tag != "root" or root.find("BehaviorTree") is None:
        raise ConfigError(f"expected <root> with a <BehaviorTree> in it, got <{root.tag}>")
    return root


@dataclass(frozen=True)
class _Scope:
    """The variables of a subtree.

    Args:
        prefix: Stands before the names of its own variables, which the tree around it does not see.
        given: Its variables that are variables of the tree around it, by their names inside.
        around: The trees around it, by ID.
    """

    prefix: str = ""
    given: Mapping[str, str] = field(default_factory=dict)
    around: tuple[str, ...] = ()

    def variable(self, name: str) -> str:
        """Return the name of a variable in the whole tree."""
        return self.given.get(name, f"{self.prefix}{name}")

    def inside(self, number: int, element: Element) -> _Scope:
        """Return the scope of a subtree."""
        name = element.get("ID", "")
        given = {
            key: self.variable(value.strip("{}") if value != "{=}" else key)
            for key, value in element.items()
            if key not in (*SHARED, *WITHOUT_EFFECT)
        }
        shares = any(SWITCHES.get(element.get(key, "").lower(), False) for key in SHARED)
        prefix = self.prefix if shares else f"{self.prefix}{name}.{number}."
        return _Scope(prefix, {**(self.given if shares else {}), **given}, (*self.around, name))


class _Reader:
    """Reads the trees of one file."""

    def __init__(self, trees: Mapping[str, Element], release: Release) -> None:
        self._trees, self._release = trees, release
        self._subtrees = self._nodes = self._depth = 0

    def tree(self, name: str, scope: _Scope) -> TreeNode:
        """Read the tree of an ID."""
        if name not in self._trees:
            raise unknown_name("tree", name, self._trees)
        inside = list(self._trees[name])
        if len(inside) != 1:
            raise ConfigError(f"BehaviorTree {name}: expected one node in it, got {len(inside)}")
        return self._node(inside[0], scope)

    def _node(self, element: Element, scope: _Scope) -> TreeNode:
        self._depth += 1
        self._nodes += 1
        if self._depth > DEEPEST or self._nodes > MOST_NODES:
            raise ConfigError(f"expected at most {MOST_NODES} nodes, {DEEPEST} deep, got more")
        name = element.get("ID", "") if element.tag in COMPACT else element.tag
        node = self._subtree(element, scope) if name in SUBTREES else self._known_node(name, element, scope)
        self._depth -= 1
        return node

    def _known_node(self, name: str, element: Element, scope: _Scope) -> TreeNode:
        known = [other for other, node_type in NODES.items() if self._release in node_type.releases]
        if name not in known:
            raise unknown_name("node", name, known)
        node_type = NODES[name]
        children = tuple(self._node(child, scope) for child in element)
        if len(children) != node_type.children and not (node_type.children < 0 and children):
            expected = "one or more" if node_type.children < 0 else node_type.children
            raise ConfigError(f"{name}: expected {expected} children, got {len(children)}")
        return TreeNode(name, _ports(name, element, scope, self._release), children)

    def _subtree(self, element: Element, scope: _Scope) -> TreeNode:
        name = element.get("ID", "")
        if name in scope.around:
            raise ConfigError(f"{element.tag} {name}: expected a tree without itself in it")
        self._subtrees += 1
        return self.tree(name, scope.inside(self._subtrees, element))


def _ports(name: str, element: Element, scope: _Scope, release: Release) -> dict[str, Any]:
    """Return the values of all ports of a node."""
    ports = NODES[name].ports
    given = {key: value for key, value in element.items() if key not in WITHOUT_EFFECT}
    known = {*ports, *(() if NODES[name].children else ("error_code_id",))}
    known = {key for key in known if release in NEWER_PORTS.get(key, RELEASES)}
    for key in given:
        if key not in known:
            raise ConfigError(f"{name}: {unknown_name('port', key, known)}")
    values = {}
    for key, port in ports.items():
        try:
            values[key] = _value(key, port, given.get(key), scope)
        except ConfigError as error:
            raise ConfigError(f"{name}.{key}: {error}") from None
    return values


def _value(key: str, port: Port, text: str | None, scope: _Scope) -> Any:
    """Return the value of a port: that of its text, or its default."""
    if isinstance(port, Variable):
        name = key if text == "{=}" else _variable(text)
        return scope.variable(name or port.default) if name or port.default else ""
    if isinstance(port, Times):
        return _times(text)
    if text is None:
        return port.default
    if isinstance(port, Name):
        return f"{{{scope.variable(_variable(text) or '')}}}" if text.startswith("{") else text
    if isinstance(port, Switch):
        if text.lower() not in SWITCHES:
            raise ConfigError(f"expected true or false, got {text!r}")
        return SWITCHES[text.lower()]
    return _number(port, text)


def _variable(text: str | None) -> str | None:
    """Return the name of a variable, None for none."""
    if text is None:
        return None
    if len(text) < 3 or text[0] != "{" or text[-1] != "}":
        raise ConfigError(f"expected a variable such as {{path}}, got {text!r}")
    return text[1:-1]


def _times(text: str | None) -> int:
    """Return a number of times, -1 for no end."""
    if text is None or not re.fullmatch(r"-1|\+?0*[1-9]\d{0,9}", text.strip()):
        raise ConfigError(f"expected a whole number above 0, or -1 for no end, got {text or 'none'}")
    return int(text)


def _number(port: Number | Above, text: str) -> float:
    """Return the number in a text, a whole one if the port's default is."""
    of = int if isinstance(port.default, int) else float
    try:
        value = of(text)
    except ValueError:
        raise ConfigError(f"expected a {'whole ' if of is int else ''}number, got {text!r}") from None
    if isinstance(port, Above) and not 0.0 < value < math.inf:
        raise ConfigError(f"expected a number above 0, got {text}")
    if isinstance(port, Number) and not (port.least <= value < math.inf or value == port.default):
        raise ConfigError(f"expected {port.least:g} or more, got {text}")
    return value


def _check_variables(tree: TreeNode) -> None:
    """Refuse variables that no node writes.

    Raises:
        ConfigError: Naming the port and the variable.
    """
    nodes = list(tree.walk())
    goals = {GOAL, *(node.ports["output_goal"] for node in nodes if node.name == "GoalUpdater")}
    paths = {node.ports[port] for node in nodes if (port := WRITTEN_PATHS.get(node.name))}
    codes = {node.ports["error_code_id"] for node in nodes if node.name in WRITTEN_CODES}
    known = {"goal": goals, "input_goal": goals, "error_code": codes - {""}}
    known |= dict.fromkeys(("path", "input_path", "unsmoothed_path"), paths - {""})
    for node in nodes:
        for port in known.keys() & node.ports.keys():
            if node.ports[port] not in known[port]:
                some = ", ".join(f"{{{name}}}" for name in sorted(known[port])) or "one that a node writes"
                got = f"{{{node.ports[port]}}}" if node.ports[port] else "none"
                raise ConfigError(f"{node.name}.{port}: expected {some}, got {got}")
    if not any(node.name == "FollowPath" for node in nodes):
        raise ConfigError("expected a node FollowPath, got none: nothing drives the robot")


def _check_values(tree: TreeNode) -> None:
    """Refuse values that Nav2 takes and then fails with.

    Raises:
        ConfigError: Naming the node.
    """
    for node in tree.walk():
        if node.name == CLEAR and not any(of in node.ports["service_name"] for of in COSTMAPS):
            expected = " or ".join(f"{of}/clear_entirely_{of}" for of in COSTMAPS)
            raise ConfigError(f"{node.name}.service_name: expected {expected}, got {node.ports['service_name']!r}")
        if node.name == "SpeedController":
            for of in ("rate", "speed"):
                if node.ports[f"min_{of}"] >= node.ports[f"max_{of}"]:
                    raise ConfigError(
                        f"{node.name}.min_{of}: expected less than max_{of}, got {node.ports[f'min_{of}']:g}"
                    )
