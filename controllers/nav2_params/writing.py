"""Turns NavigationParams into the content of a ``nav2_params.yaml`` that their release of Nav2 reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from controllers.behaviors import DRIVE_ON_HEADING, BehaviorServer, default_limits
from controllers.checkers import GOAL_CHECKERS, PROGRESS_CHECKERS, ProgressChecker
from controllers.collision_monitor import CollisionMonitor
from controllers.nav2_params.file.keys import CODES, ENDING, PREFIXES
from controllers.nav2_params.filters_writing import filter_groups, filter_nodes
from controllers.nav2_params.navigation import ControllerServer, NavigationParams
from controllers.nav2_params.plugin_settings import PlannerPlugin
from controllers.nav2_params.plugins import BEHAVIORS, CONTROLLERS, COSTMAP_LAYERS, DRIVES, PLANNERS, SMOOTHERS
from controllers.nav2_params.sections.monitor import write_monitor
from controllers.path_handler import PATH_HANDLER_ID, PATH_HANDLERS
from controllers.tree_xml.needs import written_codes
from controllers.tree_xml.reading import read_tree
from gym_mapbench.costmap import FILTERS, CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.releases import Release
from gym_mapbench.ros_params import leaves, nest_dotted, overlay, written
from gym_mapbench.settings import Settings
from gym_mapbench.world.robot import RobotSpec

BASE_FRAME = "base_link"
COSTMAP_FRAMES = {"local_costmap": "odom", "global_costmap": "map"}
_FRAMES_SINCE_JAZZY = {
    "local_costmap_topic": "local_costmap/costmap_raw",
    "global_costmap_topic": "global_costmap/costmap_raw",
    "local_footprint_topic": "local_costmap/published_footprint",
    "global_footprint_topic": "global_costmap/published_footprint",
    "local_frame": "odom",
    "global_frame": "map",
}
BEHAVIOR_FRAMES: Mapping[Release, Mapping[str, str]] = {
    "humble": {
        "costmap_topic": "local_costmap/costmap_raw",
        "footprint_topic": "local_costmap/published_footprint",
        "global_frame": "odom",
    },
    "jazzy": _FRAMES_SINCE_JAZZY,
    "lyrical": _FRAMES_SINCE_JAZZY,
}
"""Release -> topics and frames of its behaviour server."""
ERROR_CODES = ["compute_path_error_code", "follow_path_error_code"]
"""Variables in which Nav2's default tree puts its error codes, since Jazzy."""
COSTMAP_TIMEOUT = "costmap_update_timeout"
UNSTAMPED = ("controller_server", "behavior_server", "velocity_smoother", "collision_monitor")
"""Nodes that publish Twist in Jazzy, but TwistStamped since Kilted unless they are told otherwise."""


def write_nav2_params(
    navigation: NavigationParams,
    *,
    robot: RobotSpec | None = None,
    follow_path: str | None = None,
    use_sim_time: bool = True,
    ros_only: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Return the content of a ``nav2_params.yaml``; every controller is a plugin under its own name.

    Without ``robot`` and ``follow_path``, :func:`~controllers.nav2_params.parsing.parse_nav2_params` returns the same
    parameters back, except those that ROS does not have: the numbers of the behaviour tree, and what
    :func:`parameters_of_ours` returns. The masks of costmap filters are files of their own:
    :func:`~controllers.nav2_params.filters_writing.mask_files`.

    Args:
        navigation: The parameters.
        robot: Gives its shape to costmaps that leave it to the robot.
        follow_path: The controller that is to be called ``FollowPath``, the one that Nav2's own tree asks for.
        use_sim_time: Whether the nodes take the simulator's clock.
        ros_only: Values of a user's file that mean nothing without ROS, by node: ``Nav2Params.ros_only``.

    Raises:
        ConfigError: If ``follow_path`` is unknown, or the progress checker is ``none``.
    """
    nodes = {
        "controller_server": _controller_server(navigation, follow_path),
        "planner_server": _planner_server(navigation),
        "behavior_server": _behavior_server(navigation.behavior_server, navigation.release, navigation.behaviors),
        "bt_navigator": _bt_navigator(navigation),
        **{name: _costmap(costmap, name, robot) for name, costmap in navigation.costmaps.items()},
    }
    if navigation.used_smoothers:
        nodes["smoother_server"] = _smoother_server(navigation)
    if navigation.velocity_smoother is not None:
        nodes["velocity_smoother"] = {**_options(navigation.velocity_smoother), "odom_topic": "odom"}
    if navigation.collision_monitor is not None:
        nodes["collision_monitor"] = _collision_monitor(navigation.collision_monitor, navigation)
    nodes |= filter_nodes(navigation)
    if navigation.release != "humble":
        nodes |= {name: nodes[name] | {"enable_stamped_cmd_vel": False} for name in UNSTAMPED if name in nodes}
    kept = ros_only or {}
    return {
        name: _node(name, _beside({"use_sim_time": use_sim_time, **values}, kept.get(name, {})))
        for name, values in nodes.items()
    }


def parameters_of_ours(navigation: NavigationParams) -> dict[str, Any]:
    """Return, by name, the controllers' parameters that no release of Nav2 has; written files lack them.

    The numbers of the behaviour tree, ``navigation.bt``, are not among them; they belong in its XML.
    """
    plugins = {name: (CONTROLLERS[p.kind], p.params) for name, p in navigation.controllers.items()}
    return {
        f"{name}.{key}": value
        for name, (plugin, params) in plugins.items()
        for key, value in leaves(params)
        if key in plugin.our_keys and key != "release"
    }


def _node(name: str, values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a node with its parameters; each costmap is in a namespace of its own name."""
    node = {"ros__parameters": values}
    return {name: node} if name.endswith("_costmap") else node


def _beside(values: Mapping[str, Any], kept: Mapping[str, Any]) -> dict[str, Any]:
    """Add values kept of a user's file, after the written values; groups of missing plugins are left out."""
    listed = values.get("controller_plugins")
    of_plugins = {name for name, value in kept.items() if listed is not None and isinstance(value, Mapping)}
    return overlay({name: kept[name] for name in kept if name not in of_plugins - values.keys()}, values)


def _options(settings: Settings) -> dict[str, Any]:
    """Return options as ROS takes them: lists for tuples, and nothing for None or for defaults without effect."""
    return nest_dotted(dict(written(type(settings), settings.model_dump(mode="json", exclude_none=True))))


def _collision_monitor(monitor: CollisionMonitor, navigation: NavigationParams) -> dict[str, Any]:
    """Return the monitor behind the velocity smoother, or else behind the controllers."""
    topic = "cmd_vel_nav" if navigation.velocity_smoother is None else "cmd_vel_smoothed"
    topics = {"cmd_vel_in_topic": topic, "cmd_vel_out_topic": "cmd_vel"}
    frames = {"base_frame_id": BASE_FRAME, "odom_frame_id": "odom"}
    return {**topics, **frames, **write_monitor(monitor, navigation.release)}


def _controller_server(navigation: NavigationParams, follow_path: str | None) -> dict[str, Any]:
    server = navigation.controller_server
    plugins = dict(navigation.controllers)
    if follow_path is not None:
        chosen = navigation.controller(follow_path)
        plugins = {"FollowPath" if plugin is chosen else name: plugin for name, plugin in plugins.items()}
    return {
        **_without_timeout(_own_options(server), navigation.release, ControllerServer),
        "odom_topic": "/odom",
        **_list_progress_checker(server.progress_checker, navigation.release),
        "goal_checker_plugins": ["goal_checker"],
        "controller_plugins": list(plugins),
        **_path_handler(server, navigation.release),
        **_progress_checker(server.progress_checker, navigation.release),
        "goal_checker": {
            **_options(server.goal_checker),
            "plugin": GOAL_CHECKERS[server.goal_checker.plugin][navigation.release],
        },
        **{name: CONTROLLERS[p.kind].write(p.params, navigation.release) for name, p in plugins.items()},
    }


def _own_options(server: ControllerServer) -> dict[str, Any]:
    """Return the options of the server without those of its plugins."""
    return {name: value for name, value in _options(server).items() if not name.endswith(("_checker", "_handler"))}


def _without_timeout(values: dict[str, Any], release: Release, settings: type[Settings]) -> dict[str, Any]:
    """Leave out for Humble how long a server waits for its costmap, unless a user gave it: Humble waits for ever."""
    default = settings.model_fields[COSTMAP_TIMEOUT].default
    keeps = release != "humble" or values[COSTMAP_TIMEOUT] != default
    return {name: value for name, value in values.items() if keeps or name != COSTMAP_TIMEOUT}


def _list_progress_checker(checker: ProgressChecker, release: Release) -> dict[str, Any]:
    """Return the parameter that names the progress checker; Humble has only one, and Lyrical may have none."""
    if release == "humble":
        return {"progress_checker_plugin": "progress_checker"}
    return {"progress_checker_plugins": [] if _checks_no_progress(checker, release) else ["progress_checker"]}


def _checks_no_progress(checker: ProgressChecker, release: Release) -> bool:
    return checker.plugin == "none" and release == "lyrical"


def _progress_checker(checker: ProgressChecker, release: Release) -> dict[str, Any]:
    """Return the group of the progress checker by its name."""
    if _checks_no_progress(checker, release):
        return {}
    if checker.plugin not in PROGRESS_CHECKERS:
        raise ConfigError(f"progress_checker.plugin: expected one that ROS has, got {checker.plugin!r}")
    return {"progress_checker": {**_options(checker), "plugin": PROGRESS_CHECKERS[checker.plugin][release]}}


def _path_handler(server: ControllerServer, release: Release) -> dict[str, Any]:
    """Return Lyrical's path handler with the parameter that names it."""
    classes = PATH_HANDLERS["feasible"]
    if release not in classes:
        return {}
    handler = {"plugin": classes[release], **_options(server.path_handler)}
    return {"path_handler_plugins": [PATH_HANDLER_ID], PATH_HANDLER_ID: handler}


def _planner_server(navigation: NavigationParams) -> dict[str, Any]:
    planner = navigation.planner
    if planner.name not in PLANNERS:
        raise ConfigError(f"planner.name: expected one that ROS has, got {planner.name!r}")
    plugin = PLANNERS[planner.name].write(planner.params, navigation.release)
    values = {COSTMAP_TIMEOUT: planner.costmap_update_timeout, "planner_plugins": ["GridBased"], "GridBased": plugin}
    return _without_timeout(values, navigation.release, PlannerPlugin)


def _smoother_server(navigation: NavigationParams) -> dict[str, Any]:
    smoothers = navigation.used_smoothers
    for name, smoother in smoothers.items():
        if smoother.kind not in SMOOTHERS:
            raise ConfigError(f"smoothers.{name}.kind: expected one that ROS has, got {smoother.kind!r}")
    return {
        "costmap_topic": _FRAMES_SINCE_JAZZY["global_costmap_topic"],
        "footprint_topic": _FRAMES_SINCE_JAZZY["global_footprint_topic"],
        "robot_base_frame": BASE_FRAME,
        "smoother_plugins": list(smoothers),
        **{name: SMOOTHERS[one.kind].write(one.params, navigation.release) for name, one in smoothers.items()},
    }


def _behavior_server(server: BehaviorServer, release: Release, behaviors: Sequence[str]) -> dict[str, Any]:
    options = _options(server)
    drive = server.drive_on_heading or default_limits(release)
    options.pop("drive_on_heading", None)
    own = {"backup": _limits(options.pop("backup"), release), DRIVE_ON_HEADING: _limits(_options(drive), release)}
    return {
        **options,
        **BEHAVIOR_FRAMES[release],
        "robot_base_frame": BASE_FRAME,
        "behavior_plugins": list(behaviors),
        **{name: {"plugin": (BEHAVIORS | DRIVES)[name][release], **own.get(name, {})} for name in behaviors},
    }


def _limits(limits: Mapping[str, Any], release: Release) -> dict[str, Any]:
    """Return the limits of a behaviour that drives straight, as far as a release has them; only Lyrical's are not 0."""
    return {name: value for name, value in limits.items() if release == "lyrical" or (value and release == "humble")}


def _bt_navigator(navigation: NavigationParams) -> dict[str, Any]:
    """Return the navigator's ROS parameters; all other numbers of ``bt`` belong in the tree's XML."""
    return {
        "bt_loop_duration": navigation.bt.bt_loop_duration,
        "global_frame": "map",
        "robot_base_frame": BASE_FRAME,
        "odom_topic": "/odom",
        **_error_codes(navigation),
    }


def _error_codes(navigation: NavigationParams) -> dict[str, list[str]]:
    """Return the error codes of the tree that the navigator reports; Lyrical knows only names with an ending."""
    own = written_codes(read_tree(navigation.bt.xml, navigation.release)) if navigation.bt.xml else []
    names = own or ERROR_CODES
    if navigation.release == "lyrical":
        prefixes = [name.removesuffix(ENDING) for name in names if name.endswith(ENDING)]
        return {PREFIXES: prefixes} if prefixes else {}
    return {} if navigation.release == "humble" else {CODES: list(names)}


def _costmap(params: CostmapParams, name: str, robot: RobotSpec | None) -> dict[str, Any]:
    values = {key: value for key, value in _options(params).items() if key != "release" and key not in FILTERS}
    layers = {name: values.pop(name) for name in params.layers}
    if robot is not None and params.footprint is None and params.robot_radius is None:
        values |= {"robot_radius": robot.radius} if robot.footprint is None else {"footprint": robot.footprint}
    if "footprint" in values:
        values["footprint"] = str([list(corner) for corner in values["footprint"]])
    plugins = {name: _layer(name, layers[name], params.release) for name in params.plugins if name in layers}
    frames = {"global_frame": COSTMAP_FRAMES[name], "robot_base_frame": BASE_FRAME}
    return {**frames, **values, **plugins, **filter_groups(params, name)}


def _layer(name: str, options: Mapping[str, Any], release: Release) -> dict[str, Any]:
    """Return one layer's group."""
    if name not in COSTMAP_LAYERS:
        raise ConfigError(f"plugins: expected costmap layers that ROS has, got {name!r}")
    return COSTMAP_LAYERS[name].write(options, release)
