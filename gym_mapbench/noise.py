"""Noise: what differs from run to run when it is switched on. All of it is off by default."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from gym_mapbench.registry import Registry, must_be
from gym_mapbench.scenario import Pose, wrap_angle
from gym_mapbench.settings import Settings

Deviation = Annotated[float, Field(ge=0, le=1e3)]


class NoiseSettings(Settings):
    """Standard deviations of normal distributions; 0 switches that noise off.

    Args:
        start_xy: Of the start position along x and y, m.
        start_yaw: Of the start heading, rad.
        pose_xy: Of the estimated position along x and y, m.
        pose_yaw: Of the estimated heading, rad.
        odometry_v: Of the measured forward speed, m/s.
        odometry_w: Of the measured turn rate, rad/s.
        actuation_v: Of the factor on the commanded forward speed.
        actuation_w: Of the factor on the commanded turn rate.
        scan: Of every range of the lidar, m.
    """

    start_xy: Deviation = 0.0
    start_yaw: Deviation = 0.0
    pose_xy: Deviation = 0.0
    pose_yaw: Deviation = 0.0
    odometry_v: Deviation = 0.0
    odometry_w: Deviation = 0.0
    actuation_v: Deviation = 0.0
    actuation_w: Deviation = 0.0
    scan: Deviation = 0.0


_LEVELS: dict[str, NoiseSettings] = {
    "none": NoiseSettings(),
    # An indoor robot of the TurtleBot3's kind: the LDS-01 is good for 15 mm below 0.5 m, AMCL for about a cell.
    "nominal": NoiseSettings(
        start_xy=0.02,
        start_yaw=0.03,
        pose_xy=0.01,
        pose_yaw=0.01,
        odometry_v=0.01,
        odometry_w=0.02,
        actuation_v=0.03,
        actuation_w=0.03,
        scan=0.015,
    ),
}

NOISES: Registry[NoiseSettings] = Registry("noise", "noise_levels", _LEVELS, check=must_be(NoiseSettings))


def make_noise(name: str) -> NoiseSettings:
    """Return a preset by name.

    Raises:
        ConfigError: If there is no such preset.
    """
    return NOISES.get(name)


def disturb_pose(pose: Pose, xy: float, yaw: float, rng: np.random.Generator) -> Pose:
    """Add normal noise to a pose; nothing is drawn where both deviations (m, rad) are 0."""
    if not (xy or yaw):
        return pose
    dx, dy, turn = rng.standard_normal(3)
    return Pose(float(pose.x + xy * dx), float(pose.y + xy * dy), wrap_angle(pose.yaw + yaw * turn))


def disturb_velocity(
    velocity: tuple[float, float], v: float, w: float, rng: np.random.Generator
) -> tuple[float, float]:
    """Add normal noise to speed and turn rate; nothing is drawn where both deviations are 0."""
    if not (v or w):
        return velocity
    dv, dw = rng.standard_normal(2)
    return float(velocity[0] + v * dv), float(velocity[1] + w * dw)


def disturb_command(command: tuple[float, float], v: float, w: float, rng: np.random.Generator) -> tuple[float, float]:
    """Scale speed and turn rate by normal factors around 1; nothing is drawn where both deviations are 0."""
    if not (v or w):
        return command
    dv, dw = rng.standard_normal(2)
    return float(command[0] * (1 + v * dv)), float(command[1] * (1 + w * dw))


def disturb_ranges(
    ranges: NDArray[np.float32], deviation: float, range_max: float, rng: np.random.Generator
) -> NDArray[np.float32]:
    """Add normal noise to ranges ``(beams,)`` m that hit something; the result stays within 0 and ``range_max``."""
    if not deviation:
        return ranges
    noisy = ranges + np.float32(deviation) * rng.standard_normal(len(ranges), dtype=np.float32)
    return np.where(ranges < range_max, np.clip(noisy, 0.0, np.float32(range_max)), ranges)
