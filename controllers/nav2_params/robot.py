"""The robot of a parameter file: its shape, and how fast the file lets it go."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.nav2_params.navigation import ControllerPlugin, NavigationParams
from controllers.nav2_params.parsing import Nav2Params
from controllers.nav2_params.plugins import SHIMS
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.world.robot import RobotSpec

MAX_CORNERS = 8
"""Largest number of corners that Box2D allows a polygon."""

Limits = dict[str, float]

TURNING: Mapping[str, str] = {
    "max_angular_velocity": "rotate_to_heading_angular_vel",
    "max_angular_acceleration": "max_angular_accel",
}
"""Limit of the robot -> the Rotation Shim's own parameter that gives it."""
SOURCES: Mapping[str, Mapping[str, str]] = {
    "dwb": {
        "max_linear_velocity": "max_vel_x",
        "max_reverse_velocity": "min_vel_x",
        "max_angular_velocity": "max_vel_theta",
        "max_linear_acceleration": "acc_lim_x",
        "max_angular_acceleration": "acc_lim_theta",
    },
    "mppi": {
        "max_linear_velocity": "vx_max",
        "max_reverse_velocity": "vx_min",
        "max_angular_velocity": "wz_max",
        "max_linear_acceleration": "ax_max",
        "max_angular_acceleration": "az_max",
    },
    "rpp": {"max_linear_velocity": "desired_linear_vel", **TURNING},
    "graceful": {"max_linear_velocity": "v_linear_max", "max_angular_velocity": "v_angular_max"},
}
"""Kind of controller -> limit of the robot -> the parameter that gives it; speeds backwards are negative there."""


def robot_of(read: Nav2Params, base: RobotSpec) -> RobotSpec:
    """Return the robot that a parameter file describes.

    The shape is the local costmap's footprint or radius, or else the global costmap's. The limits are those of the
    velocity smoother if the file configures one, since it stands between controllers and base, or else the highest of
    the file's own controllers. They are never below what the recoveries ask for; Humble's bypass the
    smoother.

    Args:
        read: The file.
        base: The robot that gives what the file does not say.
    """
    navigation = read.navigation
    costmaps = navigation.local_costmap, navigation.global_costmap
    shape: dict[str, Any] = next((shape for shape in map(_shape, costmaps) if shape), {})
    controllers = [navigation.controllers[name] for name in read.own_controllers]
    limits = _smoother_limits(navigation) or _highest([_limits(plugin) for plugin in controllers])
    if limits:
        limits = _highest([limits, _recovery_limits(navigation)])
    return base.replace(name="custom", **shape, **limits) if shape or limits else base


def _shape(costmap: CostmapParams) -> dict[str, Any]:
    """Return the footprint or the radius of a costmap; empty if it leaves them to the robot."""
    if costmap.footprint is not None:
        corners = np.array(costmap.footprint)
        return {"footprint": tuple(map(tuple, _hull(corners).tolist())), "radius": float(np.hypot(*corners.T).max())}
    return {} if costmap.robot_radius is None else {"radius": costmap.robot_radius, "footprint": None}


def _hull(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the convex hull of ``(n, 2)`` corners, cut to ``MAX_CORNERS`` by leaving out those that add least area."""
    hull = list(_outline(corners))
    while len(hull) > MAX_CORNERS:
        areas = [_area(hull[i - 1], hull[i], hull[(i + 1) % len(hull)]) for i in range(len(hull))]
        del hull[int(np.argmin(areas))]
    return np.array(hull)


def _outline(corners: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the corners of the convex hull, counterclockwise (Andrew's monotone chain)."""
    points = np.unique(corners, axis=0)
    halves = []
    for ordered in (points, points[::-1]):
        half: list[NDArray[np.float64]] = []
        for point in ordered:
            while len(half) > 1 and _area(half[-2], half[-1], point) <= 1e-12:
                half.pop()
            half.append(point)
        halves += half[:-1]
    return halves


def _area(a: NDArray[np.float64], b: NDArray[np.float64], c: NDArray[np.float64]) -> float:
    """Return twice the signed area of a triangle, positive if its corners are counterclockwise."""
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _limits(plugin: ControllerPlugin) -> Limits:
    """Return the limits that a controller's parameters give, for a Rotation Shim with those of its primary."""
    inside = SHIMS.get(plugin.kind, plugin.kind)
    found = [_named(plugin, SOURCES[inside])]
    if plugin.kind in SHIMS:
        found.append(_named(plugin, TURNING))
    if inside == "graceful":  # v_angular_max does not limit turns on the spot, of which half a turn is the fastest
        rate = plugin.params["rotation_scaling_factor"] * np.pi * plugin.params["v_angular_max"]
        found.append({"max_angular_velocity": float(rate)})
    return _highest(found)


def _named(plugin: ControllerPlugin, sources: Mapping[str, str]) -> Limits:
    """Return the limits that parameters give; a parameter that is 0 or not given limits nothing."""
    found = {limit: plugin.params.get(name) or 0.0 for limit, name in sources.items()}
    found["max_reverse_velocity"] = max(0.0, -found.get("max_reverse_velocity", 0.0))
    return {limit: float(value) for limit, value in found.items() if value > 0}


def _smoother_limits(navigation: NavigationParams) -> Limits:
    smoother = navigation.velocity_smoother
    if smoother is None:
        return {}
    found = {
        "max_linear_velocity": smoother.max_velocity[0],
        "max_reverse_velocity": -smoother.min_velocity[0],
        "max_angular_velocity": smoother.max_velocity[2],
        "max_linear_acceleration": max(smoother.max_accel[0], -smoother.max_decel[0]),
        "max_angular_acceleration": max(smoother.max_accel[2], -smoother.max_decel[2]),
    }
    return {limit: value for limit, value in found.items() if value > 0}


def _recovery_limits(navigation: NavigationParams) -> Limits:
    server = navigation.behavior_server
    return {
        "max_reverse_velocity": navigation.bt.backup_speed,
        "max_angular_velocity": server.max_rotational_vel,
        "max_angular_acceleration": server.rotational_acc_lim,
    }


def _highest(limits: list[Limits]) -> Limits:
    """Return the highest value of each limit."""
    return {name: max(one.get(name, 0.0) for one in limits) for name in {name for one in limits for name in one}}
