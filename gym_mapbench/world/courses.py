"""Checks of bodies before a run: their courses stay on the map and off the walls, and nobody starts inside another."""

from __future__ import annotations

import functools
import math

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.clearance import clearances_of_disc
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.crowd import place_crowd
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.pedestrians import Course

SPACING = 0.05
"""Distance between two points of a course that are checked, m."""
MAX_BODIES = 100
"""Largest number of bodies of a scenario."""


@functools.lru_cache(maxsize=64)
def check_courses(grid: GridMap, bodies: tuple[Body, ...]) -> None:
    """Refuse bodies whose course meets a wall, or that start inside one another; cached, as episodes repeat.

    Raises:
        ConfigError: Naming the first body and the place.
    """
    if len(bodies) > MAX_BODIES:
        raise ConfigError(f"bodies: expected at most {MAX_BODIES}, got {len(bodies)}")
    walkers = [number for number, body in enumerate(bodies) if body.motion.keeps_to_course]
    for number in walkers:
        obstacle = find_wall(grid, bodies[number])
        if obstacle:
            raise ConfigError(f"{_name(bodies, number)}: expected a course clear of walls, got {obstacle}")
    _check_starts(grid, bodies, walkers)


def find_wall(grid: GridMap, body: Body) -> str:
    """Say where a course leaves the map or meets a wall; empty if it does neither, or the body has no course."""
    motion = body.motion.motion
    if not isinstance(motion, Course):
        return ""
    for spacing in (math.inf, SPACING):  # the corners first: between corners far off the map lie too many points
        points = motion.course(spacing)
        for x, y in points[_off_the_map(grid, points)][:1].tolist():
            return f"({x:.6g}, {y:.6g}) off the map"
    for x, y in points[_clearances(grid, points, body.shape.radius) <= 0.0][:1].tolist():
        return f"a wall that touches it at ({x:.6g}, {y:.6g})"
    return ""


def _off_the_map(grid: GridMap, points: NDArray[np.float64]) -> NDArray[np.bool_]:
    left, bottom, right, top = grid.bounds
    x, y = points.T
    off: NDArray[np.bool_] = (x < left) | (x > right) | (y < bottom) | (y > top)
    return off


def _clearances(grid: GridMap, points: NDArray[np.float64], radius: float) -> NDArray[np.float64]:
    """Return the distance from a disc at every point to the nearest wall, ``(n,)`` m."""
    states = np.concatenate([points, np.zeros((len(points), 1))], axis=1)
    distances: NDArray[np.float64] = clearances_of_disc(grid.boxes, np.array(grid.bounds), states, radius)
    return distances


def _check_starts(grid: GridMap, bodies: tuple[Body, ...], walkers: list[int]) -> None:
    """Refuse a walker that starts inside another body."""
    places = place_crowd(grid, bodies, np.zeros(1))[0, :, :2]
    radii = np.array([body.shape.radius for body in bodies])
    for number in walkers:
        away = np.hypot(*(places - places[number]).T) - radii - radii[number]
        away[number] = np.inf
        if away.min() < 0.0:
            other, (x, y) = _name(bodies, int(away.argmin())), places[number].tolist()
            raise ConfigError(f"{_name(bodies, number)}: expected room at its start ({x:g}, {y:g}), got {other} there")


def _name(bodies: tuple[Body, ...], number: int) -> str:
    return f"body {number} ({bodies[number].motion.name})"
