"""What a tree needs of Nav2's servers: plugins, behaviours and layers by name, and variables for error codes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from controllers.tree_xml.checks import WRITTEN_CODES
from controllers.tree_xml.nodes import BEHAVIOR_NODES, CANCELS, CLEARS, NODES, SELECTORS, Name, TreeNode
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.errors import ConfigError

SMOOTH = "SmoothPath"
SMOOTHER = "smoother_id"
"""The port with which each leaf may name another smoother; the other ports name one plugin in the whole tree."""


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


def written_codes(tree: TreeNode) -> list[str]:
    """Return the variables outside subtrees in which the leaves of a tree put their error codes, each once."""
    codes = (node.ports["error_code_id"] for node in tree.walk() if node.name in WRITTEN_CODES)
    return list(dict.fromkeys(code for code in codes if code and "." not in code))


def asked_behaviors(tree: TreeNode) -> tuple[str, ...]:
    """Return the behaviours whose action servers a tree asks for, without which it does not load."""
    nodes = {node.name for node in tree.walk()}
    asked = {kind for name, kind in (BEHAVIOR_NODES | CANCELS).items() if name in nodes}
    return tuple(kind for kind in BEHAVIOR_NODES.values() if kind in asked)


def cleared_costmap(ports: Mapping[str, Any]) -> str:
    """Return which costmap a clear with these ports clears, ``local`` or ``global``."""
    return "local" if COSTMAPS[0] in ports["service_name"] else "global"


def named_layers(ports: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the layers that a clear with these ports names; none for all."""
    return tuple(filter(None, ports["plugins"].split(";")))


def cleared_layers(tree: TreeNode, which: str) -> tuple[str, ...]:
    """Return the layers that all clears of the costmap ``local`` or ``global`` name."""
    clears = (node.ports for node in tree.walk() if node.name in CLEARS)
    return tuple(name for ports in clears if cleared_costmap(ports) == which for name in named_layers(ports))
