"""Parameters of MPPI, under Nav2's names and with the defaults of Humble's code.

Source: nav2_mppi_controller (Humble): optimizer.cpp, path_handler.cpp and the critics. The values most people run
are those of the package's README, not these defaults.
"""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, field_validator, model_validator

from controllers.parameters import CriticSettings, SettingsWithCritics
from gym_mapbench.errors import ConfigError
from gym_mapbench.settings import Settings

NonNegative = Annotated[float, Field(ge=0)]
Positive = Annotated[float, Field(gt=0)]
Std = Annotated[float, Field(gt=0, le=100)]
Power = Annotated[int, Field(ge=1, le=8)]
Index = Annotated[int, Field(ge=0, le=100_000)]

MAX_POINTS = 20_000_000
"""Largest product of batch_size and time_steps: what still fits in the memory of a small machine."""

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
"""Keys of an MPPI section that serve ROS only."""

RENAMED_KEYS = {
    "PathHandler.prune_distance": "prune_distance",
    "PathHandler.max_robot_pose_search_dist": "max_robot_pose_search_dist",
    "PathHandler.enforce_path_inversion": "enforce_path_inversion",
    "PathHandler.inversion_xy_tolerance": "inversion_xy_tolerance",
    "PathHandler.inversion_yaw_tolerance": "inversion_yaw_tolerance",
}
"""Newer name -> the name in Humble; both are accepted."""

_ACCELERATION = "Humble's MPPI has no acceleration limits"
_DELAY = "Humble's model has no delay"
_LAYER = "in Humble the critic has its own cost_scaling_factor and inflation_radius"
NEWER_ONLY_KEYS = {
    "ax_max": _ACCELERATION,
    "ax_min": _ACCELERATION,
    "ay_max": _ACCELERATION,
    "ay_min": _ACCELERATION,
    "az_max": _ACCELERATION,
    "clamp_raw_controls": _ACCELERATION,
    "model_delay_vx": _DELAY,
    "model_delay_vy": _DELAY,
    "model_delay_wz": _DELAY,
    "open_loop": "Humble starts every rollout from the measured speed",
    "sgf_order": "Humble's Savitzky-Golay filter is quadratic",
    "TrajectoryValidator": "Humble does not check the chosen trajectory once more",
    "CostCritic.near_collision_cost": "Humble adds critical_cost from cost 253 on",
    "CostCritic.trajectory_point_step": "Humble's CostCritic looks at every point",
    "CostCritic.inflation_layer_name": "Humble takes the first inflation layer",
    "ObstaclesCritic.inflation_layer_name": _LAYER,
    "PathAngleCritic.mode": "Humble has forward_preference: true is mode 0, false is mode 1",
}
"""Parameters of newer releases that Humble does not have -> what Humble does instead."""


class CriticParams(CriticSettings):
    """What every critic takes.

    Args:
        enabled: Whether it scores.
        cost_power: Power to which its weighted score is raised.
    """

    enabled: bool = True
    cost_power: Power = 1


class WeightedParams(CriticParams):
    """What all but Obstacles take.

    Args:
        cost_weight: Its weight.
    """

    cost_weight: NonNegative = 1.0


class ConstraintParams(WeightedParams):
    """Speeds beyond the limits, which sampled controls may have.

    Humble's limits are ``hypot(vx_max, vy_max)`` and ``-hypot(vx_min, vy_max)``, for DiffDrive too: set ``vy_max`` to 0
    for tight ones.
    """

    cost_weight: NonNegative = 4.0


class CostParams(WeightedParams):
    """Cost: what the costmap says.

    Args:
        critical_cost: What a point on an inscribed cell adds.
        collision_cost: What replaces the sum of a trajectory that collides.
        near_goal_distance: From this distance to the end of the local path on, lower costs are left out, m.
        consider_footprint: Whether the outline of the footprint decides about collision. Nav2 refuses it for a robot
            given by its radius; here the footprint of a disc is its 16-gon.
    """

    cost_weight: NonNegative = 3.81
    critical_cost: NonNegative = 300.0
    collision_cost: NonNegative = 1e6
    near_goal_distance: NonNegative = 0.5
    consider_footprint: bool = False


class ObstaclesParams(CriticParams):
    """Obstacles: distances, won back from the costs, with a weight each for near and for very near.

    Args:
        repulsion_weight: Weight of being within the inflation radius.
        critical_weight: Weight of being within ``collision_margin_distance``.
        collision_cost: What replaces the critical term of a trajectory that collides.
        collision_margin_distance: m.
        near_goal_distance: From this distance to the end of the local path on, repulsion is left out, m.
        consider_footprint: Whether costs are those of the footprint's outline.
        cost_scaling_factor: In Humble the critic's own; set it to the inflation layer's, 1/m.
        inflation_radius: In Humble the critic's own; set it to the inflation layer's, m.
    """

    repulsion_weight: NonNegative = 1.5
    critical_weight: NonNegative = 20.0
    collision_cost: NonNegative = 1e4
    collision_margin_distance: NonNegative = 0.10
    near_goal_distance: NonNegative = 0.5
    consider_footprint: bool = False
    cost_scaling_factor: NonNegative = 10.0
    inflation_radius: NonNegative = 0.55


class GoalParams(WeightedParams):
    """Mean distance from the end of the local path.

    Args:
        threshold_to_consider: Only within this distance of it, m.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 1.4


class GoalAngleParams(WeightedParams):
    """Mean difference from the heading at the end of the local path.

    Args:
        threshold_to_consider: Only within this distance of it, m.
        symmetric_yaw_tolerance: Whether arriving backwards is as good.
    """

    cost_weight: NonNegative = 3.0
    threshold_to_consider: NonNegative = 0.5
    symmetric_yaw_tolerance: bool = False


class PathAlignParams(WeightedParams):
    """Mean distance from the path points as far along the path as the trajectory is long.

    Args:
        threshold_to_consider: Not within this distance of the end of the local path, m.
        offset_from_furthest: Not before the trajectories reach this path point.
        trajectory_point_step: Every so many points of a trajectory are compared.
        max_path_occupancy_ratio: Not if a larger share of the path is blocked.
        use_path_orientations: Whether headings are compared as well.
        humble_search: Ours. True copies Humble's search for the path point: slow trajectories are compared with the
            first point, and beyond the last one the first takes turns with the one after the last. False repairs both.
    """

    cost_weight: NonNegative = 10.0
    threshold_to_consider: NonNegative = 0.5
    offset_from_furthest: Index = 20
    trajectory_point_step: Annotated[int, Field(ge=1, le=1000)] = 4
    max_path_occupancy_ratio: NonNegative = 0.07
    use_path_orientations: bool = False
    humble_search: bool = True


class PathFollowParams(WeightedParams):
    """Distance of the last point from a path point ahead of what the trajectories reach.

    Args:
        threshold_to_consider: Not within this distance of the end of the local path, m.
        offset_from_furthest: How many points ahead.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 1.4
    offset_from_furthest: Index = 6


class PathAngleParams(WeightedParams):
    """Mean angle between heading and bearing of a path point ahead, when the robot looks elsewhere.

    Args:
        threshold_to_consider: Not within this distance of the end of the local path, m.
        offset_from_furthest: How many points ahead of what the trajectories reach.
        max_angle_to_furthest: Only if the robot looks further away from the point than this, rad.
        forward_preference: Whether looking away from it is worse than looking at it.
    """

    cost_weight: NonNegative = 2.0
    threshold_to_consider: NonNegative = 0.5
    offset_from_furthest: Index = 4
    max_angle_to_furthest: NonNegative = 1.2
    forward_preference: bool = True


class PreferForwardParams(WeightedParams):
    """Distance driven backwards.

    Args:
        threshold_to_consider: Not within this distance of the end of the local path, m.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 0.5


class TwirlingParams(WeightedParams):
    """Mean turn rate, until the goal checker's distance is reached."""

    cost_weight: NonNegative = 10.0


class VelocityDeadbandParams(WeightedParams):
    """Speeds too low for the base.

    Args:
        deadband_velocities: Of x (m/s), y (no effect here) and yaw (rad/s).
    """

    cost_weight: NonNegative = 35.0
    deadband_velocities: tuple[float, float, float] = (0.0, 0.0, 0.0)


class AckermannParams(Settings):
    """Limits of motion model Ackermann.

    Args:
        min_turning_r: Smallest turning radius, m.
    """

    min_turning_r: Positive = 0.2


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


class MppiParams(SettingsWithCritics):
    """All of MPPI's parameters; dotted keys (``"CostCritic.cost_weight"``) and nested mappings are both understood.

    The robots here cannot move sideways: motion model Omni is refused, and ``vy_std`` has no effect.

    Args:
        motion_model: DiffDrive or Ackermann.
        time_steps: Points of a trajectory.
        model_dt: Time between them, s; not less than the control period.
        batch_size: Trajectories.
        iteration_count: Rollouts and updates per call.
        retry_attempt_limit: Humble retries in vain when all trajectories collide; so many times and once more.
        vx_std, vy_std, wz_std: Standard deviations of the noise, m/s and rad/s.
        vx_max, vx_min, vy_max, wz_max: Limits of the resulting controls, m/s and rad/s.
        temperature: Of the soft-max: the lower, the more the best trajectories count.
        gamma: Weight of staying near the last control sequence.
        regenerate_noises: Whether every call has other noise.
        reset_period: After a pause longer than this the controller forgets its control sequence, s.
        prune_distance: Length of the local path, m.
        max_robot_pose_search_dist: Length of path searched for the nearest pose, m; None for half the costmap.
        enforce_path_inversion: Whether the path is cut at cusps, until the robot is there within
            ``inversion_xy_tolerance`` (m) and ``inversion_yaw_tolerance`` (rad).
        critics: Names of the critics in their order; Humble's code names none, its example these.
        noise: Ours. ``numpy``: from the run's own generator. ``nav2``: Nav2's own numbers (the same after every
            start): std::mt19937 and libstdc++'s normal_distribution.
        noise_seed: Ours. Seed of ``nav2`` noise; Nav2 leaves its generator at 5489.
    """

    motion_model: Literal["DiffDrive", "Ackermann"] = "DiffDrive"
    time_steps: Annotated[int, Field(ge=2, le=10_000)] = 56
    model_dt: Positive = 0.05
    batch_size: Annotated[int, Field(ge=1, le=1_000_000)] = 1000
    iteration_count: Annotated[int, Field(ge=1, le=100)] = 1
    retry_attempt_limit: Annotated[int, Field(ge=0, le=1000)] = 1
    vx_std: Std = 0.2
    vy_std: Std = 0.2
    wz_std: Std = 0.4
    vx_max: float = 0.5
    vx_min: float = -0.35
    vy_max: NonNegative = 0.5
    wz_max: NonNegative = 1.9
    temperature: Positive = 0.3
    gamma: NonNegative = 0.015
    regenerate_noises: bool = False
    reset_period: NonNegative = 1.0
    prune_distance: Positive = 1.5
    max_robot_pose_search_dist: Positive | None = None
    enforce_path_inversion: bool = False
    inversion_xy_tolerance: NonNegative = 0.2
    inversion_yaw_tolerance: NonNegative = 0.4
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
    noise_seed: Annotated[int, Field(ge=0, le=2**32 - 1)] = 5489

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


CRITIC_NAMES = MppiParams.critic_names()
