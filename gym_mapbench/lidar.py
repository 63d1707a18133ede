"""The laser scanner: exact distances to the walls of the grid."""

from __future__ import annotations

import functools
import math
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gym_mapbench.gridmap import GridMap
from gym_mapbench.kernels.raycast import cast_rays
from gym_mapbench.scenario import Pose
from gym_mapbench.settings import Settings


class LidarSettings(Settings):
    """A planar scanner at the robot's centre; the defaults are the TurtleBot3's LDS-01.

    Args:
        beams: Number of beams, counter-clockwise from ``angle_min``.
        range_max: Largest distance, m; also what a beam that hits nothing says.
        angle_min: Angle of the first beam to the robot's heading, rad.
        angle_increment: Angle from beam to beam, rad; None spreads them over a full turn.
        scan_rate: Scans per second; in between the last one is observed again, as with a real scanner (the
            LDS-01 turns at 5 Hz). None: every observation has its own.
    """

    beams: Annotated[int, Field(ge=1, le=100_000)] = 360
    range_max: Annotated[float, Field(gt=0, le=1e6)] = 3.5
    angle_min: float = 0.0
    angle_increment: float | None = None
    scan_rate: Annotated[float, Field(gt=0)] | None = None

    @property
    def angles(self) -> NDArray[np.float64]:
        """``(beams,)`` angle of every beam to the robot's heading, rad."""
        return self.angle_min + self.beam_angle * np.arange(self.beams, dtype=np.float64)

    @property
    def beam_angle(self) -> float:
        """Angle from beam to beam, rad."""
        return 2 * math.pi / self.beams if self.angle_increment is None else self.angle_increment


class Lidar:
    """A scanner on one map; cells off the map are walls, unknown cells are free.

    Args:
        settings: Beams and range.
        grid: The map.
    """

    def __init__(self, settings: LidarSettings, grid: GridMap) -> None:
        self._range_max = settings.range_max
        self._beams = _directions(settings)
        self._walls = grid.framed
        self._resolution = grid.resolution
        self._origin = grid.origin

    def scan(self, pose: Pose) -> NDArray[np.float32]:
        """Return ``(beams,)`` distances from a pose on the map, m, in a new array."""
        ranges = np.empty(len(self._beams), dtype=np.float32)
        cast_rays(
            self._walls, self._resolution, *self._origin, pose.x, pose.y, pose.yaw, self._beams, self._range_max, ranges
        )
        return ranges


@functools.lru_cache(maxsize=8)
def _directions(settings: LidarSettings) -> NDArray[np.float64]:
    """``(beams, 2)`` cosine and sine of every beam's angle; kept, as every episode begins with a new Lidar."""
    directions: NDArray[np.float64] = np.stack([np.cos(settings.angles), np.sin(settings.angles)], axis=1)
    directions.flags.writeable = False
    return directions
