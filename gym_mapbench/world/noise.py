"""Noise of sensors, motors and localisation. All noise is off by default.

Each source of noise samples from a generator of its own, at a rate that does not depend on what the robot does. At
equal seeds, all controllers therefore meet the same noise at the same time. The noise of one source does not change
when another source is switched on or off (common random numbers).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, NamedTuple

import numpy as np
from pydantic import Field, model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.estimation import wander
from gym_mapbench.quantities import Fraction, NonNegative
from gym_mapbench.registry import Registry, must_be
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Pose, wrap_angle

Metres = Annotated[NonNegative, Field(le=1)]
Radians = Annotated[NonNegative, Field(le=math.pi)]
Seconds = Annotated[NonNegative, Field(le=3600)]
Speed = Annotated[NonNegative, Field(le=1)]

MOMENTS_AT_ONCE = 128


class NoiseSettings(Settings):
    """Errors of sensors, motors and localisation; by default all noise is off, and 0 switches a noise off.

    Deviations are standard deviations of normal distributions. A mapping may have the key ``level``, the name of one
    of :data:`NOISES`; its other values then replace those of the level.

    Args:
        odom_frame: Where the odom frame lies, in which wheel odometry counts and the local costmap lives.
            ``aligned``: at the start it is the map frame. ``random``: at the start it is shifted and turned
            against the map by any amount, as on a robot, which begins to count wherever it is switched on.
        start_xy: Deviation of the true start position along x and y, m.
        start_yaw: Deviation of the true start heading, rad.
        pose_xy: Deviation of the localisation's error along the map's x and y, m.
        pose_yaw: Deviation of the localisation's error in heading, rad.
        pose_time_constant: Time in which the autocorrelation of the localisation's error falls to 1/e, s; with 0
            any two errors are independent.
        update_min_d: Distance along an axis of the odom frame after which the localisation corrects itself, m (a
            parameter of AMCL, as the next). Between two corrections the estimate follows wheel odometry.
        update_min_a: Turn after which it corrects itself, rad.
        odometry_v: Deviation of the measured forward speed, m/s; independent at each control step, and not part of the
            odom pose.
        odometry_w: Deviation of the measured turn rate, rad/s; likewise.
        odometry_distance: Deviation of the relative error of the distance that wheel odometry counts; sampled once
            for a run, as wheels keep their diameter.
        odometry_turn: Deviation of the relative error of the turn that it counts; sampled once for a run, as the axle
            keeps its length.
        odometry_veer: Deviation of the turn that it counts for each metre driven straight on, rad/m; sampled once
            for a run, as one wheel stays larger than the other.
        actuation_v: Deviation of the relative error with which the commanded forward speed is carried out.
        actuation_w: The same for the commanded turn rate.
        actuation_time_constant: As ``pose_time_constant``, for these two errors.
        latency: Share of the control period for which the robot still obeys the previous command, rounded to whole
            physics steps. In seconds it depends on ``control_hz``: 0.2 is 0.01 s at 20 Hz and 0.04 s at 5 Hz.
        lidar_mount: Where the scanner is, unless ``lidar`` says so. ``centre``: at the robot's centre, and it sees
            from 0 m on. ``robot``: where the robot's own scanner is.
        scan: Deviation of each range of the lidar, m.
        scan_relative: The same as a share of the range; where both are given, their squares add up.
        scan_dropout: Probability that a beam has no reading.
    """

    odom_frame: Literal["aligned", "random"] = "aligned"
    start_xy: Metres = 0.0
    start_yaw: Radians = 0.0
    pose_xy: Metres = 0.0
    pose_yaw: Radians = 0.0
    pose_time_constant: Seconds = 0.0
    update_min_d: Metres = 0.25
    update_min_a: Radians = 0.2
    odometry_v: Speed = 0.0
    odometry_w: Speed = 0.0
    odometry_distance: Fraction = 0.0
    odometry_turn: Fraction = 0.0
    odometry_veer: Radians = 0.0
    actuation_v: Fraction = 0.0
    actuation_w: Fraction = 0.0
    actuation_time_constant: Seconds = 0.0
    latency: Fraction = 0.0
    lidar_mount: Literal["centre", "robot"] = "centre"
    scan: Metres = 0.0
    scan_relative: Fraction = 0.0
    scan_dropout: Fraction = 0.0

    @model_validator(mode="before")
    @classmethod
    def _on_top_of_a_level(cls, values: Any) -> Any:
        if not isinstance(values, Mapping) or "level" not in values:
            return values
        own = {key: value for key, value in values.items() if key != "level"}
        level = values["level"]
        if not isinstance(level, str):
            raise ConfigError(f"level: expected one of {', '.join(NOISES)}, got {level!r:.80}")
        return {**NOISES.get(level).model_dump(), **own}

    @property
    def drifts(self) -> bool:
        """Whether wheel odometry has errors."""
        return bool(self.odometry_distance or self.odometry_turn or self.odometry_veer)

    @property
    def samples(self) -> bool:
        """Whether any error is sampled."""
        deviations = (getattr(self, name) for name in _DEVIATIONS)
        return any(deviations) or self.odom_frame == "random"

    @property
    def knows_its_state(self) -> bool:
        """Whether ``pose``, ``odom`` and ``velocity`` are observed without errors."""
        wrong = self.pose_xy or self.pose_yaw or self.odometry_v or self.odometry_w
        return not (wrong or self.drifts or self.odom_frame == "random")

    @property
    def scans_exactly(self) -> bool:
        """Whether no range is disturbed and no beam is lost."""
        return not (self.scan or self.scan_relative or self.scan_dropout)

    @property
    def actuates_wrongly(self) -> bool:
        """Whether commands are carried out with errors."""
        return bool(self.actuation_v or self.actuation_w)


_DEVIATIONS = (
    *("start_xy", "start_yaw", "pose_xy", "pose_yaw", "odometry_v", "odometry_w"),
    *("odometry_distance", "odometry_turn", "odometry_veer", "actuation_v", "actuation_w"),
    *("scan", "scan_relative", "scan_dropout"),
)
_LEVELS: dict[str, NoiseSettings] = {
    "none": NoiseSettings(),
    # A well-maintained TurtleBot3.
    "nominal": NoiseSettings(
        odom_frame="random",
        start_xy=0.02,
        start_yaw=0.03,
        # Particle filters against external references: from millimetres with an industrial scanner and scan matching on
        # top (Roewekaemper et al., IROS 2012) to 6.7 cm in the mean with depth cameras (Schmitt et al., IPIN 2012). A
        # hobby scanner on a 5 cm grid lies between. The time constant is assumed: AMCL updates its particles every
        # 0.25 m, half a second to a second of driving, but keeps most of them.
        pose_xy=0.03,
        pose_yaw=0.02,
        pose_time_constant=5.0,
        # Two to three encoder ticks (4096 a turn, wheel radius 33 mm) in 50 ms.
        odometry_v=0.002,
        odometry_w=0.01,
        # On smooth floors systematic errors prevail; uncalibrated robots end a 16 m square 0.3 m off, 2 % (Borenstein
        # and Feng, UMBmark, 1996).
        odometry_distance=0.01,
        odometry_turn=0.02,
        odometry_veer=0.01,
        # Assumed, as no data sheet gives it: a few per cent of load and slip that last for seconds.
        actuation_v=0.03,
        actuation_w=0.03,
        actuation_time_constant=2.0,
        # Assumed: 10 ms of computing and messages in a period of 50 ms.
        latency=0.2,
        # Nav2's own simulation of the TurtleBot3: 10 mm at any range, no beam is lost.
        lidar_mount="robot",
        scan=0.01,
    ),
    # A poorly maintained TurtleBot3.
    "rough": NoiseSettings(
        odom_frame="random",
        start_xy=0.05,
        start_yaw=0.1,
        # Near the 6.7 cm given above.
        pose_xy=0.05,
        pose_yaw=0.035,
        pose_time_constant=3.0,
        odometry_v=0.01,
        odometry_w=0.02,
        # Twice the uncalibrated robot of UMBmark.
        odometry_distance=0.02,
        odometry_turn=0.04,
        odometry_veer=0.02,
        # Assumed, as above.
        actuation_v=0.06,
        actuation_w=0.06,
        actuation_time_constant=2.0,
        latency=0.6,
        # LDS-01, data sheet: 15 mm below 0.5 m, 5 % beyond, of which 3.5 % are precision; read as three deviations of
        # noise plus 10 mm of everything else. LDS-02: 10 mm below 0.3 m, 3 % beyond. That 2 % of beams are lost
        # (dark, shiny, slanting surfaces) is assumed.
        lidar_mount="robot",
        scan=0.01,
        scan_relative=0.012,
        scan_dropout=0.02,
    ),
}

NOISES: Registry[NoiseSettings] = Registry("noise", "noise_levels", _LEVELS, check=must_be(NoiseSettings))


def read_noise(value: str | Mapping[str, Any], where: str) -> NoiseSettings:
    """Return a level by name, or the settings of a mapping; ``where`` opens every error message.

    Raises:
        ConfigError: If there is no such level, or a setting is unknown or out of range.
    """
    return NOISES.get(value) if isinstance(value, str) else NoiseSettings.from_mapping(value, where)


class Streams(NamedTuple):
    """One generator for each source of noise."""

    start: np.random.Generator
    odom_frame: np.random.Generator
    localisation: np.random.Generator
    odometry: np.random.Generator
    velocity: np.random.Generator
    actuation: np.random.Generator
    scan: np.random.Generator
    dropout: np.random.Generator

    @classmethod
    def spawn(cls, rng: np.random.Generator, noise: NoiseSettings) -> Streams:
        """Return the generators, spawned from the env's generator, whose own numbers are not used up.

        Without noise, all of them are the env's generator itself: spawning takes as long as several steps.
        """
        count = len(cls._fields)
        return cls(*(rng.spawn(count) if noise.samples else [rng] * count))


class Wander:
    """An error with a time constant: an Ornstein-Uhlenbeck process that begins in its stationary distribution.

    Args:
        deviations: Stationary standard deviation of every component; where all are 0, nothing is sampled.
        time_constant: Seconds in which the correlation falls to 1/e; 0 for none at all.
        period: Seconds from one call of :meth:`advance` to the next.
        rng: Generator that the error is sampled from, many moments at once; nothing else samples from it.
    """

    def __init__(
        self, deviations: tuple[float, ...], time_constant: float, period: float, rng: np.random.Generator
    ) -> None:
        self.is_on = any(deviations)
        self._deviations, self._rng = np.array(deviations), rng
        self._kept = math.exp(-period / time_constant) if time_constant else 0.0
        self._fresh = math.sqrt(1.0 - self._kept**2)
        self._values = rng.standard_normal(len(deviations)) if self.is_on else np.zeros(len(deviations))
        self._errors = self._sample()

    def advance(self) -> list[float]:
        """Return the error of this moment and move on to the next."""
        return next(self._errors)

    def _sample(self) -> Iterator[list[float]]:
        """Sample the errors of all moments, many at once."""
        errors = np.zeros((MOMENTS_AT_ONCE, len(self._values)))
        while True:
            if self.is_on:
                normals = self._rng.standard_normal(errors.shape)
                wander(self._values, normals, self._kept, self._fresh, self._deviations, errors)
            yield from errors.tolist()


def disturb_pose(pose: Pose, xy: float, yaw: float, rng: np.random.Generator) -> Pose:
    """Add normal noise to a pose; nothing is sampled where both deviations (m, rad) are 0."""
    if not (xy or yaw):
        return pose
    dx, dy, turn = rng.standard_normal(3)
    return Pose(float(pose.x + xy * dx), float(pose.y + xy * dy), wrap_angle(pose.yaw + yaw * turn))
