"""DWB's parameters, its critics and what they remember as records, the form in which kernels take named values."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.dwb.kernels.critics import (
    BASE_OBSTACLE,
    MAP_GRID,
    OBSTACLE_FOOTPRINT,
    OSCILLATION,
    PREFER_FORWARD,
    ROTATE_TO_GOAL,
    TWIRLING,
)
from controllers.dwb.kernels.plan import GOAL, GOAL_AHEAD, PATH
from controllers.dwb.kernels.scoring import INSCRIBED, LAST, PRODUCT, SUM
from controllers.dwb.kernels.verdict import NO_LIMIT, OFF_MAP
from controllers.dwb.params import DwbParams, MapGridParams, ObstacleParams
from controllers.records import fill_groups, record_of
from gym_mapbench.releases import Release

Record = NDArray[np.void]

TUNING = record_of(
    DwbParams,
    ("humble", np.bool_),
    ("lyrical", np.bool_),
    ("whole_way", np.bool_),
    ("horizon", np.float64),
    ("axes", np.float64, (2, 5)),
    ("speeds", np.float64, (4,)),
    ("granularity", np.float64, (3,)),
    ("limits", np.float64, (4,)),
)
"""DWB's parameters under their own names, critics as groups, and what the roll-out makes of them: whether critics look
up points on the whole way, the time within which samples must be reachable (s), and the arrays that
:func:`controllers.dwb.kernels.rollout.roll_out` takes."""

CRITIC = np.dtype(
    [
        *((name, np.int64) for name in ("kind", "layer", "row", "aggregation", "forbidden")),
        *((name, np.bool_) for name in ("outline", "sum_scores", "needs_seed", "silent_at_goal")),
        *((name, np.float64) for name in ("scale", "forward")),
    ],
    align=True,
)
"""A critic: its kind; its map grid, the row of the points that it looks up, and how it aggregates their values; the
cost under the robot's centre, at any pose, from which it rejects a trajectory, and whether it also rejects one on which
the footprint's outline touches an obstacle; whether it sums up the costs of all poses, rejects all where no plan is on
the map, and is left out close to the goal; its weight, and how far ahead of the robot its points lie, m."""

MEMORY = np.dtype(
    [
        *((name, np.bool_) for name in ("is_far", "in_window", "rotating")),
        *((name, np.int64) for name in ("forward_sign", "forward_only", "turn_sign", "turn_only")),
        *((name, np.float64) for name in ("flip_x", "flip_y", "flip_yaw", "flip_time")),
    ],
    align=True,
)
"""What critics remember since the last plan. RotateToGoal: whether much of Lyrical's local plan is left, which the
follower says in each cycle; that the goal was near, and that the robot stopped there.
Oscillation: sign of the last nonzero command on each axis, and the only sign allowed since it flipped (0: both); pose
(m, rad) and time (s) of the last flip, which a new plan does not change."""

UNTIL_NEXT_PLAN = ["in_window", "rotating", "forward_sign", "forward_only", "turn_sign", "turn_only"]
"""State of the critics that a new plan resets."""

EPSILON = float(np.finfo(np.float32).eps)
SLACK: dict[Release, float] = {"humble": 1e-5, "jazzy": EPSILON, "lyrical": EPSILON}
"""How far a sample may exceed the limits of speed: in the squared speed, m^2/s^2, and in the turn rate, rad/s."""

AGGREGATIONS = {"last": LAST, "sum": SUM, "product": PRODUCT}
KINDS: dict[str, dict[str, Any]] = {
    "BaseObstacle": {"kind": BASE_OBSTACLE, "forbidden": INSCRIBED},
    "ObstacleFootprint": {"kind": OBSTACLE_FOOTPRINT, "forbidden": OFF_MAP, "outline": True},
    "PathDist": {"kind": MAP_GRID, "layer": PATH, "forbidden": OFF_MAP, "needs_seed": True},
    "GoalDist": {"kind": MAP_GRID, "layer": GOAL, "forbidden": OFF_MAP, "needs_seed": True},
    "PathAlign": {"kind": MAP_GRID, "layer": PATH, "silent_at_goal": True},
    "GoalAlign": {"kind": MAP_GRID, "layer": GOAL_AHEAD},
    "RotateToGoal": {"kind": ROTATE_TO_GOAL},
    "Oscillation": {"kind": OSCILLATION},
    "PreferForward": {"kind": PREFER_FORWARD},
    "Twirling": {"kind": TWIRLING},
}
"""Fixed properties of each critic; the other fields of a CRITIC come from its parameters."""


def make_tuning(params: DwbParams, control_period: float) -> Record:
    """Return the ``(1,)`` TUNING of a run; ``params`` are scaled by the speed limit in force."""
    p, inf, tuning = params, np.inf, np.zeros(1, dtype=TUNING)
    fill_groups(tuning, params)
    grids = (p.critic(name) for name in p.critics)
    by_distance = [inf, p.linear_granularity, p.angular_granularity]
    tuning["humble"], tuning["lyrical"] = p.release == "humble", p.release == "lyrical"
    tuning["whole_way"] = any(isinstance(grid, MapGridParams) and grid.aggregation_type != "last" for grid in grids)
    tuning["horizon"] = (p.sim_period or control_period) if p.samples_one_period else p.sim_time
    tuning["axes"] = [
        [p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, p.vx_samples],
        [-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta, p.vtheta_samples],
    ]
    tuning["speeds"] = p.max_speed_xy, p.min_speed_xy, p.min_speed_theta, SLACK[p.release]
    tuning["granularity"] = [p.time_granularity, inf, inf] if p.discretize_by_time else by_distance
    # The LimitedAccelGenerator drives the sample from the first step on.
    limits = tuning["axes"][0, :, 2:4].ravel()
    tuning["limits"] = [inf, -inf, inf, -inf] if p.samples_one_period else limits
    return tuning


def points_ahead(params: DwbParams) -> NDArray[np.float64]:
    """Return the distances ahead of the robot at which critics look up points, m, ascending."""
    ahead = {params.GoalAlign.forward_point_distance, params.PathAlign.forward_point_distance}
    return np.array(sorted(ahead | {0.0}))


def make_critics(params: DwbParams) -> Record:
    """Return a CRITIC for each of the names in ``params.critics``, in that order."""
    critics, forwards = np.zeros(len(params.critics), dtype=CRITIC), points_ahead(params).tolist()
    critics["forbidden"] = NO_LIMIT
    for critic, name in zip(critics, params.critics, strict=True):
        own = params.critic(name)
        for field, value in KINDS[name].items():
            critic[field] = value
        critic["scale"] = own.scale
        critic["forward"] = getattr(own, "forward_point_distance", 0.0)
        critic["row"] = forwards.index(critic["forward"])
        critic["sum_scores"] = isinstance(own, ObstacleParams) and own.sum_scores
        critic["aggregation"] = AGGREGATIONS[own.aggregation_type] if isinstance(own, MapGridParams) else LAST
    return critics


def most_candidates(params: DwbParams) -> int:
    """Return a number of candidates that is never exceeded; an axis has a sample at 0 and two of rounding to spare."""
    return (max(2, params.vx_samples) + 3) * (max(2, params.vtheta_samples) + 3)
