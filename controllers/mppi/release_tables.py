"""Which of MPPI's parameters each release of Nav2 has, and defaults where they differ from Humble's.

Source: nav2_mppi_controller (Humble, Jazzy and Lyrical): optimizer.cpp, path_handler.cpp and the critics.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from gym_mapbench.releases import Release

_ACCELERATION = "Humble's MPPI has no acceleration limits"
_DELAY = "the model has no delay"
_CHECK = "the chosen trajectory is not checked once more"
_LAYER = "the first inflation layer is taken"
_NEWEST = {
    "clamp_raw_controls": "the sampled controls are not clamped before they are used",
    "model_delay_vx": _DELAY,
    "model_delay_vy": _DELAY,
    "model_delay_wz": _DELAY,
    "sgf_order": "the Savitzky-Golay filter is quadratic",
    "TrajectoryValidator.plugin": _CHECK,
    "TrajectoryValidator.collision_lookahead_time": _CHECK,
    "TrajectoryValidator.consider_footprint": _CHECK,
    "CostCritic.inflation_layer_name": _LAYER,
    "ObstaclesCritic.inflation_layer_name": _LAYER,
}
NEWER_ONLY_KEYS = _NEWEST | {
    "ax_max": _ACCELERATION,
    "ax_min": _ACCELERATION,
    "ay_max": _ACCELERATION,
    "ay_min": _ACCELERATION,
    "az_max": _ACCELERATION,
    "open_loop": "Humble starts every rollout from the measured speed",
    "CostCritic.near_collision_cost": "Humble adds critical_cost from cost 253 on",
    "CostCritic.trajectory_point_step": "Humble's CostCritic looks at every point",
    "ObstaclesCritic.inflation_layer_name": "the critic has its own cost_scaling_factor and inflation_radius",
    "PathAngleCritic.mode": "Humble has forward_preference: true is mode 0, false is mode 1",
}
"""Parameters of newer releases that Humble does not have -> what Humble does instead."""

_ONLY_HUMBLE = {
    "reset_period": "{} keeps its control sequence through a pause",
    "PathAngleCritic.forward_preference": "{} has mode: 0 is forward preference, 1 is none",
    "PathAlignCritic.humble_search": "{}'s search is without Humble's defects",
    "ObstaclesCritic.cost_scaling_factor": "{} asks the inflation layer",
    "ObstaclesCritic.inflation_radius": "{} asks the inflation layer",
}
_HANDLER = "Lyrical's path handler cuts the local path for all controllers"
HANDLED: dict[str, Any] = {
    "prune_distance": 1.5,
    "max_robot_pose_search_dist": None,
    "enforce_path_inversion": False,
    "inversion_xy_tolerance": 0.2,
    "inversion_yaw_tolerance": 0.4,
}
"""Parameters that moved to Lyrical's path handler, with the defaults of older releases."""
NOT_IN_JAZZY_KEYS = _NEWEST | {name: why.format("Jazzy") for name, why in _ONLY_HUMBLE.items()}
"""Parameters of other releases that Jazzy does not have -> what Jazzy does instead."""

NOT_IN_LYRICAL_KEYS = {
    **{name: why.format("Lyrical") for name, why in _ONLY_HUMBLE.items()},
    **dict.fromkeys(HANDLED, _HANDLER),
    "CostCritic.inflation_layer_name": _LAYER,
    "ObstaclesCritic.inflation_layer_name": _LAYER,
}
"""Parameters of other releases that Lyrical does not have, or that are fixed here -> what happens instead."""

JAZZY_DEFAULTS: dict[str, Any] = HANDLED | {
    "reset_period": None,
    "ax_max": 3.0,
    "ax_min": -3.0,
    "ay_max": 3.0,
    "ay_min": -3.0,
    "az_max": 3.5,
    "open_loop": False,
    "CostCritic.near_collision_cost": 253,
    "CostCritic.trajectory_point_step": 2,
    "ObstaclesCritic.collision_cost": 1e5,
    "ObstaclesCritic.cost_scaling_factor": None,
    "ObstaclesCritic.inflation_radius": None,
    "PathAlignCritic.humble_search": None,
    "PathAngleCritic.cost_weight": 2.2,
    "PathAngleCritic.max_angle_to_furthest": 0.785398,
    "PathAngleCritic.forward_preference": None,
    "PathAngleCritic.mode": 0,
}
"""Defaults of Jazzy's code where they differ from Humble's; None for parameters that Jazzy does not have."""

LYRICAL_DEFAULTS: dict[str, Any] = JAZZY_DEFAULTS | {
    **dict.fromkeys(HANDLED),
    "model_delay_vx": 0.0,
    "model_delay_vy": 0.0,
    "model_delay_wz": 0.0,
    "clamp_raw_controls": False,
    "sgf_order": 2,
    "TrajectoryValidator.collision_lookahead_time": 2.0,
    "TrajectoryValidator.consider_footprint": False,
    "noise_seed": 1,
}
"""The same for Lyrical."""

MISSING: Mapping[Release, Mapping[str, str]] = {
    "humble": NEWER_ONLY_KEYS,
    "jazzy": NOT_IN_JAZZY_KEYS,
    "lyrical": NOT_IN_LYRICAL_KEYS,
}
DEFAULTS: Mapping[Release, Mapping[str, Any]] = {
    "humble": HANDLED,
    "jazzy": JAZZY_DEFAULTS,
    "lyrical": LYRICAL_DEFAULTS,
}
