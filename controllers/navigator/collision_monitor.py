"""CollisionMonitor: stops, slows or limits commands while measured points are near the robot.

Source: nav2_collision_monitor (Humble, Jazzy and Lyrical) src/collision_monitor_node.cpp, polygon.cpp,
velocity_polygon.cpp, source.cpp, scan.cpp.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, Twist
from controllers.collision_monitor import ActionType, MonitorPolygon, VelocityRange
from controllers.collision_monitor import CollisionMonitor as CollisionMonitorParams
from gym_mapbench.kernels.collision_points import collision_time, count_inside
from gym_mapbench.kernels.frames import in_robot_frame
from gym_mapbench.kernels.jit import plain
from gym_mapbench.releases import Release
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import IDENTITY
from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.scenario import Pose

Points = NDArray[np.float64]

NO_CORNERS = np.empty((0, 2))
AROUND = 1.0 + 1e-9
"""Radius around a polygon over that of its farthest corner, so that rounding leaves no point out."""
_seen_from = plain(in_robot_frame)


class Action(NamedTuple):
    """What the monitor does with a command.

    Args:
        kind: The action; ``none`` for an unchanged command.
        velocity: The velocity that the robot gets.
        polygon: Name of the polygon that decided; empty if none did.
    """

    kind: ActionType
    velocity: Twist
    polygon: str = ""


class CollisionMonitor:
    """Turns commands into commands that are safe near obstacles.

    Args:
        params: Polygons and sources.
        release: The release of Nav2 whose rules count.
        footprint: The padded footprint of the local costmap, for ``approach`` polygons.
        lidar: The lidar that makes the scans.

    Attributes:
        actions: Number of commands by action.
        last: What the monitor did with the last command.
    """

    def __init__(
        self, params: CollisionMonitorParams, release: Release, footprint: Footprint, lidar: LidarSettings
    ) -> None:
        self._shifts, self._lidar = params.base_shift_correction, lidar
        self._beams = np.stack([np.cos(lidar.angles), np.sin(lidar.angles)], axis=1)
        self._zones = [
            (Zone(name, polygon, release, footprint), params.sees(polygon))
            for name, polygon in params.polygons.items()
            if polygon.enabled and params.enabled
        ]
        self._scan = b""
        self._points, self._taken_at, self._pose = NO_CORNERS, IDENTITY, IDENTITY
        self.actions: Counter[ActionType] = Counter()
        self.last = Action("none", STOP)

    def observe(self, pose: Pose, scan: NDArray[np.floating]) -> None:
        """Take this step's measurements.

        Args:
            pose: Pose of the robot in the odom frame.
            scan: ``(beams,)`` ranges, m. If all of them equal the last ones, it is still the last scan.
        """
        self._pose = pose
        if (measured := scan.tobytes()) != self._scan:
            self._scan, self._taken_at = measured, pose
            self._points = self._hits(scan.astype(np.float64))

    def process(self, command: Twist) -> Twist:
        """Return the velocity that the robot gets for a command, and count the action."""
        self.last = self.act_on(command)
        self.actions[self.last.kind] += 1
        return self.last.velocity

    def act_on(self, command: Twist) -> Action:
        """Return the action with the least velocity of all polygons; a stop ends the search."""
        action = Action("none", command)
        points = self._moved()
        for zone, sees in self._zones:
            if action.kind == "stop":
                break
            safe = zone.safe_velocity(points if sees else NO_CORNERS, command)
            if safe is not None and (zone.kind == "stop" or _is_slower(safe, action.velocity)):
                action = Action(zone.kind, safe, zone.name)
        return action

    def _hits(self, scan: Points) -> Points:
        """Return where the beams hit something, ``(n, 2)`` m in the robot's frame when it was measured."""
        is_hit = (scan >= (self._lidar.range_min or 0.0)) & (scan < self._lidar.range_max)
        return _placed(self._lidar.place, self._beams[is_hit] * scan[is_hit, None])

    def _moved(self) -> Points:
        """Return the points in the robot's frame of now."""
        if not self._shifts or self._taken_at == self._pose:
            return self._points
        return _placed(Pose(*_seen_from(*self._taken_at, *self._pose)), self._points)


class Zone:
    """One polygon of the monitor.

    Args:
        name: Its name.
        polygon: Its parameters.
        release: The release of Nav2 whose rules count.
        footprint: The shape of an ``approach`` polygon without points.

    Attributes:
        name: As above.
        kind: Its action.
    """

    def __init__(self, name: str, polygon: MonitorPolygon, release: Release, footprint: Footprint) -> None:
        self.name = name
        self.kind: ActionType = polygon.action_type
        self._polygon, self._release = polygon, release
        self._corners, self._radius = NO_CORNERS, polygon.radius or 0.0
        self._has_shape = polygon.type != "velocity_polygon"
        if polygon.type == "polygon":
            self._take_corners(footprint.corners if polygon.points is None else np.array(polygon.points))
        self._hits = self._misses = 0
        self._is_active = False

    def safe_velocity(self, points: Points, command: Twist) -> Twist | None:
        """Return the velocity that the polygon allows; None while it has nothing against the command."""
        self._select_shape(command)
        if not self._has_shape or self.kind == "none":
            return None
        if self.kind == "approach":
            return self._approach(points, command)
        if not self._is_triggered(points):
            return None
        if self.kind == "stop":
            return STOP
        if self.kind == "slowdown":
            return _scaled(command, self._polygon.slowdown_ratio)
        return self._limit(command)

    def _select_shape(self, command: Twist) -> None:
        """Give a velocity polygon the shape for a command; it keeps the last one if none is for it."""
        for shape in self._polygon.velocity_polygons.values():
            if is_in_range(shape, command, self._polygon.holonomic, self._release):
                self._take_corners(np.array(shape.points))
                return

    def _take_corners(self, corners: Points) -> None:
        self._corners, self._has_shape = corners.copy(), True
        self._radius = AROUND * float(np.hypot(*corners.T).max())

    def _is_triggered(self, points: Points) -> bool:
        """Whether enough points are inside, for as many commands in a row as the parameters ask for."""
        inside = count_inside(points, self._corners, self._radius, 0.0, 0.0, 0.0)
        hit = bool(inside >= self._polygon.min_points)
        self._hits = self._hits + 1 if hit else 0
        self._misses = 0 if hit else self._misses + 1
        if self._hits >= self._polygon.trigger_consecutive_points:
            self._is_active = True
        if self._misses >= self._polygon.release_consecutive_points:
            self._is_active = False
        return self._is_active

    def _approach(self, points: Points, command: Twist) -> Twist | None:
        """Return the command times the share of ``time_before_collision`` that is left.

        Humble needs one point less for a collision at the present pose than for one later on.
        """
        polygon = self._polygon
        now = polygon.min_points - 1 if self._release == "humble" else polygon.min_points
        horizon, step = polygon.time_before_collision, polygon.simulation_time_step
        time = collision_time(points, self._corners, self._radius, *command, horizon, step, now, polygon.min_points)
        return _scaled(command, time / horizon) if time >= 0.0 else None

    def _limit(self, command: Twist) -> Twist:
        """Return the command within its limits; Lyrical keeps the curvature, Jazzy caps both velocities apart."""
        linear, angular = self._polygon.linear_limit, self._polygon.angular_limit
        ratio = min(1.0, linear / abs(command.v)) if command.v else 1.0
        if self._release == "lyrical":
            return _scaled(command, min(ratio, angular / abs(command.w)) if command.w else ratio)
        return Twist(command.v * ratio, min(max(command.w, -angular), angular))


def is_in_range(shape: VelocityRange, command: Twist, holonomic: bool, release: Release) -> bool:
    """Whether a shape of a velocity polygon is the one for a command.

    A holonomic polygon of Lyrical compares the speed's magnitude, of Jazzy the forward speed.
    """
    speed = abs(command.v) if holonomic and release == "lyrical" else command.v
    in_range = shape.linear_min <= speed <= shape.linear_max and shape.theta_min <= command.w <= shape.theta_max
    if not holonomic:
        return in_range
    start, end = shape.direction_start_angle, shape.direction_end_angle
    direction = math.pi if command.v < 0.0 else 0.0
    if start <= end:
        return in_range and start <= direction <= end
    return in_range and (direction >= start or direction <= end)


def _scaled(command: Twist, ratio: float) -> Twist:
    return Twist(command.v * ratio, command.w * ratio)


def _is_slower(first: Twist, second: Twist) -> bool:
    """Whether a velocity has the smaller sum of squares, Nav2's order of velocities."""
    return first.v**2 + first.w**2 < second.v**2 + second.w**2


def _placed(frame: Pose, points: Points) -> Points:
    """Return ``(n, 2)`` points of a frame, given by its pose, in the frame around it."""
    cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
    return np.stack(
        [frame.x + cos * points[:, 0] - sin * points[:, 1], frame.y + sin * points[:, 0] + cos * points[:, 1]], 1
    )
