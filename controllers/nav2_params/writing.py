"""NavigationParams become the content of a ``nav2_params.yaml`` that ROS 2 (Humble) takes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from controllers.nav2_params.navigation import NavigationParams, ProgressChecker
from controllers.nav2_params.plugins import (
    BEHAVIORS,
    CONTROLLERS,
    COSTMAP_LAYERS,
    GOAL_CHECKERS,
    PLANNERS,
    PROGRESS_CHECKERS,
)
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.robot import RobotSpec
from gym_mapbench.settings import Settings

BASE_FRAME = "base_link"
SCAN = {"topic": "/scan", "data_type": "LaserScan"}


def write_nav2_params(
    navigation: NavigationParams,
    *,
    robot: RobotSpec | None = None,
    follow_path: str | None = None,
    use_sim_time: bool = True,
) -> dict[str, Any]:
    """Return the content of a ``nav2_params.yaml``; every controller is a plugin under its own name.

    :func:`~controllers.nav2_params.parsing.parse_nav2_params` reads it back to the same parameters (with
    ``robot`` and ``follow_path`` left out).

    Args:
        navigation: The parameters.
        robot: Gives the shape to costmaps that leave it to the robot.
        follow_path: The controller that is to be called ``FollowPath``, which is the one Nav2's own tree asks for.
        use_sim_time: Whether the nodes take the simulator's clock.

    Raises:
        ConfigError: If ``follow_path`` is unknown, or the progress checker is ``none``.
    """
    nodes = {
        "controller_server": _controller_server(navigation, follow_path),
        "planner_server": _planner_server(navigation),
        "behavior_server": _behavior_server(navigation),
        "bt_navigator": {
            **_options(navigation.bt),
            "global_frame": "map",
            "robot_base_frame": BASE_FRAME,
            "odom_topic": "/odom",
        },
    }
    if navigation.velocity_smoother is not None:
        nodes["velocity_smoother"] = {**_options(navigation.velocity_smoother), "odom_topic": "odom"}
    costmaps = {
        "local_costmap": _costmap(navigation.local_costmap, "odom", robot),
        "global_costmap": _costmap(navigation.global_costmap, "map", robot),
    }
    document = {name: _node(values, use_sim_time) for name, values in nodes.items()}
    return document | {name: {name: _node(values, use_sim_time)} for name, values in costmaps.items()}


def _node(values: Mapping[str, Any], use_sim_time: bool) -> dict[str, Any]:
    return {"ros__parameters": {"use_sim_time": use_sim_time, **values}}


def _options(settings: Settings) -> dict[str, Any]:
    """Options as ROS takes them: lists for tuples, nothing for None."""
    return settings.model_dump(mode="json", exclude_none=True)


def _controller_server(navigation: NavigationParams, follow_path: str | None) -> dict[str, Any]:
    server = navigation.controller_server
    plugins = dict(navigation.controllers)
    if follow_path is not None:
        chosen = navigation.controller(follow_path)
        plugins = {"FollowPath" if plugin is chosen else name: plugin for name, plugin in plugins.items()}
    values = _options(server)
    del values["progress_checker"], values["goal_checker"]
    return {
        **values,
        "odom_topic": "/odom",
        "progress_checker_plugin": "progress_checker",
        "goal_checker_plugins": ["goal_checker"],
        "controller_plugins": list(plugins),
        "progress_checker": _progress_checker(server.progress_checker),
        "goal_checker": {**_options(server.goal_checker), "plugin": GOAL_CHECKERS[server.goal_checker.plugin]},
        **{name: {"plugin": CONTROLLERS[p.kind].ros_class, **_of_ros(p.params)} for name, p in plugins.items()},
    }


def _of_ros(params: Mapping[str, Any]) -> dict[str, Any]:
    """A plugin's parameters without the release, which no parameter says in ROS."""
    return {name: value for name, value in params.items() if name != "release"}


def _progress_checker(checker: ProgressChecker) -> dict[str, Any]:
    if checker.plugin not in PROGRESS_CHECKERS:
        raise ConfigError(f"progress_checker.plugin: expected one that ROS has, got {checker.plugin!r}")
    return {**_options(checker), "plugin": PROGRESS_CHECKERS[checker.plugin]}


def _planner_server(navigation: NavigationParams) -> dict[str, Any]:
    planner = navigation.planner
    plugin = {"plugin": PLANNERS[planner.name].ros_class, **_of_ros(planner.params)}
    return {"planner_plugins": ["GridBased"], "GridBased": plugin}


def _behavior_server(navigation: NavigationParams) -> dict[str, Any]:
    server = navigation.behavior_server
    return {
        **_options(server),
        "costmap_topic": "local_costmap/costmap_raw",
        "footprint_topic": "local_costmap/published_footprint",
        "global_frame": "odom",
        "robot_base_frame": BASE_FRAME,
        **{name: {"plugin": BEHAVIORS[name]} for name in server.behavior_plugins},
    }


def _costmap(params: CostmapParams, frame: str, robot: RobotSpec | None) -> dict[str, Any]:
    values = _options(params)
    del values["nav2"]
    layers = {name: values.pop(name) for name in COSTMAP_LAYERS}
    if robot is not None and params.footprint is None and params.robot_radius is None:
        values |= {"robot_radius": robot.radius} if robot.footprint is None else {"footprint": robot.footprint}
    if "footprint" in values:
        values["footprint"] = str([list(corner) for corner in values["footprint"]])
    plugins = {name: _layer(name, layers[name]) for name in params.plugins}
    return {"global_frame": frame, "robot_base_frame": BASE_FRAME, **values, **plugins}


def _layer(name: str, options: dict[str, Any]) -> dict[str, Any]:
    """One layer's group; the options of its lidar form a group of their own."""
    named = {"plugin": COSTMAP_LAYERS[name], **options}
    if "scan" not in options:
        return named
    return {**named, "observation_sources": "scan", "scan": {**SCAN, **options["scan"]}}
