"""RobotSpec: shape and limits of the robot, with presets by name and files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pydantic import field_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.files.documents import read_yaml
from gym_mapbench.quantities import NonNegative, Positive
from gym_mapbench.registry import Registry, must_be
from gym_mapbench.settings import Settings


class LidarMount(Settings):
    """Where a robot's scanner sits, and how near it sees; by default at the centre, and from 0 m on.

    Args:
        x: Place in the robot's frame, m forwards of its centre.
        y: The same, m to the left.
        yaw: Heading in the robot's frame, rad.
        range_min: Shortest distance it measures, m.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0
    range_min: NonNegative = 0.0


class RobotSpec(Settings):
    """A differential-drive robot: a disc, or a convex polygon where ``footprint`` is given.

    The limits are those of the wheels; commands beyond them are clipped.

    Args:
        name: Its name in tables.
        radius: Radius of the disc, m; ignored where ``footprint`` is given.
        footprint: Convex polygon, ``((x, y), ...)`` m in the robot frame, or None.
        max_linear_velocity: Top speed forwards, m/s.
        max_reverse_velocity: Top speed backwards, m/s, as a positive number.
        max_angular_velocity: Top turn rate, rad/s.
        max_linear_acceleration: Largest change of the speed, m/s^2, for speeding up and for braking.
        max_angular_acceleration: Largest change of the turn rate, rad/s^2.
        lidar: Where its scanner sits; used where the noise's ``lidar_mount`` is ``robot``, as in ``nominal``.
    """

    name: str = "custom"
    radius: Positive = 0.22
    footprint: tuple[tuple[float, float], ...] | None = None
    max_linear_velocity: Positive = 0.5
    max_reverse_velocity: NonNegative = 0.35
    max_angular_velocity: Positive = 1.9
    max_linear_acceleration: Positive = 2.5
    max_angular_acceleration: Positive = 3.2
    lidar: LidarMount = LidarMount()

    @field_validator("footprint")
    @classmethod
    def _convex(cls, value: tuple[tuple[float, float], ...] | None) -> tuple[tuple[float, float], ...] | None:
        if value is not None and not _is_convex_around_origin(np.asarray(value)):
            raise ConfigError("expected 3 to 8 corners of a convex polygon around (0, 0)")
        return value

    @property
    def shape(self) -> str:
        """The outline in words."""
        if self.footprint is None:
            return f"radius {self.radius:g} m"
        return "footprint " + " ".join(f"({x:g}, {y:g})" for x, y in self.footprint)

    @property
    def sides(self) -> tuple[float, float]:
        """The smallest and the largest y of the outline, m: how far it reaches to the right and to the left."""
        if self.footprint is None:
            return -self.radius, self.radius
        across = np.asarray(self.footprint)[:, 1]
        return float(across.min()), float(across.max())

    @property
    def width(self) -> float:
        """Twice the largest distance of the outline from the line through its centre along its heading, m."""
        right, left = self.sides
        return 2 * max(left, -right)

    @property
    def wheel_separation(self) -> float:
        """Distance between the wheels, m: three quarters of the width, as on a TurtleBot3.

        The width is that of the narrower side, so that both wheels lie inside an outline that is not symmetric.
        """
        right, left = self.sides
        return 0.75 * 2 * min(left, -right)

    @property
    def circumscribed_radius(self) -> float:
        """Largest distance of the robot's outline from its centre, m."""
        if self.footprint is None:
            return self.radius
        return float(np.hypot(*np.asarray(self.footprint).T).max())


def _is_convex_around_origin(corners: NDArray[np.float64]) -> bool:
    """Whether all corners turn the same way, once around the origin; Box2D takes at most 8."""
    if corners.ndim != 2 or not 3 <= len(corners) <= 8:
        return False
    edges = np.roll(corners, -1, axis=0) - corners
    after = np.roll(edges, -1, axis=0)
    turns = edges[:, 0] * after[:, 1] - edges[:, 1] * after[:, 0]
    sides = edges[:, 0] * -corners[:, 1] + edges[:, 1] * corners[:, 0]
    once = np.abs(np.arctan2(turns, (edges * after).sum(axis=1)).sum()) < 3 * np.pi
    return bool(once and (((turns > 0).all() and (sides > 0).all()) or ((turns < 0).all() and (sides < 0).all())))


_PRESETS: dict[str, RobotSpec] = {
    # Nav2's example (nav2_bringup/params/nav2_params.yaml): the radius of its costmaps, MPPI's and RPP's top speed.
    # The scanners of both TurtleBot3: turtlebot3_description/urdf (base_scan); LDS-01's data sheet: 0.12 m.
    "turtlebot3_waffle": RobotSpec(name="turtlebot3_waffle", lidar=LidarMount(x=-0.064, range_min=0.12)),
    # The Waffle that Nav2 spawns in gz: nav2_minimal_tb3_sim/urdf/gz_waffle.sdf.xacro, limits of its DiffDrive.
    "turtlebot3_waffle_gz": RobotSpec(
        name="turtlebot3_waffle_gz",
        max_linear_velocity=0.46,
        max_reverse_velocity=0.46,
        max_linear_acceleration=1.0,
        max_angular_acceleration=2.0,
        lidar=LidarMount(x=-0.064, range_min=0.12),
    ),
    # ROBOTIS e-manual: 0.22 m/s, 2.84 rad/s; the 138 mm x 178 mm base fits a disc of 0.105 m. Scanner and wheel
    # separation (0.160 m, here 0.158): turtlebot3_gazebo/models/turtlebot3_burger/model.sdf, whose DiffDrive
    # accelerates by at most 1 m/s^2 and has its axle 0.032 m before the middle.
    "turtlebot3_burger": RobotSpec(
        name="turtlebot3_burger",
        radius=0.105,
        max_linear_velocity=0.22,
        max_reverse_velocity=0.22,
        max_angular_velocity=2.84,
        lidar=LidarMount(x=-0.032, range_min=0.12),
    ),
    # BARN Challenge: half sizes 0.21 m x 0.165 m. Speeds and accelerations: jackal_control/config/control.yaml. With
    # the wheels of jackal_description/urdf/jackal.urdf.xacro the half sizes are 0.229 m x 0.208 m.
    "jackal": RobotSpec(
        name="jackal",
        radius=0.267,
        footprint=((0.21, 0.165), (-0.21, 0.165), (-0.21, -0.165), (0.21, -0.165)),
        max_linear_velocity=2.0,
        max_reverse_velocity=2.0,
        max_angular_velocity=4.0,
        max_linear_acceleration=20.0,
        max_angular_acceleration=25.0,
    ),
}

ROBOTS: Registry[RobotSpec] = Registry("robot", "robots", _PRESETS, check=must_be(RobotSpec))


def make_robot(name: str) -> RobotSpec:
    """Return a preset by name, or the robot of a YAML file, which is called by the file's name unless it says another.

    Raises:
        ConfigError: If there is no such preset or file, or the file does not hold the options of a robot.
    """
    if name.endswith((".yaml", ".yml")):
        document = read_yaml(name)
        options = {"name": Path(name).stem, **document} if isinstance(document, Mapping) else document
        return RobotSpec.from_mapping(options, name)
    return ROBOTS.get(name)
