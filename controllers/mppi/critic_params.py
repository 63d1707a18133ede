"""Parameters of MPPI's critics, under Nav2's names and with the defaults of its code.

Source: nav2_mppi_controller/src/critics (Humble and Jazzy). A parameter that only one of them has is None in the other.
"The goal" is the end of the local path in Humble and the end of the whole plan in Jazzy.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from controllers.parameters import CriticSettings
from gym_mapbench.quantities import Count, Natural, NonNegative

Power = Annotated[Count, Field(le=8)]
Index = Annotated[Natural, Field(le=100_000)]
Step = Annotated[Count, Field(le=1000)]


class CriticParams(CriticSettings):
    """Parameters of every critic.

    Args:
        enabled: Whether the critic scores.
        cost_power: Power to which its weighted score is raised.
    """

    enabled: bool = True
    cost_power: Power = 1


class WeightedParams(CriticParams):
    """Parameters of every critic but Obstacles.

    Args:
        cost_weight: The critic's weight.
    """

    cost_weight: NonNegative = 1.0


class ConstraintParams(WeightedParams):
    """Constraint: speeds beyond the limits, which sampled controls may have.

    The limits are ``hypot(vx_max, vy_max)`` and ``-hypot(vx_min, vy_max)``, for DiffDrive too: set ``vy_max`` to 0 to
    make them ``vx_max`` and ``vx_min``.
    """

    cost_weight: NonNegative = 4.0


class CostParams(WeightedParams):
    """Cost: the costs of the cells under a trajectory.

    Args:
        critical_cost: What a point on a cell near collision adds.
        near_collision_cost: Jazzy: cost from which on a cell is near collision; 253 in Humble.
        trajectory_point_step: Jazzy: only every so many points are looked at; all of them in Humble.
        collision_cost: What replaces the sum of a trajectory that collides.
        near_goal_distance: Within this distance of the goal, costs that are not critical do not count, m.
        consider_footprint: Whether the outline of the footprint decides about collision. Nav2 refuses this for a robot
            given by its radius; here the footprint of a disc is a 16-gon.
    """

    cost_weight: NonNegative = 3.81
    critical_cost: NonNegative = 300.0
    collision_cost: NonNegative = 1e6
    near_goal_distance: NonNegative = 0.5
    consider_footprint: bool = False
    near_collision_cost: Annotated[Natural, Field(le=255)] | None = None
    trajectory_point_step: Step | None = None


class ObstaclesParams(CriticParams):
    """Obstacles: distances from obstacles, computed back from the costs, in two terms, repulsive and critical.

    Args:
        repulsion_weight: Weight of being within the inflation radius.
        critical_weight: Weight of being within ``collision_margin_distance``.
        collision_cost: What replaces the critical term of a trajectory that collides.
        collision_margin_distance: Distance from an obstacle that is critical, m.
        near_goal_distance: Within this distance of the goal, repulsion does not count, m.
        consider_footprint: Whether costs are those of the footprint's outline.
        cost_scaling_factor: Humble: the critic's own, to be set to the inflation layer's, 1/m. Jazzy asks the layer.
        inflation_radius: The same for the radius, m.
    """

    repulsion_weight: NonNegative = 1.5
    critical_weight: NonNegative = 20.0
    collision_cost: NonNegative = 1e4
    collision_margin_distance: NonNegative = 0.10
    near_goal_distance: NonNegative = 0.5
    consider_footprint: bool = False
    cost_scaling_factor: NonNegative | None = 10.0
    inflation_radius: NonNegative | None = 0.55


class GoalParams(WeightedParams):
    """Goal: mean distance from the goal.

    Args:
        threshold_to_consider: The critic scores only within this distance of the goal, m.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 1.4


class GoalAngleParams(WeightedParams):
    """GoalAngle: mean difference from the heading at the end of the local path.

    Args:
        threshold_to_consider: The critic scores only within this distance of the goal, m.
        symmetric_yaw_tolerance: Whether arriving backwards is as good.
    """

    cost_weight: NonNegative = 3.0
    threshold_to_consider: NonNegative = 0.5
    symmetric_yaw_tolerance: bool = False


class PathAlignParams(WeightedParams):
    """PathAlign: mean distance of a trajectory's points from the path points that are as far along the path.

    Args:
        threshold_to_consider: The critic does not score within this distance of the goal, m.
        offset_from_furthest: The critic does not score before the trajectories reach this path point.
        trajectory_point_step: Only every so many points of a trajectory are compared.
        max_path_occupancy_ratio: The critic does not score if a larger share of the path is blocked.
        use_path_orientations: Whether headings are compared as well.
        humble_search: Ours, for Humble. True copies the defects of Humble's search for the path point: slow
            trajectories are compared with the first point, and trajectories past the last point are compared in turns
            with the first and with the one after the last. False repairs both.
    """

    cost_weight: NonNegative = 10.0
    threshold_to_consider: NonNegative = 0.5
    offset_from_furthest: Index = 20
    trajectory_point_step: Step = 4
    max_path_occupancy_ratio: NonNegative = 0.07
    use_path_orientations: bool = False
    humble_search: bool | None = True


class PathFollowParams(WeightedParams):
    """PathFollow: distance of a trajectory's last point from a path point ahead of those that trajectories reach.

    Args:
        threshold_to_consider: The critic does not score within this distance of the goal, m.
        offset_from_furthest: How many points ahead of the furthest point reached that path point is.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 1.4
    offset_from_furthest: Index = 6


class PathAngleParams(WeightedParams):
    """PathAngle: angle between the heading and the bearing of a path point ahead, if the robot faces elsewhere.

    In Humble it is the mean over the points of a trajectory, in Jazzy the angle at the last point.

    Args:
        threshold_to_consider: The critic does not score within this distance of the goal, m.
        offset_from_furthest: How many points ahead of the furthest point reached that path point is.
        max_angle_to_furthest: The critic scores only if the angle at the robot is at least this, rad.
        forward_preference: Humble: whether facing away from the point is worse than facing it.
        mode: Jazzy: 0 for forward preference, 1 for no preference, 2 for the direction of the path's own headings.
    """

    cost_weight: NonNegative = 2.0
    threshold_to_consider: NonNegative = 0.5
    offset_from_furthest: Index = 4
    max_angle_to_furthest: NonNegative = 1.2
    forward_preference: bool | None = True
    mode: Literal[0, 1, 2] | None = None


class PreferForwardParams(WeightedParams):
    """PreferForward: distance driven backwards.

    Args:
        threshold_to_consider: The critic does not score within this distance of the goal, m.
    """

    cost_weight: NonNegative = 5.0
    threshold_to_consider: NonNegative = 0.5


class TwirlingParams(WeightedParams):
    """Twirling: mean turn rate, until the goal is within the goal checker's tolerance."""

    cost_weight: NonNegative = 10.0


class VelocityDeadbandParams(WeightedParams):
    """VelocityDeadband: speeds too low for the base.

    Args:
        deadband_velocities: Lowest speeds that the base can drive: x (m/s), y (no effect here) and yaw (rad/s).
    """

    cost_weight: NonNegative = 35.0
    deadband_velocities: tuple[float, float, float] = (0.0, 0.0, 0.0)
