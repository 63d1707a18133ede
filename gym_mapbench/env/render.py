"""Pictures: map, path, trail, scan, bodies and robot of a snapshot, drawn into an array."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.costmap import INSCRIBED_INFLATED_OBSTACLE, LETHAL_OBSTACLE, NO_INFORMATION, Costmap
from gym_mapbench.kernels.raster import paint_convex, paint_fan, paint_line, paint_ring
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.proximity import counter_clockwise
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario

Frame = NDArray[np.uint8]
Colour = NDArray[np.float32]

FREE: Colour = np.array((248, 247, 243), np.float32)
WALL: Colour = np.array((59, 66, 82), np.float32)
UNKNOWN: Colour = np.array((221, 219, 212), np.float32)
SCAN: Colour = np.array((246, 217, 146), np.float32)
PATH: Colour = np.array((150, 160, 176), np.float32)
TRAIL: Colour = np.array((76, 134, 178), np.float32)
START: Colour = np.array((129, 161, 106), np.float32)
GOAL: Colour = np.array((191, 97, 106), np.float32)
ROBOT: Colour = np.array((46, 91, 130), np.float32)
NOSE: Colour = np.array((255, 255, 255), np.float32)
BODY: Colour = np.array((208, 135, 112), np.float32)

ESTIMATE: Colour = np.array((200, 80, 20), np.float32)
LETHAL: Colour = np.array((196, 0, 196), np.float32)
INSCRIBED: Colour = np.array((0, 190, 190), np.float32)
LOW_COST: Colour = np.array((40, 60, 235), np.float32)
HIGH_COST: Colour = np.array((235, 30, 40), np.float32)
COSTMAP_ALPHA = 0.55

DEFAULT_SIZE = 600


@dataclass(frozen=True)
class SeenCostmap:
    """A costmap as the robot has it, where it believes it to be.

    Args:
        costmap: The cost values, in a frame of their own.
        frame: Pose of that frame on the map, by the robot's localisation.
        estimate: Where the robot believes it is on the map.
    """

    costmap: Costmap
    frame: Pose
    estimate: Pose


@dataclass(frozen=True)
class Snapshot:
    """The content of a picture.

    Args:
        scenario: Map, start and goal.
        robot: Its shape.
        pose: Where it is.
        trail: ``(n, 2)`` where it was, m.
        path: ``(n, 2)`` or more columns, the path to show, m; None for none.
        scan: ``(beams, 2)`` angle in the world (rad) and range (m) of every beam; None for none.
        sensor: Where the beams start; None for the robot's centre.
        seen: A costmap of the robot, and where the robot believes it is; None for none.
        bodies: ``(n, 3)`` poses of the scenario's bodies, from :func:`~gym_mapbench.world.bodies.place_bodies`; None
            for none.
    """

    scenario: Scenario
    robot: RobotSpec
    pose: Pose
    trail: NDArray[np.float64]
    path: NDArray[np.float64] | None = None
    scan: NDArray[np.float64] | None = None
    sensor: Pose | None = None
    seen: SeenCostmap | None = None
    bodies: NDArray[np.float64] | None = None


def draw(snapshot: Snapshot, size: int = DEFAULT_SIZE) -> Frame:
    """Draw a snapshot.

    Args:
        snapshot: What to show.
        size: Wanted length of the longer side, pixels; met only roughly, as every cell gets a whole number of pixels.

    Returns:
        ``(height, width, 3)`` uint8, first row at the top.
    """
    canvas = Canvas(snapshot.scenario.map, size)
    robot, pose = snapshot.robot, snapshot.pose
    if snapshot.scan is not None:
        canvas.fan(snapshot.sensor or pose, snapshot.scan, SCAN, 0.45)
    if snapshot.seen is not None:
        canvas.costmap(snapshot.seen)
    if snapshot.path is not None:
        canvas.line(snapshot.path[:, :2], 1.5, PATH)
    canvas.line(snapshot.trail, 3.0, TRAIL)
    for place, colour in ((snapshot.scenario.start, START), (snapshot.scenario.goal, GOAL)):
        canvas.ring(place, robot.circumscribed_radius, 2.0, colour)
        canvas.line(_heading(place, robot.circumscribed_radius), 2.0, colour)
    if snapshot.bodies is not None:
        _draw_bodies(canvas, snapshot.scenario, snapshot.bodies)
    if robot.footprint is None:
        canvas.disc(pose, robot.radius, ROBOT)
    else:
        canvas.convex(_placed(np.asarray(robot.footprint), pose), ROBOT)
    canvas.line(_heading(pose, 0.7 * robot.circumscribed_radius), 2.5, NOSE)
    if snapshot.seen is not None:
        canvas.ring(snapshot.seen.estimate, robot.circumscribed_radius, 1.5, ESTIMATE)
    return canvas.frame()


def _draw_bodies(canvas: Canvas, scenario: Scenario, poses: NDArray[np.float64]) -> None:
    """Draw every body as a disc, with a line in the direction of its heading."""
    for body, place in zip(scenario.bodies, poses.tolist(), strict=True):
        pose = Pose(*place)
        canvas.disc(pose, body.shape.radius, BODY)
        canvas.line(_heading(pose, body.shape.radius), 2.0, NOSE)


class Canvas:
    """A picture of a map, to draw on in world coordinates.

    Args:
        grid: The map.
        size: Wanted length of the longer side, pixels.
    """

    def __init__(self, grid: GridMap, size: int = DEFAULT_SIZE) -> None:
        background = _background(grid, size)
        self._pixels = background.copy()
        height = len(background)
        x0, y0, _, y1 = grid.bounds
        self._scale = height / (y1 - y0)
        self._x0, self._y1 = x0, y1

    def frame(self) -> Frame:
        """Return the picture, ``(height, width, 3)`` uint8."""
        return np.round(self._pixels).astype(np.uint8)

    def disc(self, centre: Pose, radius: float, colour: Colour) -> None:
        """Fill a disc (m)."""
        column, line = self._to_pixels([centre[:2]])[0]
        paint_ring(self._pixels, column, line, -1.0, radius * self._scale, colour, 1.0)

    def ring(self, centre: Pose, radius: float, width: float, colour: Colour) -> None:
        """Draw a circle of ``radius`` m with a line ``width`` pixels wide."""
        column, line = self._to_pixels([centre[:2]])[0]
        middle = radius * self._scale
        paint_ring(self._pixels, column, line, middle - width / 2, middle + width / 2, colour, 1.0)

    def convex(self, corners: NDArray[np.float64], colour: Colour) -> None:
        """Fill a convex polygon, ``(n, 2)`` m, counter-clockwise."""
        paint_convex(self._pixels, self._to_pixels(corners), colour)

    def line(self, points: NDArray[np.float64], width: float, colour: Colour) -> None:
        """Draw a line through ``(n, 2)`` m, ``width`` pixels wide."""
        paint_line(self._pixels, self._to_pixels(points), width, colour)

    def fan(self, centre: Pose, scan: NDArray[np.float64], colour: Colour, alpha: float) -> None:
        """Fill the area that beams ``(n, 2)`` of world angle (rad) and range (m) pass over."""
        column, line = self._to_pixels([centre[:2]])[0]
        angles, ranges = _closed(scan)
        paint_fan(self._pixels, column, line, angles, ranges * self._scale, colour, alpha)

    def costmap(self, seen: SeenCostmap) -> None:
        """Lay the colours of a costmap over the picture: free cells stay as they are."""
        height, width, _ = self._pixels.shape
        x = self._x0 + (np.arange(width) + 0.5) / self._scale - seen.frame.x
        y = (self._y1 - (np.arange(height) + 0.5) / self._scale - seen.frame.y)[:, np.newaxis]
        cos, sin = np.cos(seen.frame.yaw), np.sin(seen.frame.yaw)
        costmap = seen.costmap
        cols = np.floor((cos * x + sin * y - costmap.origin_x) / costmap.resolution).astype(np.int64)
        rows = np.floor((cos * y - sin * x - costmap.origin_y) / costmap.resolution).astype(np.int64)
        inside = (rows >= 0) & (rows < costmap.costs.shape[0]) & (cols >= 0) & (cols < costmap.costs.shape[1])
        costs = costmap.costs[rows[inside], cols[inside]]
        alpha = (COSTMAP_ALPHA * (costs > 0)).astype(np.float32)[:, np.newaxis]
        self._pixels[inside] += alpha * (_cost_colours()[costs] - self._pixels[inside])

    def _to_pixels(self, points: ArrayLike) -> NDArray[np.float64]:
        """Column and line of points ``(n, 2)`` m; pixel centres are at whole numbers plus a half."""
        x, y = np.asarray(points, dtype=np.float64).T
        return np.stack([x - self._x0, self._y1 - y], axis=1) * self._scale


class Window:
    """A window that shows frames, by matplotlib."""

    def __init__(self) -> None:
        import matplotlib.pyplot as plt

        self._plt = plt
        self._figure, self._axes = plt.subplots(layout="constrained")
        if self._figure.canvas.manager is not None:
            self._figure.canvas.manager.set_window_title("MapBench")
        self._image: Any = None

    def show(self, frame: Frame, seconds: float) -> None:
        """Show a frame, for at least so many seconds."""
        if self._image is None or self._image.get_size() != frame.shape[:2]:
            self._axes.clear()
            self._axes.set_axis_off()
            self._image = self._axes.imshow(frame)
        self._image.set_data(frame)
        if self._plt.get_backend().lower() == "agg":
            self._figure.canvas.draw()
        else:
            self._plt.pause(seconds)

    def close(self) -> None:
        """Close the window."""
        self._plt.close(self._figure)


@functools.cache
def _cost_colours() -> NDArray[np.float32]:
    """Colour ``(256, 3)`` of every cost, after RViz' scheme "costmap": blue to red, cyan inscribed, magenta lethal."""
    share = np.linspace(0.0, 1.0, 256, dtype=np.float32)[:, np.newaxis]
    colours: NDArray[np.float32] = LOW_COST + share * (HIGH_COST - LOW_COST)
    colours[INSCRIBED_INFLATED_OBSTACLE], colours[LETHAL_OBSTACLE], colours[NO_INFORMATION] = INSCRIBED, LETHAL, UNKNOWN
    return colours


@functools.lru_cache(maxsize=4)
def _background(grid: GridMap, size: int) -> NDArray[np.float32]:
    """Draw the map alone, ``(height, width, 3)`` float32: whole pixels per cell, or a mean of cells per pixel."""
    cells = np.empty((*grid.shape, 3), np.float32)
    cells[:] = FREE
    if grid.unknown is not None:
        cells[grid.unknown] = UNKNOWN
    cells[grid.occupancy] = WALL
    longer = max(grid.shape)
    if longer <= size:
        zoom = max(1, round(size / longer))
        zoomed: NDArray[np.float32] = cells[::-1].repeat(zoom, axis=0).repeat(zoom, axis=1)
        return zoomed
    block = -(-longer // size)
    rows, cols = (-(-side // block) for side in grid.shape)
    padded = np.pad(cells, ((0, rows * block - grid.shape[0]), (0, cols * block - grid.shape[1]), (0, 0)), mode="edge")
    mean: NDArray[np.float32] = padded.reshape(rows, block, cols, block, 3).mean(axis=(1, 3), dtype=np.float32)
    return mean[::-1]


def _closed(scan: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Angles in rising order over a full turn, and ranges; nothing is seen in gaps wider than three beams."""
    order = np.argsort(np.mod(scan[:, 0], 2 * np.pi))
    angles, ranges = np.mod(scan[order, 0], 2 * np.pi), scan[order, 1]
    gaps = np.diff(angles, append=angles[0] + 2 * np.pi)
    widest = int(np.argmax(gaps))
    angles = np.roll(angles, -widest - 1)
    angles = angles[0] + np.mod(angles - angles[0], 2 * np.pi)
    ranges = np.roll(ranges, -widest - 1)
    beam = float(np.median(gaps))
    if gaps[widest] > 3 * beam:
        angles = np.concatenate([angles, [angles[-1] + 1e-6, angles[0] + 2 * np.pi - 1e-6]])
        ranges = np.concatenate([ranges, [0.0, 0.0]])
    return np.append(angles, angles[0] + 2 * np.pi), np.append(ranges, ranges[0])


def _heading(pose: Pose, length: float) -> NDArray[np.float64]:
    """The line from a pose ``length`` m ahead."""
    ahead = np.array([np.cos(pose.yaw), np.sin(pose.yaw)]) * length
    return np.array([[pose.x, pose.y], [pose.x + ahead[0], pose.y + ahead[1]]])


def _placed(corners: NDArray[np.float64], pose: Pose) -> NDArray[np.float64]:
    """Corners of a footprint at a pose, counter-clockwise, m."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    turned = counter_clockwise(corners) @ np.array([[cos, sin], [-sin, cos]])
    placed: NDArray[np.float64] = turned + np.array([pose.x, pose.y])
    return placed
