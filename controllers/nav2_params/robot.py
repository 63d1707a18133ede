"""The robot of a parameter file: its shape, and how fast the file lets it go."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.descriptor import Limits, highest
from controllers.nav2_params.navigation import NavigationParams
from controllers.nav2_params.parsing import Nav2Params
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.tree_xml.reading import read_tree
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.world.robot import RobotSpec

MAX_CORNERS = 8
"""Largest number of corners that Box2D allows a polygon."""


def robot_of(read: Nav2Params, base: RobotSpec) -> RobotSpec:
    """Return the robot that a parameter file describes.

    The shape is the local costmap's footprint or radius, or else the global costmap's. The limits are those of the
    velocity smoother if the file configures one, since it stands between controllers and base, or else the highest of
    the file's own controllers. They are never below the speeds of the recoveries; Humble's bypass the smoother.

    Args:
        read: The file.
        base: The robot that gives the values missing in the file.
    """
    navigation = read.navigation
    shape: dict[str, Any] = next((shape for shape in map(_shape, navigation.costmaps.values()) if shape), {})
    controllers = [navigation.controllers[name] for name in read.own_controllers]
    limits = _smoother_limits(navigation) or highest(
        CONTROLLERS[plugin.kind].limits(plugin.params) for plugin in controllers
    )
    if limits:
        limits = highest([limits, _recovery_limits(navigation)])
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
    server, speeds, drives = navigation.behavior_server, [navigation.bt.backup_speed], list[float]()
    if navigation.bt.xml:
        nodes = list(read_tree(navigation.bt.xml, navigation.release).walk())
        drives = [node.ports["speed"] for node in nodes if node.name == "DriveOnHeading"]
        speeds = [node.ports["backup_speed"] for node in nodes if node.name == "BackUp"]
        speeds += [-speed for speed in drives if speed < 0.0]
    return {
        **({"max_linear_velocity": fastest} if (fastest := max([0.0, *drives])) else {}),
        **({"max_reverse_velocity": max(speeds)} if speeds else {}),
        "max_angular_velocity": server.max_rotational_vel,
        "max_angular_acceleration": server.rotational_acc_lim,
    }
