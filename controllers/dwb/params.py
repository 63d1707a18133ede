"""Parameters of DWB, under Nav2's names and with the defaults of Nav2's code.

Source: nav2_dwb_controller (Humble, Jazzy and Lyrical): dwb_core, dwb_plugins (kinematic_parameters.cpp,
xy_theta_iterator.cpp, standard_traj_generator.cpp) and the critics of dwb_critics. Most people run the values of Nav2's
examples, not these defaults.
"""

from __future__ import annotations

from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from controllers.parameters import CriticSettings, SettingsWithCritics
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import NonNegative, NonPositive, Positive
from gym_mapbench.releases import Release

Granularity = Annotated[float, Field(ge=1e-4)]
Samples = Annotated[int, Field(le=1000)]

LIMITED_GENERATOR = "dwb_plugins::LimitedAccelGenerator"

ROS_ONLY_KEYS = frozenset(
    {
        "plugin",
        "debug_trajectory_details",
        "default_critic_namespaces",
        "goal_checker_name",
        "marker_lifetime",
        "publish_cost_grid_pc",
        "publish_evaluation",
        "publish_global_plan",
        "publish_input_params",
        "publish_local_plan",
        "publish_trajectories",
        "publish_transformed_plan",
        "rot_stopped_velocity",
        "stateful",
        "transform_tolerance",
        "yaw_goal_tolerance",
    }
)
"""Keys of a DWB section that only ROS or other plugins read; DWB's commands do not depend on them."""

PLAN_WINDOW: dict[str, Any] = {
    "prune_plan": True,
    "prune_distance": 2.0,
    "forward_prune_distance": 2.0,
    "shorten_transformed_plan": True,
}
"""Parameters of the part of the plan that the critics see, with their defaults; Lyrical does not have them."""

_ROTATE_TO_GOAL = "RotateToGoal looks at the distance to the goal, not along the path"
NEWER_ONLY_KEYS = {
    "path_length_tolerance": _ROTATE_TO_GOAL,
    "RotateToGoal.path_length_tolerance": _ROTATE_TO_GOAL,
}
"""Parameters of newer releases that neither Humble nor Jazzy has -> what these do instead."""
_MISREAD = "Lyrical reads it under a name without the dot after the plugin's name, so 1.0 m counts"
_HANDLER = "the controller server's path handler cuts the plan: its prune_distance"
NOT_IN_LYRICAL_KEYS = {
    "path_length_tolerance": _MISREAD,
    "RotateToGoal.path_length_tolerance": _MISREAD,
    "prune_plan": "the controller server's path handler always removes the poses that the robot has passed",
    "prune_distance": _HANDLER,
    "forward_prune_distance": _HANDLER,
    "shorten_transformed_plan": _HANDLER,
}
"""Parameters of older releases that Lyrical does not have, or does not find -> what it does instead."""


class CriticParams(CriticSettings):
    """Parameters of every critic.

    Args:
        scale: Weight of the critic; 0 switches it off, including its rejections.
    """

    scale: NonNegative = 1.0


class ObstacleParams(CriticParams):
    """BaseObstacle and ObstacleFootprint.

    Args:
        sum_scores: Whether the costs of all poses are summed, instead of taking that of the last pose.
    """

    sum_scores: bool = False


class MapGridParams(CriticParams):
    """PathDist and GoalDist.

    Args:
        aggregation_type: How the poses' grid values make one score: the last value, their sum or their product.
    """

    aggregation_type: Literal["last", "sum", "product"] = "last"


class AlignParams(MapGridParams):
    """PathAlign and GoalAlign.

    Args:
        forward_point_distance: How far ahead of the robot's centre the scored point lies, m.
    """

    forward_point_distance: NonNegative = 0.325


class RotateToGoalParams(CriticParams):
    """RotateToGoal.

    Args:
        slowing_factor: Weight of the squared speed while slowing down near the goal.
        lookahead_time: Time at which the heading is compared with the goal's, s; the trajectory's end if negative.
    """

    slowing_factor: NonNegative = 5.0
    lookahead_time: float = -1.0


class OscillationParams(CriticParams):
    """Oscillation.

    Args:
        oscillation_reset_dist: Distance that lifts the restrictions, m; none does if negative.
        oscillation_reset_angle: Turn that lifts the restrictions, rad; none does if negative.
        oscillation_reset_time: Time that lifts the restrictions, s; none does if negative.
        x_only_threshold: Speed above which turning is not watched, m/s; it is always watched if negative.
    """

    oscillation_reset_dist: float = 0.05
    oscillation_reset_angle: float = 0.2
    oscillation_reset_time: float = -1.0
    x_only_threshold: float = 0.05


class PreferForwardParams(CriticParams):
    """PreferForward.

    Args:
        penalty: Score of driving backwards, or slowly and straight.
        strafe_x: Speed below which driving counts as slow, m/s.
        strafe_theta: Turn rate below which driving counts as straight, rad/s.
        theta_scale: Weight of the turn rate in all other cases.
    """

    penalty: NonNegative = 1.0
    strafe_x: float = 0.1
    strafe_theta: float = 0.2
    theta_scale: NonNegative = 10.0


class DwbParams(SettingsWithCritics):
    """All of DWB's parameters; dotted keys (``"PathAlign.scale"``) and nested mappings are both understood.

    The robots here cannot move sideways: ``min_vel_y`` and ``max_vel_y`` must be 0, and the other parameters of that
    axis are accepted without effect. Scores are never negative, so ``short_circuit_trajectory_evaluation`` changes the
    computing time of Nav2 but not its choice; here it has no effect at all.

    Args:
        min_vel_x: Lowest sampled speed, m/s; negative for driving backwards.
        max_vel_x: Highest sampled speed, m/s.
        min_vel_y: Without effect: lowest speed sideways, m/s.
        max_vel_y: Without effect: highest speed sideways, m/s.
        max_vel_theta: Highest sampled turn rate, rad/s.
        min_speed_xy: Slower samples are left out, m/s, unless they turn at ``min_speed_theta`` at least.
        max_speed_xy: Faster samples are left out, m/s.
        min_speed_theta: Samples that turn more slowly are left out, rad/s, unless they are as fast as ``min_speed_xy``.
        acc_lim_x: Acceleration within which samples must be reachable, m/s^2.
        acc_lim_y: Without effect: the same sideways, m/s^2.
        acc_lim_theta: Angular acceleration within which samples must be reachable, rad/s^2.
        decel_lim_x: Deceleration within which samples must be reachable, m/s^2; negative.
        decel_lim_y: Without effect: the same sideways, m/s^2.
        decel_lim_theta: Angular deceleration within which samples must be reachable, rad/s^2; negative.
        vx_samples: Number of sampled speeds.
        vy_samples: Without effect: number of sampled speeds sideways.
        vtheta_samples: Number of sampled turn rates.
        sim_time: Length of a trajectory, s.
        discretize_by_time: Whether the poses of a trajectory are ``time_granularity`` apart, instead of the other two.
        time_granularity: Time between two poses with ``discretize_by_time``, s.
        linear_granularity: Longest distance between two poses without it, m.
        angular_granularity: Largest turn between two poses without it, rad.
        include_last_point: Whether the critics look at the last pose of a trajectory.
        limit_vel_cmd_in_traj: Whether the command is what a period's acceleration reaches, instead of the sample.
        prune_plan: Not in Lyrical: whether poses of the plan that the robot has passed are removed.
        prune_distance: Not in Lyrical: with ``prune_plan``, how far behind the robot the critics see the plan, m; in
            Humble also how far along the plan the robot is searched for.
        shorten_transformed_plan: Not in Lyrical: whether the critics see the plan only up to
            ``forward_prune_distance``.
        short_circuit_trajectory_evaluation: Without effect on the choice: whether bad trajectories are judged in part.
        xy_goal_tolerance: Distance to the goal within which RotateToGoal turns the robot, m.
        trans_stopped_velocity: Speed below which RotateToGoal takes the robot for standing, m/s.
        critics: Names of the critics, in the order in which they judge.
        trajectory_generator_name: The Standard generator samples speeds that can be reached within ``sim_time``, the
            LimitedAccel one speeds that can be reached within ``sim_period``.
        sim_period: Time within which LimitedAccel's samples can be reached, s; one control period if None.
        forward_prune_distance: Not in Lyrical: how far ahead the critics see the plan, m; in Jazzy also how far along
            the plan the robot is searched for. In Jazzy a negative value stands for the whole plan.
    """

    MISSING: ClassVar[dict[Release, dict[str, str]]] = {
        "humble": NEWER_ONLY_KEYS,
        "jazzy": NEWER_ONLY_KEYS,
        "lyrical": NOT_IN_LYRICAL_KEYS,
    }
    DEFAULTS: ClassVar[dict[Release, dict[str, Any]]] = {
        "humble": PLAN_WINDOW,
        "jazzy": PLAN_WINDOW,
        "lyrical": dict.fromkeys(PLAN_WINDOW),
    }

    min_vel_x: float = 0.0
    max_vel_x: float = 0.0
    min_vel_y: Annotated[float, Field(ge=0, le=0)] = 0.0
    max_vel_y: Annotated[float, Field(ge=0, le=0)] = 0.0
    max_vel_theta: NonNegative = 0.0
    min_speed_xy: float = 0.0
    max_speed_xy: float = 0.0
    min_speed_theta: float = 0.0
    acc_lim_x: NonNegative = 0.0
    acc_lim_y: NonNegative = 0.0
    acc_lim_theta: NonNegative = 0.0
    decel_lim_x: NonPositive = 0.0
    decel_lim_y: NonPositive = 0.0
    decel_lim_theta: NonPositive = 0.0
    vx_samples: Samples = 20
    vy_samples: Samples = 5
    vtheta_samples: Samples = 20
    sim_time: Annotated[Positive, Field(le=100)] = 1.7
    sim_period: Positive | None = None
    discretize_by_time: bool = False
    time_granularity: Granularity = 0.5
    linear_granularity: Granularity = 0.5
    angular_granularity: Granularity = 0.025
    include_last_point: bool = True
    limit_vel_cmd_in_traj: bool = False
    trajectory_generator_name: Literal[
        "dwb_plugins::StandardTrajectoryGenerator", "dwb_plugins::LimitedAccelGenerator"
    ] = "dwb_plugins::StandardTrajectoryGenerator"
    prune_plan: bool | None = True
    prune_distance: NonNegative | None = 2.0
    forward_prune_distance: float | None = 2.0
    shorten_transformed_plan: bool | None = True
    short_circuit_trajectory_evaluation: bool = True
    xy_goal_tolerance: NonNegative = 0.25
    trans_stopped_velocity: NonNegative = 0.25
    critics: Annotated[tuple[str, ...], Field(validate_default=True)] = ()
    BaseObstacle: ObstacleParams = ObstacleParams()
    GoalAlign: AlignParams = AlignParams()
    GoalDist: MapGridParams = MapGridParams()
    ObstacleFootprint: ObstacleParams = ObstacleParams()
    Oscillation: OscillationParams = OscillationParams()
    PathAlign: AlignParams = AlignParams()
    PathDist: MapGridParams = MapGridParams()
    PreferForward: PreferForwardParams = PreferForwardParams()
    RotateToGoal: RotateToGoalParams = RotateToGoalParams()
    Twirling: CriticParams = CriticParams()

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if self.min_vel_x > self.max_vel_x:
            raise ConfigError(f"min_vel_x: expected at most max_vel_x ({self.max_vel_x}), got {self.min_vel_x}")
        if self.release == "humble" and (self.forward_prune_distance or 0.0) < 0:
            raise ConfigError(f"forward_prune_distance: expected at least 0, got {self.forward_prune_distance}")
        return self

    @property
    def samples_one_period(self) -> bool:
        """Whether the LimitedAccelGenerator samples: speeds within one period's reach, driven from the start."""
        return self.trajectory_generator_name == LIMITED_GENERATOR

    def critic(self, name: str) -> CriticParams:
        """Return the parameters of one critic."""
        params: CriticParams = getattr(self, name)
        return params
