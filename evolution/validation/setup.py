"""The recorded set-up as settings of this project: costmaps, controllers and navigation as they were recorded."""

from __future__ import annotations

from typing import Any

import numpy as np

from controllers.base import FollowerSetup, PathFollower
from controllers.behaviors import GOAL_NEARBY, default_tree
from controllers.checkers import GoalChecker, ProgressChecker
from controllers.nav2_params.navigation import ControllerServer, NavigationParams
from controllers.nav2_params.plugin_settings import PlannerPlugin
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.navigator.checkers import make_goal_checker
from controllers.path_handler import PathHandler
from controllers.registry import FOLLOWERS
from evolution.validation.oracle import TREE_REPLAN, Oracle, Preset
from gym_mapbench.costmap import Costmap, CostmapParams, InflationLayer, build_static_costmap
from gym_mapbench.planners.navfn import NavfnParams, NavfnPlanner
from gym_mapbench.ros_params import Findings, Section
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.robot import RobotSpec

WINDOW_METERS = 3

KINDS = {"DWB": "dwb", "RPP": "rpp", "MPPI": "mppi", "Graceful": "graceful", "RotationShim": "shim_dwb"}
"""Our names of the controllers, by their names in the recordings."""


def footprint_of(preset: Preset) -> Footprint:
    """The padded footprint of a preset."""
    return Footprint.from_radius(preset.robot_radius, preset.footprint_padding)


def costmap_params(oracle: Oracle, preset: Preset, *, rolling: bool = False) -> CostmapParams:
    """Return the options of a costmap with static map and inflation, over the whole map or in a rolling window."""
    window = {"rolling_window": True, "width": WINDOW_METERS, "height": WINDOW_METERS} if rolling else {}
    return CostmapParams(
        robot_radius=preset.robot_radius,
        footprint_padding=preset.footprint_padding,
        resolution=preset.resolution,
        plugins=("static_layer", "inflation_layer"),
        inflation_layer=InflationLayer(
            inflation_radius=preset.inflation_radius, cost_scaling_factor=preset.cost_scaling_factor
        ),
        release=oracle.release,
        **window,
    )


def full_costmaps(oracle: Oracle, preset: Preset) -> dict[int, Costmap]:
    """Return the inflated costmap of every map, by id."""
    params, footprint = costmap_params(oracle, preset), footprint_of(preset)
    return {number: build_static_costmap(grid, params, footprint) for number, grid in oracle.maps(preset).items()}


def make_follower(
    oracle: Oracle, kind: str, variant: str = "default", seed: int | None = None, **changes: Any
) -> PathFollower:
    """Make a controller with the recorded parameters but ``changes``; ``seed`` is that of MPPI's noise generator."""
    ours, params = KINDS[kind], follower_params(oracle, kind, variant) | changes
    noise = {"noise": "nav2", "noise_seed": seed} if kind == "MPPI" and seed is not None else {}
    return FOLLOWERS[ours](CONTROLLERS[ours].params(**params, **noise))


def follower_params(oracle: Oracle, kind: str, variant: str = "default") -> dict[str, Any]:
    """Return the recorded parameters and their release, without those that only ROS needs.

    Those of the Rotation Shim include DWB's, the controller that was recorded inside it.
    """
    plugin = CONTROLLERS[KINDS[kind]]
    inside = oracle.controller_params("DWB", "default") if kind == "RotationShim" else {}
    values = {**inside, **oracle.controller_params(kind, variant)}
    if inside:
        values["primary_controller"] = inside
    section = Section(kind, values, Findings(oracle.release))
    plugin.adapt(section)
    used = {name: value for name, value in section.values.items() if not plugin.keys.is_ros_only(name)}
    return used | {"release": oracle.release}


def make_planner(oracle: Oracle) -> NavfnPlanner:
    """Make NavFn with the recorded parameters; ``max_cycles_factor`` has the fixed value of the older releases."""
    given = {name: value for name, value in oracle.config["planner"].items() if name != "max_cycles_factor"}
    return NavfnPlanner(NavfnParams(**given, release=oracle.release))


def follower_setup(oracle: Oracle, preset: Preset) -> FollowerSetup:
    """Return what the recorded controller server passed to its plugins."""
    simulation = oracle.config["simulation"]
    return FollowerSetup(
        footprint=footprint_of(preset),
        control_period=1.0 / simulation["control_hz"],
        xy_goal_tolerance=simulation["xy_goal_tolerance"],
        yaw_goal_tolerance=simulation["yaw_goal_tolerance"],
        inflation_radius=preset.inflation_radius,
        cost_scaling_factor=preset.cost_scaling_factor,
        rng=np.random.default_rng(0),
        goal_checker=make_goal_checker(goal_checker_of(oracle)),
    )


def goal_checker_of(oracle: Oracle) -> GoalChecker:
    """Return the parameters of the recorded goal checker."""
    names = "xy_goal_tolerance", "yaw_goal_tolerance", "path_length_tolerance"
    return GoalChecker(
        **{name: oracle.config["simulation"][name] for name in names if name in oracle.config["simulation"]}
    )


def path_handler_of(oracle: Oracle) -> PathHandler:
    """Return the parameters of the recorded path handler, which only Lyrical has."""
    recorded = oracle.config.get("path_handler", {})
    return PathHandler(**{name: value for name, value in recorded.items() if name != "plugin"})


def robot_of(oracle: Oracle, preset: Preset) -> RobotSpec:
    """Return the recorded robot: a disc with acceleration limits, and speed limits that no controller reaches."""
    simulation = oracle.config["simulation"]
    return RobotSpec(
        radius=preset.robot_radius,
        max_linear_velocity=5.0,
        max_reverse_velocity=5.0,
        max_angular_velocity=50.0,
        max_linear_acceleration=simulation["acc_lin"],
        max_angular_acceleration=simulation["acc_ang"],
    )


def navigation_of(oracle: Oracle, preset: Preset, local_costmap: str, variant: str = "default") -> NavigationParams:
    """Return the recorded navigation: replanning and a goal checker; no recoveries, progress checker or smoother."""
    simulation = oracle.config["simulation"]
    threshold = simulation["min_velocity_threshold"]
    return NavigationParams(
        release=oracle.release,
        controller_server=ControllerServer(
            controller_frequency=simulation["control_hz"],
            min_x_velocity_threshold=threshold,
            min_theta_velocity_threshold=threshold,
            failure_tolerance=simulation["failure_tolerance"],
            progress_checker=ProgressChecker(plugin="none"),
            goal_checker=goal_checker_of(oracle),
            path_handler=path_handler_of(oracle),
        ),
        planner=PlannerPlugin(name="navfn", params=make_planner(oracle).params.model_dump()),
        local_costmap=costmap_params(oracle, preset, rolling=local_costmap == "rolling"),
        global_costmap=costmap_params(oracle, preset),
        bt=default_tree(oracle.release).replace(
            recoveries=False,
            replanning_frequency=simulation["replan_hz"],
            goal_nearby_distance=GOAL_NEARBY if variant == TREE_REPLAN else 0.0,
        ),
    )
