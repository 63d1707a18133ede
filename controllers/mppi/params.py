"""Parameters of MPPI, under Nav2's names and with the defaults of its code.

Source: nav2_mppi_controller (Humble, Jazzy and Lyrical): optimizer.cpp, path_handler.cpp and the critics. Most people
run the values of an example (Humble: the package's README, Jazzy and Lyrical: nav2_bringup), not these defaults.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from controllers.mppi.critic_params import (
    ConstraintParams,
    CostParams,
    CriticParams,
    GoalAngleParams,
    GoalParams,
    ObstaclesParams,
    PathAlignParams,
    PathAngleParams,
    PathFollowParams,
    PreferForwardParams,
    TwirlingParams,
    VelocityDeadbandParams,
)
from controllers.mppi.release_tables import DEFAULTS, HANDLED, MISSING
from controllers.parameters import SettingsWithCritics
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Count, Natural, NonNegative, Positive
from gym_mapbench.releases import Release
from gym_mapbench.settings import ExtendedSettings, Settings

Std = Annotated[Positive, Field(le=100)]

MAX_POINTS = 20_000_000
"""Largest product of batch_size and time_steps that fits in the memory of a small machine."""

ROS_ONLY_KEYS = frozenset(
    {
        "plugin",
        "visualize",
        "TrajectoryVisualizer",
        "critic_index_to_visualize",
        "publish_critics_stats",
        "publish_optimal_trajectory",
        "transform_tolerance",
    }
)
"""Keys of a parameter file that mean nothing without ROS: listed as ignored."""

RENAMED_KEYS = {f"PathHandler.{name}": name for name in HANDLED}
"""Name in newer releases -> name in Humble and Jazzy; both are accepted."""


class AckermannParams(Settings):
    """Limits of the motion model Ackermann.

    Args:
        min_turning_r: Smallest turning radius, m.
    """

    min_turning_r: Positive = 0.2


class ValidatorParams(Settings):
    """Lyrical: parameters of the trajectory validator, which checks the chosen trajectory for collisions.

    Args:
        collision_lookahead_time: Time of the trajectory that is checked, s.
        consider_footprint: Whether the outline of the footprint is checked, rather than the cell of the centre.
    """

    collision_lookahead_time: NonNegative | None = None
    consider_footprint: bool | None = None


EXAMPLE_CRITICS = (
    "ConstraintCritic",
    "CostCritic",
    "GoalCritic",
    "GoalAngleCritic",
    "PathAlignCritic",
    "PathFollowCritic",
    "PathAngleCritic",
    "PreferForwardCritic",
)


class MppiParams(SettingsWithCritics, ExtendedSettings):
    """All of MPPI's parameters; dotted keys (``"CostCritic.cost_weight"``) and nested mappings are both understood.

    The robots here cannot move sideways: motion model Omni is refused, and ``vy_std`` has no effect.

    Args:
        motion_model: DiffDrive or Ackermann.
        time_steps: Number of points of a trajectory.
        model_dt: Time between two points, s; not less than the control period.
        batch_size: Number of trajectories.
        iteration_count: Number of rollouts and updates per call.
        retry_attempt_limit: How often Nav2 retries, always in vain, if all trajectories collide. Before it gives up it
            is reset once more than that.
        vx_std: Standard deviation of the noise of the speed, m/s.
        vy_std: Without effect: standard deviation of the noise of the speed sideways, m/s.
        wz_std: Standard deviation of the noise of the turn rate, rad/s.
        vx_max: Highest resulting speed, m/s.
        vx_min: Lowest resulting speed, m/s; negative for driving backwards.
        vy_max: Highest speed sideways, m/s; only the Constraint critic uses it.
        wz_max: Highest resulting turn rate, rad/s.
        ax_max: Since Jazzy: largest acceleration of sampled and resulting controls, m/s^2.
        ax_min: Since Jazzy: largest deceleration of sampled and resulting controls, m/s^2; negative.
        ay_max: Since Jazzy, without effect: largest acceleration sideways, m/s^2.
        ay_min: Since Jazzy, without effect: largest deceleration sideways, m/s^2.
        az_max: Since Jazzy: largest angular acceleration of sampled and resulting controls, rad/s^2.
        open_loop: Since Jazzy: whether the last command is taken for the measured speed.
        model_delay_vx: Lyrical: time after which the base follows a commanded speed, s.
        model_delay_vy: Lyrical, without effect: the same for the speed sideways, s.
        model_delay_wz: Lyrical: the same for the turn rate, s.
        clamp_raw_controls: Lyrical: whether the mean is taken over the sampled controls within the acceleration limits,
            as in Jazzy, rather than over the sampled controls themselves.
        sgf_order: Lyrical: order of the polynomial of the Savitzky-Golay filter; the other releases have 2.
        TrajectoryValidator: Lyrical: parameters of the trajectory validator.
        temperature: Temperature of the soft-max; the lower it is, the more the best trajectories count.
        gamma: Weight of staying near the last control sequence.
        regenerate_noises: Whether every call has new noise.
        reset_period: Humble: pause after which the controller forgets its control sequence, s.
        prune_distance: Length of the local path, m. In Lyrical, this and the next four belong to the path handler.
        max_robot_pose_search_dist: Length of the path that is searched for the nearest pose, m; None for half the
            costmap.
        enforce_path_inversion: Whether the path is cut at its next cusp until the robot is there within
            ``inversion_xy_tolerance`` (m) and ``inversion_yaw_tolerance`` (rad).
        inversion_xy_tolerance: Distance to a cusp of the path within which the path beyond it is given, m.
        inversion_yaw_tolerance: Difference of the heading at a cusp within which the path beyond it is given, rad.
        AckermannConstraints: Limits of the motion model Ackermann.
        critics: Names of the critics in their order. Nav2's code has no default; these are its examples'.
        noise: Ours. ``numpy`` samples from the run's own generator; ``nav2`` gives Nav2's own numbers (std::mt19937, in
            Lyrical std::minstd_rand0, and libstdc++'s normal_distribution), which are the same after every start.
        noise_seed: Ours. Seed of ``nav2`` noise; Nav2 leaves its generator at the default, 5489, in Lyrical 1.
    """

    OURS: ClassVar[frozenset[str]] = frozenset({"release", "noise", "noise_seed", "PathAlignCritic.humble_search"})
    MISSING: ClassVar[Mapping[Release, Mapping[str, str]]] = MISSING
    DEFAULTS: ClassVar[Mapping[Release, Mapping[str, Any]]] = DEFAULTS
    newer: ClassVar[tuple[str, ...]] = ("TrajectoryValidator",)

    motion_model: Literal["DiffDrive", "Ackermann"] = "DiffDrive"
    time_steps: Annotated[int, Field(ge=2, le=10_000)] = 56
    model_dt: Positive = 0.05
    batch_size: Annotated[Count, Field(le=1_000_000)] = 1000
    iteration_count: Annotated[Count, Field(le=100)] = 1
    retry_attempt_limit: Annotated[Natural, Field(le=1000)] = 1
    vx_std: Std = 0.2
    vy_std: Std = 0.2
    wz_std: Std = 0.4
    vx_max: float = 0.5
    vx_min: float = -0.35
    vy_max: NonNegative = 0.5
    wz_max: NonNegative = 1.9
    ax_max: float | None = None
    ax_min: float | None = None
    ay_max: float | None = None
    ay_min: float | None = None
    az_max: float | None = None
    open_loop: bool | None = None
    model_delay_vx: NonNegative | None = None
    model_delay_vy: NonNegative | None = None
    model_delay_wz: NonNegative | None = None
    clamp_raw_controls: bool | None = None
    sgf_order: Literal[1, 2] | None = None
    TrajectoryValidator: ValidatorParams = ValidatorParams()
    temperature: Positive = 0.3
    gamma: NonNegative = 0.015
    regenerate_noises: bool = False
    reset_period: NonNegative | None = 1.0
    prune_distance: Positive | None = 1.5
    max_robot_pose_search_dist: Positive | None = None
    enforce_path_inversion: bool | None = False
    inversion_xy_tolerance: NonNegative | None = 0.2
    inversion_yaw_tolerance: NonNegative | None = 0.4
    AckermannConstraints: AckermannParams = AckermannParams()
    critics: tuple[str, ...] = EXAMPLE_CRITICS
    ConstraintCritic: ConstraintParams = ConstraintParams()
    CostCritic: CostParams = CostParams()
    ObstaclesCritic: ObstaclesParams = ObstaclesParams()
    GoalCritic: GoalParams = GoalParams()
    GoalAngleCritic: GoalAngleParams = GoalAngleParams()
    PathAlignCritic: PathAlignParams = PathAlignParams()
    PathFollowCritic: PathFollowParams = PathFollowParams()
    PathAngleCritic: PathAngleParams = PathAngleParams()
    PreferForwardCritic: PreferForwardParams = PreferForwardParams()
    TwirlingCritic: TwirlingParams = TwirlingParams()
    VelocityDeadbandCritic: VelocityDeadbandParams = VelocityDeadbandParams()
    noise: Literal["numpy", "nav2"] = "numpy"
    noise_seed: Annotated[Natural, Field(le=2**32 - 1)] = 5489

    @field_validator("motion_model", mode="before")
    @classmethod
    def _not_sideways(cls, value: object) -> object:
        if value == "Omni":
            raise ConfigError("expected DiffDrive or Ackermann, got Omni: the robots here cannot move sideways")
        return value

    @field_validator("critics")
    @classmethod
    def _distinct(cls, value: tuple[str, ...]) -> tuple[str, ...]:
        for name in value:
            if value.count(name) > 1:
                raise ConfigError(f"expected each critic once, got {name} more often")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.vx_min > self.vx_max:
            raise ConfigError(f"vx_min: expected at most vx_max ({self.vx_max}), got {self.vx_min}")
        points = self.batch_size * self.time_steps
        if points > MAX_POINTS:
            raise ConfigError(f"batch_size: expected at most {MAX_POINTS} points (times time_steps), got {points}")
        return self

    def critic(self, name: str) -> CriticParams:
        """Return the parameters of one critic."""
        params: CriticParams = getattr(self, name)
        return params
