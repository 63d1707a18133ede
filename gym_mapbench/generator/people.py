"""People on a map: sampled walks that stay off the walls, and leave start and goal clear for the first seconds."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.distance import squared_distance
from gym_mapbench.quantities import Fraction
from gym_mapbench.settings import Settings
from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.clearance import CLEAR_TIMES
from gym_mapbench.world.courses import find_wall
from gym_mapbench.world.crowd import place_crowd
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.pedestrians import WalkingSpeed
from gym_mapbench.world.scenario import Scenario

MAX_TRIES = 200
"""Samples of a person before the map counts as full."""
TASK_ROOM = 1.0
"""Distance from the centres of start and goal that a person keeps at first, m."""
SPARE = 0.05
"""Room between a person's waypoints and the walls, m."""
SIGHTS = 40
"""Cells that are tried as the end of a leg."""
LEG = (1.0, 5.0)
"""Shortest and longest way from one waypoint to the next, m."""
REACH = (0.3, 1.5)
"""Smallest and largest reach of a wander, m."""
Floats = NDArray[np.float64]
DIGITS = 3
"""Decimals of sampled options: a millimetre is enough."""


class PeopleSettings(Settings):
    """The people on sampled maps.

    Args:
        count: Number of people on a new map, fewer where the map has no room for more; 0 for none.
        speed: Slowest and fastest speed, m/s.
        radius: Radius of a person, m.
        wander: Share of people who wander; the others walk between waypoints.
        mutation: Probability that a mutation changes a person, and not the walls.
    """

    count: Annotated[int, Field(ge=0, le=50)] = 0
    speed: tuple[WalkingSpeed, WalkingSpeed] = (0.3, 1.3)
    radius: Annotated[float, Field(gt=0, le=1)] = 0.25
    wander: Fraction = 0.25
    mutation: Fraction = 0.5

    @field_validator("speed")
    @classmethod
    def _ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value[0] > value[1]:
            raise ConfigError(f"expected (slowest, fastest), got {value}")
        return value


def with_people(
    scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator, kept: tuple[Body, ...] = ()
) -> Scenario:
    """Return the scenario with people on it: those kept who still fit, and new ones up to ``count``.

    Args:
        scenario: Map and task.
        settings: How many people, and how they walk.
        rng: Source of all randomness.
        kept: People of an earlier version of the map.

    Returns:
        The scenario; with fewer people, or none, where the map has no room for more.
    """
    people = tuple(body for body in kept if find_wall(scenario.map, body) == "")
    wanted = len(kept) if kept else settings.count
    while len(people) < wanted:
        person = draw_person(scenario, people, settings, rng)
        if person is None:
            break
        people += (person,)
    return replace(scenario, bodies=people)


def draw_person(
    scenario: Scenario, others: tuple[Body, ...], settings: PeopleSettings, rng: np.random.Generator
) -> Body | None:
    """Sample one more person; None if none of 200 samples fits."""
    room = room_in(scenario.map, settings.radius)
    for _ in range(MAX_TRIES if (room > 0).any() else 0):
        name = "wander" if rng.random() < settings.wander else "scripted"
        options = (_draw_wander if name == "wander" else _draw_walk)(scenario.map, room, rng)
        motion = MotionSpec(name=name, options={**options, **_pace(settings, rng)})
        person = Body(shape=Disc(radius=settings.radius), motion=motion)
        if fits(scenario, person, others):
            return person
    return None


def room_in(grid: GridMap, radius: float) -> Floats:
    """Return how far a person in the middle of each cell is from the walls, ``(rows, cols)`` m; 0 where too near."""
    walls = np.sqrt(squared_distance(grid.framed)[1:-1, 1:-1]) - 1.0
    room: Floats = np.maximum(walls * grid.resolution - radius - SPARE, 0.0)
    return room


def fits(scenario: Scenario, person: Body, others: tuple[Body, ...]) -> bool:
    """Whether a person stays off the walls, starts outside others, and leaves start and goal clear at first."""
    if find_wall(scenario.map, person):
        return False
    places = place_crowd(scenario.map, [person, *others], CLEAR_TIMES)[:, :, :2]
    task = np.array([scenario.start[:2], scenario.goal[:2]])
    near_task = np.hypot(*np.moveaxis(places[:, :1] - task, 2, 0)).min() < TASK_ROOM + person.shape.radius
    apart = np.hypot(*(places[0, 1:] - places[0, 0]).T)
    return not near_task and all(apart > [person.shape.radius + other.shape.radius for other in others])


def _draw_walk(grid: GridMap, room: Floats, rng: np.random.Generator) -> dict[str, Any]:
    """Sample waypoints of a scripted walk: two to four cells, each in sight of the one before where one is found."""
    cells = np.argwhere(room > 0)
    waypoints = [cells[rng.integers(len(cells))]]
    for _ in range(int(rng.integers(1, 3, endpoint=True))):
        tried = cells[rng.integers(len(cells), size=SIGHTS)]
        away = np.hypot(*(tried - waypoints[-1]).T) * grid.resolution
        seen = [end for end in tried[(away >= LEG[0]) & (away <= LEG[1])] if _in_sight(waypoints[-1], end, room)]
        waypoints += seen[:1]
    if len(waypoints) == 1:
        waypoints *= 2
    return {"waypoints": [_point(grid, cell) for cell in waypoints]}


def _in_sight(start: NDArray[np.int64], end: NDArray[np.int64], room: Floats) -> bool:
    """Whether there is room for a person on every cell of a straight line between two cells."""
    steps = 2 * int(np.abs(end - start).max()) + 1
    rows, cols = np.rint(np.linspace(start, end, steps)).astype(np.int64).T
    return bool((room[rows, cols] > 0).all())


def _draw_wander(grid: GridMap, room: Floats, rng: np.random.Generator) -> dict[str, Any]:
    """Sample centre, reach and seed of a wander that stays off the walls."""
    cells = np.argwhere(room > 0)
    cell = cells[rng.integers(len(cells))]
    reach = round(float(min(rng.uniform(*REACH), room[tuple(cell)])), DIGITS)
    return {"centre": _point(grid, cell), "reach": max(reach, 0.001), "seed": int(rng.integers(2**31))}


def _point(grid: GridMap, cell: NDArray[np.int64]) -> list[float]:
    """Return the middle of a cell, x, y (m)."""
    return [round(value, DIGITS) for value in grid.cell_to_world(int(cell[0]), int(cell[1]))]


def _pace(settings: PeopleSettings, rng: np.random.Generator) -> dict[str, float]:
    """Sample speed (m/s) and phase."""
    speed = min(max(round(float(rng.uniform(*settings.speed)), DIGITS), settings.speed[0]), settings.speed[1])
    return {"speed": speed, "phase": round(float(rng.uniform(0.0, 0.999)), DIGITS)}
