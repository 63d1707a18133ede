"""Scenario and MapSet: a map with a task on it, and a tuple of scenarios, the individual of a search."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from gym_mapbench.errors import ConfigError, visible
from gym_mapbench.kernels.geometry import wrap_angle as wrap_angle_kernel
from gym_mapbench.kernels.jit import plain
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap

_wrap = plain(wrap_angle_kernel)


class Pose(NamedTuple):
    """Position in m and heading in rad, counter-clockwise from +x."""

    x: float
    y: float
    yaw: float = 0.0


@dataclass(frozen=True)
class Scenario:
    """One navigation task: drive from ``start`` to ``goal`` on ``map``, among ``bodies`` that move.

    Args:
        map: The walls.
        start: Where the robot starts, m, rad.
        goal: Where it shall go, m, rad.
        name: Name in tables and files.
        bodies: What moves besides the robot; see :mod:`gym_mapbench.world.bodies`.
        genome: The genes that the map was built from; None if it has none. It is no part of the identity.

    Raises:
        ConfigError: If the map is not a GridMap, start or goal is not finite, off the map, or in an occupied cell, or a
            body is not a Body.
    """

    map: GridMap
    start: Pose
    goal: Pose
    name: str = "map"
    bodies: tuple[Body, ...] = ()
    genome: Genome | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        must_be_map(self.map)
        object.__setattr__(self, "name", visible(self.name))
        object.__setattr__(self, "bodies", tuple(self.bodies))
        for body in self.bodies:
            if not isinstance(body, Body):
                raise ConfigError(f"bodies: expected Body values, got {body!r:.80}")
        for what in ("start", "goal"):
            object.__setattr__(self, what, _pose_on(self.map, what, getattr(self, what)))

    @property
    def end_cells(self) -> tuple[tuple[int, int], tuple[int, int]]:
        """Cells ``(row, col)`` of start and goal."""
        start, goal = (self.map.world_to_cell(pose.x, pose.y) for pose in (self.start, self.goal))
        assert start is not None and goal is not None  # noqa: PT018, both are on the map
        return start, goal

    @cached_property
    def digest(self) -> str:
        """Content hash of map, bodies, start and goal (not of the name)."""
        return _hash(repr((self.world_digest, tuple(self.start), tuple(self.goal))))

    @cached_property
    def world_digest(self) -> str:
        """Content hash of map and bodies, which seeds are derived from; the map's own where there are no bodies."""
        if not self.bodies:
            return self.map.digest
        return _hash(repr((self.map.digest, [body.model_dump_json() for body in self.bodies])))


@dataclass(frozen=True)
class MapSet:
    """A tuple of scenarios: the individual of the search.

    Raises:
        ConfigError: If it is empty, or something in it is not a Scenario.
    """

    scenarios: tuple[Scenario, ...]

    def __post_init__(self) -> None:
        object.__setattr__(self, "scenarios", as_scenarios("map set", self.scenarios))

    @cached_property
    def digest(self) -> str:
        """Content hash that does not depend on the order of the maps."""
        return _hash("".join(sorted(scenario.digest for scenario in self)))

    def with_map(self, place: int, scenario: Scenario) -> MapSet:
        """Return the set with another map at a place."""
        return MapSet((*self.scenarios[:place], scenario, *self.scenarios[place + 1 :]))

    def __len__(self) -> int:
        return len(self.scenarios)

    def __iter__(self) -> Iterator[Scenario]:
        return iter(self.scenarios)

    def __getitem__(self, index: int) -> Scenario:
        return self.scenarios[index]


def must_be_map(grid: object) -> None:
    """Refuse what is not a map.

    Raises:
        ConfigError: If it is not a GridMap.
    """
    if not isinstance(grid, GridMap):
        raise ConfigError(f"map: expected a GridMap, got {type(grid).__name__}")


def as_scenarios(what: str, scenarios: object) -> tuple[Scenario, ...]:
    """Return several scenarios as a tuple.

    Args:
        what: What they are, for the error.
        scenarios: A MapSet, or any other iterable of scenarios.

    Raises:
        ConfigError: If it is something else, or empty.
    """
    if isinstance(scenarios, str | bytes | Mapping) or not isinstance(scenarios, Iterable):
        raise ConfigError(f"{what}: expected a MapSet or several Scenario values, got {type(scenarios).__name__}")
    found = tuple(scenarios)
    if not found:
        raise ConfigError(f"{what}: expected at least one scenario, got none")
    for number, scenario in enumerate(found):
        if not isinstance(scenario, Scenario):
            raise ConfigError(f"{what}.{number}: expected a Scenario, got {type(scenario).__name__}")
    return found


def _hash(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def _pose_on(grid: GridMap, what: str, pose: Pose) -> Pose:
    """Check one pose against a map; the yaw is wrapped to (-pi, pi]."""
    try:
        x, y, yaw = (float(value) for value in pose)
    except (TypeError, ValueError):
        raise ConfigError(f"{what}: expected (x, y, yaw) in m and rad, got {pose!r}") from None
    if not np.isfinite([x, y, yaw]).all():
        raise ConfigError(f"{what}: expected finite (x, y, yaw), got {pose!r}")
    cell = grid.world_to_cell(x, y)
    if cell is None:
        x0, y0, x1, y1 = grid.bounds
        raise ConfigError(
            f"{what}: expected a point on the map ({x0:g}..{x1:g} m, {y0:g}..{y1:g} m), got ({x:g}, {y:g})"
        )
    if grid.occupancy[cell]:
        raise ConfigError(f"{what}: expected a free cell, got an obstacle at ({x:g}, {y:g})")
    return Pose(x, y, wrap_angle(yaw))


def wrap_angle(angle: float) -> float:
    """Return an angle wrapped to (-pi, pi]; an angle in that range is unchanged, so saved poses keep their digest."""
    wrapped: float = _wrap(angle)
    return wrapped
