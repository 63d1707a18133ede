"""Checks of a whole tree: its variables are written, and its values are none with which Nav2 fails."""

from __future__ import annotations

from controllers.tree_xml.nodes import CLEARS, TreeNode
from gym_mapbench.costmap import COSTMAPS
from gym_mapbench.errors import ConfigError

GOAL = "goal"
WRITTEN_PATHS = {
    "ComputePathToPose": "path",
    "SmoothPath": "smoothed_path",
    "TruncatePath": "output_path",
    "TruncatePathLocal": "output_path",
}
WRITTEN_CODES = ("ComputePathToPose", "FollowPath", "SmoothPath")


def check_variables(tree: TreeNode) -> None:
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
        for port in [port for port in known if port in node.ports]:
            if node.ports[port] not in known[port]:
                some = ", ".join(f"{{{name}}}" for name in sorted(known[port])) or "one that a node writes"
                got = f"{{{node.ports[port]}}}" if node.ports[port] else "none"
                raise ConfigError(f"{node.label}.{port}: expected {some}, got {got}")
    if not any(node.name == "FollowPath" for node in nodes):
        raise ConfigError("expected a node FollowPath, got none: nothing drives the robot to the goal")


def check_values(tree: TreeNode) -> None:
    """Refuse values that Nav2 takes and then fails with.

    Raises:
        ConfigError: Naming the node.
    """
    for node in tree.walk():
        if node.name in CLEARS:
            _check_costmap(node)
        if node.name == "SpeedController":
            _check_speeds(node)
        if node.name == "Parallel":
            _check_counts(node)


def _check_costmap(node: TreeNode) -> None:
    if not any(of in node.ports["service_name"] for of in COSTMAPS):
        expected = " or ".join(f"{of}/{CLEARS[node.name]}_{of}" for of in COSTMAPS)
        raise ConfigError(f"{node.label}.service_name: expected {expected}, got {node.ports['service_name']!r}")


def _check_speeds(node: TreeNode) -> None:
    for of in ("rate", "speed"):
        if node.ports[f"min_{of}"] >= node.ports[f"max_{of}"]:
            raise ConfigError(f"{node.label}.min_{of}: expected less than max_{of}, got {node.ports[f'min_{of}']:g}")


def _check_counts(node: TreeNode) -> None:
    most = len(node.children)
    for port, count in node.ports.items():
        if not (1 <= count <= most or -most <= count <= -1):
            raise ConfigError(f"{node.label}.{port}: expected 1 to {most}, or -{most} to -1, got {count}")
