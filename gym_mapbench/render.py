"""Pictures of a moment: map, path, trail, scan and robot, drawn by NumPy from a snapshot.

Every shape is a signed distance to its outline in pixels, turned into a share of each pixel's
area: that is all the anti-aliasing there is.
"""

from __future__ import annotations

import functools
import itertools
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.clearance import counter_clockwise
from gym_mapbench.gridmap import GridMap
from gym_mapbench.robot import RobotSpec
from gym_mapbench.scenario import Pose, Scenario

Frame = NDArray[np.uint8]
Colour = tuple[int, int, int]

FREE: Colour = (248, 247, 243)
WALL: Colour = (59, 66, 82)
UNKNOWN: Colour = (221, 219, 212)
SCAN: Colour = (246, 217, 146)
PATH: Colour = (150, 160, 176)
TRAIL: Colour = (76, 134, 178)
START: Colour = (129, 161, 106)
GOAL: Colour = (191, 97, 106)
ROBOT: Colour = (46, 91, 130)
NOSE: Colour = (255, 255, 255)

DEFAULT_SIZE = 600
MAX_TRAIL_POINTS = 500


@dataclass(frozen=True)
class Snapshot:
    """What a picture shows.

    Args:
        scenario: Map, start and goal.
        robot: Its shape.
        pose: Where it is.
        trail: ``(n, 2)`` where it was, m.
        path: ``(n, 2)`` or more columns, the path to show, m; None for none.
        scan: ``(beams, 2)`` angle in the world (rad) and range (m) of every beam; None for none.
    """

    scenario: Scenario
    robot: RobotSpec
    pose: Pose
    trail: NDArray[np.float64]
    path: NDArray[np.float64] | None = None
    scan: NDArray[np.float64] | None = None


def draw(snapshot: Snapshot, size: int = DEFAULT_SIZE) -> Frame:
    """Draw a snapshot.

    Args:
        snapshot: What to show.
        size: Wanted length of the longer side, pixels; cells get a whole number of pixels, so it is met roughly.

    Returns:
        ``(height, width, 3)`` uint8, first row at the top.
    """
    canvas = Canvas(snapshot.scenario.map, size)
    robot, pose = snapshot.robot, snapshot.pose
    if snapshot.scan is not None:
        canvas.fan(pose, snapshot.scan, SCAN, 0.45)
    if snapshot.path is not None:
        canvas.line(snapshot.path[:, :2], 1.5, PATH)
    canvas.line(thin_out(snapshot.trail), 3.0, TRAIL)
    for place, colour in ((snapshot.scenario.start, START), (snapshot.scenario.goal, GOAL)):
        canvas.ring(place, robot.circumscribed_radius, 2.0, colour)
        canvas.line(_heading(place, robot.circumscribed_radius), 2.0, colour)
    if robot.footprint is None:
        canvas.disc(pose, robot.radius, ROBOT)
    else:
        canvas.convex(_placed(np.asarray(robot.footprint), pose), ROBOT)
    canvas.line(_heading(pose, 0.7 * robot.circumscribed_radius), 2.5, NOSE)
    return canvas.frame()


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

    def disc(self, centre: Pose, radius: float, colour: Colour, alpha: float = 1.0) -> None:
        """Fill a disc (m)."""
        column, line = self._pixel(centre.x, centre.y)
        window, columns, lines = self._window([(column, line)], radius * self._scale)
        distance = np.hypot(columns - column, lines - line)
        self._paint(window, radius * self._scale - distance, colour, alpha)

    def ring(self, centre: Pose, radius: float, width: float, colour: Colour) -> None:
        """Draw a circle of ``radius`` m with a line ``width`` pixels wide."""
        column, line = self._pixel(centre.x, centre.y)
        window, columns, lines = self._window([(column, line)], radius * self._scale + width)
        distance = np.abs(np.hypot(columns - column, lines - line) - radius * self._scale)
        self._paint(window, width / 2 - distance, colour)

    def convex(self, corners: NDArray[np.float64], colour: Colour) -> None:
        """Fill a convex polygon, ``(n, 2)`` m, counter-clockwise."""
        points = np.array([self._pixel(x, y) for x, y in corners])
        window, columns, lines = self._window(points, 1.0)
        inside = np.full((lines.size, columns.size), np.inf)
        for (c0, l0), (c1, l1) in zip(points, np.roll(points, -1, axis=0), strict=True):
            length = np.hypot(c1 - c0, l1 - l0)
            # Lines of pixels count downwards, so the inside is to the right of an edge here.
            inside = np.minimum(inside, ((columns - c0) * (l1 - l0) - (lines - l0) * (c1 - c0)) / length)
        self._paint(window, inside, colour)

    def line(self, points: NDArray[np.float64], width: float, colour: Colour) -> None:
        """Draw a line through ``(n, 2)`` m, ``width`` pixels wide."""
        pixels = [self._pixel(x, y) for x, y in points]
        for first, second in itertools.pairwise(pixels):
            window, columns, lines = self._window([first, second], width)
            self._paint(window, width / 2 - _to_segment(columns, lines, first, second), colour)

    def fan(self, centre: Pose, scan: NDArray[np.float64], colour: Colour, alpha: float) -> None:
        """Fill the area that beams ``(n, 2)`` of world angle (rad) and range (m) pass over."""
        column, line = self._pixel(centre.x, centre.y)
        window, columns, lines = self._window([(column, line)], float(scan[:, 1].max()) * self._scale)
        angles, ranges = _closed(scan)
        here = np.arctan2(line - lines, columns - column)
        reach = np.interp(np.mod(here - angles[0], 2 * np.pi) + angles[0], angles, ranges)
        self._paint(window, reach * self._scale - np.hypot(columns - column, lines - line), colour, alpha)

    def _pixel(self, x: float, y: float) -> tuple[float, float]:
        """Column and line of a point; pixel centres are at whole numbers plus a half."""
        return (x - self._x0) * self._scale, (self._y1 - y) * self._scale

    def _window(
        self, points: Any, margin: float
    ) -> tuple[tuple[slice, slice], NDArray[np.float64], NDArray[np.float64]]:
        """Return the part of the picture around some pixels, and its columns ``(1, w)`` and lines ``(h, 1)``."""
        height, width, _ = self._pixels.shape
        low, high = np.min(points, axis=0) - margin - 1, np.max(points, axis=0) + margin + 2
        left, right = int(np.clip(low[0], 0, width)), int(np.clip(high[0], 0, width))
        top, bottom = int(np.clip(low[1], 0, height)), int(np.clip(high[1], 0, height))
        columns, lines = np.arange(left + 0.5, right), np.arange(top + 0.5, bottom)
        return (slice(top, bottom), slice(left, right)), columns[np.newaxis], lines[:, np.newaxis]

    def _paint(
        self, window: tuple[slice, slice], inside: NDArray[np.float64], colour: Colour, alpha: float = 1.0
    ) -> None:
        """Blend a colour over pixels by how far (pixels) they lie inside a shape."""
        share = np.clip(inside + 0.5, 0.0, 1.0)[..., np.newaxis] * np.float32(alpha)
        self._pixels[window] += share.astype(np.float32) * (np.array(colour, np.float32) - self._pixels[window])


class Window:
    """A window that shows frames, by matplotlib."""

    def __init__(self) -> None:
        import matplotlib.pyplot as plt

        self._plt = plt
        self._figure, axes = plt.subplots(num="MapBench", layout="constrained")
        axes.set_axis_off()
        self._axes = axes
        self._image: Any = None

    def show(self, frame: Frame, seconds: float) -> None:
        """Show a frame, for at least so many seconds."""
        if self._image is None:
            self._image = self._axes.imshow(frame)
        self._image.set_data(frame)
        if self._plt.get_backend().lower() == "agg":
            self._figure.canvas.draw()
        else:
            self._plt.pause(seconds)

    def close(self) -> None:
        """Close the window."""
        self._plt.close(self._figure)


def thin_out(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return at most about 500 of the points, both ends included."""
    chosen = np.linspace(0, len(points) - 1, min(len(points), MAX_TRAIL_POINTS)).round().astype(int)
    thinned: NDArray[np.float64] = points[chosen]
    return thinned


@functools.lru_cache(maxsize=4)
def _background(grid: GridMap, size: int) -> NDArray[np.float32]:
    """Draw the map alone, ``(height, width, 3)`` float32: whole pixels a cell, or the mean of whole cells a pixel."""
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


def _to_segment(
    columns: NDArray[np.float64], lines: NDArray[np.float64], first: tuple[float, float], second: tuple[float, float]
) -> NDArray[np.float64]:
    """Distance of every pixel from a segment, ``(h, w)`` pixels."""
    dc, dl = second[0] - first[0], second[1] - first[1]
    squared = dc * dc + dl * dl
    along = ((columns - first[0]) * dc + (lines - first[1]) * dl) / squared if squared > 0 else 0.0 * (columns + lines)
    along = np.clip(along, 0.0, 1.0)
    distance: NDArray[np.float64] = np.hypot(columns - first[0] - along * dc, lines - first[1] - along * dl)
    return distance


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
