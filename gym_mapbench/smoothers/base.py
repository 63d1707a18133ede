"""The interface of a path smoother, and functions that Nav2's smoothers share.

Source: nav2_core smoother.hpp; nav2_smoother/include/nav2_smoother/smoother_utils.hpp (Humble and Jazzy); nav2_util
path_utils (Lyrical).
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple, Protocol

import numpy as np

from gym_mapbench.costmap import Costmap
from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.planners.base import Path
from gym_mapbench.ros_params import RosPlugin
from gym_mapbench.settings import Settings

SAME = 1e-4
"""Distance along each axis, m, and turn, rad, up to which two poses are the same."""


class Smoothed(NamedTuple):
    """What a smoother made of a path.

    Args:
        path: The path, ``(n, 3)`` x, y in m and yaw in rad.
        was_completed: Whether the smoother came to its end.
    """

    path: Path
    was_completed: bool = True


class PathSmoother(Protocol):
    """A smoother plugin in Nav2's sense (``nav2_core::Smoother``)."""

    def smooth(self, costmap: Costmap, path: Path) -> Smoothed:
        """Return a smoothed path; ``path``, ``(n, 3)`` with n > 0, and ``costmap`` stay as they are.

        Raises:
            SmoothingError: If the path cannot be smoothed.
        """
        ...


class SmootherEntry(NamedTuple):
    """A kind of smoother, as the registry holds it.

    Args:
        params: The class of its options.
        make: Makes the smoother from its options.
        nav2: How parameter files of Nav2 name and hold the smoother; None if Nav2 has no such smoother.
    """

    params: type[Settings]
    make: Callable[[Any], PathSmoother]
    nav2: RosPlugin | None = None


def segments_of(path: Path, *, cut: bool, longer_than: int) -> Iterator[slice]:
    """Yield the parts of a path that are smoothed, each by itself; neighbours share a pose.

    Args:
        path: The path.
        cut: Whether to cut it where the robot changes its direction or turns on the spot.
        longer_than: Number of steps above which a part is smoothed.
    """
    ends = [0, *(_cuts(path) if cut else ()), len(path) - 1]
    return (slice(begin, end + 1) for begin, end in itertools.pairwise(ends) if end - begin > longer_than)


def _cuts(path: Path) -> list[int]:
    """Return the indices of the poses at which a path is cut (``findDirectionalPathSegments``)."""
    steps, turns = np.diff(path[:, :2], axis=0), np.diff(path[:, 2])
    back = (steps[:-1] * steps[1:]).sum(axis=1) < 0.0
    stands = (np.abs(steps[1:]) < SAME).all(axis=1)
    turned = np.abs(np.angle(np.exp(1j * turns[1:]))) > SAME
    cuts: list[int] = (np.flatnonzero(back | (stands & turned)) + 1).tolist()
    return cuts


def turn_along(path: Path) -> None:
    """Turn each pose of a path of three or more to the next; the last stays (``updateApproximatePathOrientations``).

    The path is driven backwards if its second pose faces away from the third; a pose on top of the next keeps its yaw.
    """
    steps = np.diff(path[:, :2], axis=0)
    yaws = np.arctan2(steps[:, 1], steps[:, 0])
    if abs(normalize_angle(yaws[1] - path[1, 2])) > math.pi / 2:
        yaws += np.where(yaws > 0.0, -math.pi, math.pi)
    moves = (np.abs(steps) >= SAME).any(axis=1)
    path[:-1, 2] = np.where(moves, yaws, path[:-1, 2])
