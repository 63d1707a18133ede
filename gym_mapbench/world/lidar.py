"""The laser scanner: exact distances to walls and bodies, and what it reports of them."""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.bodies import cast_rays_among
from gym_mapbench.kernels.raycast import cast_rays
from gym_mapbench.quantities import Positive
from gym_mapbench.settings import Settings
from gym_mapbench.world.frames import IDENTITY, compose
from gym_mapbench.world.robot import LidarMount
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World


class LidarSettings(Settings):
    """A planar scanner on the robot; the defaults are the TurtleBot3's LDS-01.

    ``x``, ``y``, ``yaw`` and ``range_min`` are None where the noise level decides them: either the robot's centre and
    0 m, or the values of the robot's own scanner. :meth:`mounted` fills them in.

    Args:
        beams: Number of beams, counter-clockwise from ``angle_min``.
        x: Place of the scanner in the robot's frame, m forwards of its centre.
        y: The same, m to the left.
        yaw: Heading of the scanner in the robot's frame, rad.
        range_min: Shortest distance, m; nothing nearer is measured.
        range_max: Largest distance, m; also reported for a beam that hits nothing.
        no_reading: What is reported for a beam that is lost, or hits something nearer than ``range_min``.
            ``range_max``: as if nothing was there, like drivers that report infinity. ``zero``: 0 m, as LDS-01 and
            LDS-02 do.
        angle_min: Angle of the first beam to the scanner's heading, rad.
        angle_increment: Angle from beam to beam, rad; None spreads them over a full turn.
        scan_rate: Scans per second; between two scans the last one is observed again, as with a real scanner (the
            LDS-01 turns at 5 Hz). The time between two scans is rounded to whole control steps, so 15 Hz are 20 Hz
            where ``control_hz`` is 20. None: every observation has its own.
    """

    beams: Annotated[int, Field(ge=1, le=100_000)] = 360
    range_max: Annotated[float, Field(gt=0, le=1e6)] = 3.5
    x: float | None = None
    y: float | None = None
    yaw: float | None = None
    range_min: Annotated[float, Field(ge=0, le=1e6)] | None = None
    no_reading: Literal["range_max", "zero"] = "range_max"
    angle_min: float = 0.0
    angle_increment: float | None = None
    scan_rate: Positive | None = None

    @property
    def angles(self) -> NDArray[np.float64]:
        """``(beams,)`` angle of every beam to the scanner's heading, rad."""
        return self.angle_min + self.beam_angle * np.arange(self.beams, dtype=np.float64)

    @cached_property
    def beam_angle(self) -> float:
        """Angle from beam to beam, rad."""
        return 2 * math.pi / self.beams if self.angle_increment is None else self.angle_increment

    @property
    def no_range(self) -> float:
        """What is reported for a beam without a reading, m."""
        return self.range_max if self.no_reading == "range_max" else 0.0

    @cached_property
    def place(self) -> Pose:
        """Pose of the scanner in the robot's frame; None counts as 0."""
        return Pose(self.x or 0.0, self.y or 0.0, self.yaw or 0.0)

    @model_validator(mode="after")
    def _ranges_in_order(self) -> LidarSettings:
        if self.range_min is not None and self.range_min >= self.range_max:
            raise ConfigError(f"range_min: expected less than range_max {self.range_max:g}, got {self.range_min:g}")
        return self

    def sensor_pose(self, robot: Pose) -> Pose:
        """Return the pose of the scanner on a robot at ``robot``, in the same frame."""
        place = self.place
        return robot if place == IDENTITY else compose(robot, place)

    def mounted(self, mount: LidarMount) -> LidarSettings:
        """Return the scanner with values from ``mount`` in place of None."""
        return _mounted(self, mount)


class Lidar:
    """A scanner in one world; cells off the map are walls, unknown cells are free.

    Args:
        settings: Beams, ranges and place on the robot.
        world: What the scanner sees: walls, and bodies where they are at the moment of the scan.
    """

    def __init__(self, settings: LidarSettings, world: World) -> None:
        self._settings, self._world = settings, world
        self._beams = directions(settings)
        self._walls = world.grid.framed
        self._resolution = world.grid.resolution
        self._origin = world.grid.origin

    def scan(self, pose: Pose) -> NDArray[np.float32]:
        """Return ``(beams,)`` distances from the scanner of a robot at a pose on the map, m, in a new array."""
        ranges = np.empty(len(self._beams), dtype=np.float32)
        sensor, range_max = self._settings.sensor_pose(pose), self._settings.range_max
        walls = self._walls, self._resolution, *self._origin
        if self._world.bodies:
            bodies = self._world.poses, self._world.radii
            cast_rays_among(*walls, *sensor, self._beams, range_max, ranges, *bodies)
        else:
            cast_rays(*walls, *sensor, self._beams, range_max, ranges)
        return ranges


@lru_cache(maxsize=8)
def _mounted(settings: LidarSettings, mount: LidarMount) -> LidarSettings:
    """Return the settings with values from ``mount`` in place of None; cached, as every episode needs it."""
    return settings.replace(
        **{name: value for name, value in mount.model_dump().items() if getattr(settings, name) is None}
    )


@lru_cache(maxsize=8)
def directions(settings: LidarSettings) -> NDArray[np.float64]:
    """``(beams, 2)`` cosine and sine of every beam's angle; cached, as every episode begins with a new Lidar."""
    directions: NDArray[np.float64] = np.stack([np.cos(settings.angles), np.sin(settings.angles)], axis=1)
    directions.flags.writeable = False
    return directions
