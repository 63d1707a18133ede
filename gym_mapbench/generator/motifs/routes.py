"""Routes: the line from start to goal along which motifs are repeated."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.quantities import SignedFraction
from gym_mapbench.settings import Settings

RouteName = Literal["diagonal", "straight", "bent"]
Point = NDArray[np.float64]
UP, LEFT = np.array([0.0, 1.0]), np.array([-1.0, 0.0])


class Route(Settings):
    """The genes of a route.

    Args:
        name: ``diagonal``: the straight line from start to goal, with walls parallel to a side of the map, which the
            robot crosses at about 45 degrees. ``straight``: the same line, with walls at right angles to it. ``bent``:
            two legs, with walls at right angles to each leg.
        mirrored: Whether walls on a ``diagonal`` route run from bottom to top instead of from left to right.
        bend: How far a ``bent`` route leaves the straight line: 1 is the upper right corner, -1 the lower left one.
    """

    name: RouteName
    mirrored: bool = False
    bend: SignedFraction = 0.0


@dataclass(frozen=True, eq=False)
class Leg:
    """A straight part of a route.

    Args:
        start: ``(x, y)``, m.
        end: ``(x, y)``, m.
        along: Unit vector at right angles to the walls; progress is measured in its direction.
    """

    start: Point
    end: Point
    along: Point

    @cached_property
    def across(self) -> Point:
        """The unit vector to the left of ``along``."""
        return np.array([-self.along[1], self.along[0]])

    @cached_property
    def length(self) -> float:
        """Progress from start to end, m."""
        return float((self.end - self.start) @ self.along)

    @cached_property
    def breadth(self) -> float:
        """Extent along the leg of a square with sides of 1 m that are parallel to those of the map, m."""
        return float(np.abs(self.along).sum())

    def at(self, progress: float) -> Point:
        """Return the point of the leg at a progress in m."""
        return self.start + (self.end - self.start) * (progress / self.length)


def legs_of(route: Route, start: Sequence[float], goal: Sequence[float]) -> tuple[Leg, ...]:
    """Return the legs of a route.

    Args:
        route: Its genes.
        start: ``(x, y)``, m, right of and below the goal.
        goal: ``(x, y)``, m.
    """
    first, last = np.array(start, dtype=np.float64), np.array(goal, dtype=np.float64)
    if route.name == "diagonal":
        return (Leg(first, last, LEFT if route.mirrored else UP),)
    if route.name == "straight":
        return (_leg(first, last),)
    middle = (first + last) / 2
    corner = np.array([first[0], last[1]])
    via = middle + route.bend * (corner - middle)
    return _leg(first, via), _leg(via, last)


def _leg(start: Point, end: Point) -> Leg:
    """Return a leg whose walls are at right angles to it."""
    way = end - start
    return Leg(start, end, way / float(np.sqrt(way @ way)))
