"""The robot as Gazebo gets it: the outline and limits of a RobotSpec on two driven wheels and two casters."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from gym_mapbench.world.lidar import LidarSettings
from gym_mapbench.world.robot import RobotSpec

WHEEL_RADIUS = 0.033
"""Radius of a TurtleBot3's wheels, m; the largest one."""
WHEEL_SHARE = 0.1
"""Largest radius of a wheel by the width of the robot: the wheels stand 3/8 of the width beside its centre."""

CHASSIS_HEIGHT = 0.12
GROUND_CLEARANCE = 0.01
LIDAR_Z = 0.16
NEAREST_RANGE = 0.05
"""Shortest range of a scanner that has none of its own, m; the simulators require one."""
SCAN_RATE = 10.0
"""Rate of a scanner that has none of its own, Hz."""
MASS = 3.0
WHEEL_MASS = 0.1


@dataclass(frozen=True)
class RobotModel:
    """Sizes and masses of the simulated robot; m, kg, kg m^2.

    Args:
        spec: The robot it stands for.
        back: x of the rear end of the chassis in the robot's frame, negative.
        front: x of its front end.
        right: y of its right side, negative.
        left: y of its left side.
        lidar: Its scanner, at its place on the robot.
    """

    spec: RobotSpec
    back: float
    front: float
    right: float
    left: float
    lidar: LidarSettings

    chassis_height: float = CHASSIS_HEIGHT
    lidar_z: float = LIDAR_Z
    mass: float = MASS
    wheel_mass: float = WHEEL_MASS

    @classmethod
    def of(cls, spec: RobotSpec, lidar: LidarSettings) -> RobotModel:
        """Build from a robot: a cylinder for a disc, the box around the polygon otherwise.

        The lidar sits where the robot has it, unless it has a place of its own.
        """
        mounted = lidar.mounted(spec.lidar)
        if spec.footprint is None:
            return cls(spec, -spec.radius, spec.radius, *spec.sides, mounted)
        along = np.asarray(spec.footprint)[:, 0]
        return cls(spec, float(along.min()), float(along.max()), *spec.sides, mounted)

    @property
    def length(self) -> float:
        """Length of the chassis along x; the diameter of a disc."""
        return self.front - self.back

    @property
    def width(self) -> float:
        """Width of the chassis along y; the diameter of a disc."""
        return self.left - self.right

    @property
    def chassis_x(self) -> float:
        """Distance of the middle of the chassis from the axle, forwards."""
        return (self.front + self.back) / 2

    @property
    def chassis_y(self) -> float:
        """The same to the left."""
        return (self.left + self.right) / 2

    @property
    def wheel_radius(self) -> float:
        """Radius of the wheels, which lie inside the outline."""
        narrow = 2 * min(self.left, -self.right)
        return min(WHEEL_RADIUS, WHEEL_SHARE * narrow, self.front, -self.back)

    @property
    def lidar_pose(self) -> tuple[float, float, float, float]:
        """x, y, z, yaw of the lidar on the robot, m and rad."""
        x, y, yaw = self.lidar.place
        return x, y, self.lidar_z, yaw

    @property
    def lidar_angles(self) -> tuple[float, float]:
        """Angles of the first and the last beam, rad."""
        return self.lidar.angle_min, self.lidar.angle_min + (self.lidar.beams - 1) * self.lidar.beam_angle

    @property
    def lidar_ranges(self) -> tuple[float, float]:
        """Shortest and longest distance that the lidar measures, m."""
        return self.lidar.range_min or NEAREST_RANGE, self.lidar.range_max

    @property
    def scan_rate(self) -> float:
        """Scans per second."""
        return self.lidar.scan_rate or SCAN_RATE

    @property
    def box(self) -> bool:
        """Whether the chassis is a box, not a cylinder."""
        return self.spec.footprint is not None

    @property
    def chassis_z(self) -> float:
        """Height of the middle of the chassis."""
        return round(GROUND_CLEARANCE + self.chassis_height / 2, 6)

    @property
    def casters(self) -> dict[str, float]:
        """Place of the casters along x, one before and one behind the axle."""
        return {"front": 0.7 * self.front, "back": 0.7 * self.back}

    @property
    def caster_radius(self) -> float:
        """Radius of the caster balls, which stand out of the chassis by the ground clearance."""
        return 2 * GROUND_CLEARANCE

    @property
    def moments(self) -> tuple[float, float, float]:
        """Moments of inertia of the chassis, taken as a solid box or cylinder."""
        x, y, z = self.length, self.width, self.chassis_height
        if self.box:
            return self._thirds(y, z), self._thirds(x, z), self._thirds(x, y)
        side = self.mass * (3 * (x / 2) ** 2 + z**2) / 12
        return side, side, self.mass * (x / 2) ** 2 / 2

    @property
    def wheel_moments(self) -> tuple[float, float, float]:
        """Moments of inertia of a wheel, taken as a solid ball."""
        moment = 0.4 * self.wheel_mass * self.wheel_radius**2
        return moment, moment, moment

    def describe(self) -> str:
        """Say the outline in words."""
        if self.box:
            across = f"y from {self.right:g} to {self.left:g} m"
            return f"the box around the footprint, x from {self.back:g} to {self.front:g} m, {across}"
        return f"a disc of radius {self.length / 2:g} m"

    def _thirds(self, a: float, b: float) -> float:
        return self.mass * (a**2 + b**2) / 12
