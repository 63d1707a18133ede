"""MPPI's parameters and the state of a call as records, the form in which kernels take many named values."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup
from controllers.mppi.params import MppiParams
from controllers.records import fill_groups, record_of
from gym_mapbench.errors import ConfigError

Record = NDArray[np.void]

SAME_PERIOD = 1e-6
INSCRIBED = 253
NO_PREFERENCE = 1

TUNING = record_of(
    MppiParams,
    ("jazzy", np.bool_),
    ("lyrical", np.bool_),
    ("ackermann", np.bool_),
    ("either_way", np.bool_),
    ("highest_speed", np.float64),
    ("lowest_speed", np.float64),
    ("fastest_turn", np.float64),
    ("xy_goal_tolerance", np.float64),
    ("inscribed_radius", np.float64),
    ("circumscribed_cost", np.float64),
    ("looks", np.int64),
    ("control_period", np.float64),
    ("shifts", np.bool_),
)
"""MPPI's parameters under their own names, critics as groups, and what the run adds: whether Jazzy's rules hold, rather
than Humble's, and whether Lyrical's changes of them do; whether PathAngle accepts looking backwards, the limits in
force (m/s, rad/s), the goal checker's tolerance (m), the footprint's inscribed radius (m) and the cost at its
circumscribed radius; number of points of a trajectory at which the Cost critic looks up cells; the control period (s),
and whether the control sequence is moved on by a step in every call."""

CALL = np.dtype(
    [
        *((name, np.float64) for name in ("x", "y", "yaw", "v", "w")),
        *((name, np.float64) for name in ("base_x", "base_y", "base_yaw", "sum_x", "sum_y", "sum_yaw")),
        *((name, np.float64) for name in ("goal_x", "goal_y", "end_yaw", "squared_distance")),
        *((name, np.float64) for name in ("resolution", "origin_x", "origin_y")),
        ("unknown_is_free", np.bool_),
        ("failed", np.bool_),
        ("obstacle_hits", np.int64),
        ("furthest", np.int64),
        *((name, np.float64) for name in ("target_x", "target_y", "target_yaw")),
    ],
    align=True,
)
"""One call: pose (m, rad) of the robot and speeds at the start of the rollout (m/s, rad/s); what is added to the sums
of a rollout and where they begin (m, rad; see :mod:`controllers.mppi.kernels.rollout`); the goal (m; in Jazzy the end
of the plan, else the last point of the local path), its squared distance (in Lyrical along the local path), and the
heading at the end of the local path (rad); place of the costmap (m). Written during the call: whether all trajectories
collide, how many do for the Obstacles critic, the furthest path point reached (-1 until known), and the point that
PathAngle looks at (m, from the robot) with the path's heading there (rad)."""


def refuse_short_step(model_dt: float, control_period: float) -> None:
    """Refuse a time step with which Nav2's controller server does not start.

    Args:
        model_dt: Time between two points of a trajectory, s.
        control_period: Seconds between two commands, 1 / ``controller_frequency``.

    Raises:
        ConfigError: If the control period is longer than ``model_dt``.
    """
    if control_period > model_dt + SAME_PERIOD:
        raise ConfigError(f"model_dt: expected at least the control period ({control_period:g} s), got {model_dt:g}")


def make_tuning(params: MppiParams, setup: FollowerSetup) -> Record:
    """Return the ``(1,)`` record of a run."""
    tuning = np.zeros(1, dtype=TUNING)
    fill_groups(tuning, params)
    tuning["ackermann"] = params.motion_model == "Ackermann"
    tuning["xy_goal_tolerance"] = setup.xy_goal_tolerance
    tuning["inscribed_radius"] = setup.footprint.inscribed_radius
    tuning["circumscribed_cost"] = _circumscribed_cost(setup)
    reverses, angle = abs(params.vx_min) >= 1e-6, params.PathAngleCritic
    tuning["looks"] = _looks(params)
    tuning["control_period"] = setup.control_period
    tuning["shifts"] = abs(setup.control_period - params.model_dt) < SAME_PERIOD
    if params.release == "humble":
        tuning["either_way"] = reverses and not angle.forward_preference
        tuning["CostCritic"]["near_collision_cost"] = INSCRIBED
        tuning["CostCritic"]["trajectory_point_step"] = 1
        return tuning
    tuning["jazzy"], tuning["lyrical"] = True, params.release == "lyrical"
    tuning["either_way"] = reverses and angle.mode == NO_PREFERENCE
    tuning["ObstaclesCritic"]["cost_scaling_factor"] = setup.cost_scaling_factor
    tuning["ObstaclesCritic"]["inflation_radius"] = setup.inflation_radius
    if setup.inflation_radius < setup.footprint.circumscribed_radius:
        tuning["circumscribed_cost"] = 0.0
    for name, sign in {"ax_max": 1.0, "ax_min": -1.0, "az_max": 1.0}.items():  # Nav2 corrects wrong signs, too
        tuning[name] = sign * abs(tuning[name])
    return tuning


def _looks(params: MppiParams) -> int:
    """Number of points of a trajectory at which the Cost critic looks up cells."""
    every = params.CostCritic.trajectory_point_step or 1
    return (params.time_steps - 1) // every + 1 if params.release == "lyrical" else params.time_steps // every


def _circumscribed_cost(setup: FollowerSetup) -> float:
    """Cost at which the footprint can begin to touch something: the inflation layer's (``findCircumscribedCost``)."""
    footprint, custom = setup.footprint, setup.custom_inscribed_radius
    beyond = footprint.circumscribed_radius - (footprint.inscribed_radius if custom < 0.0 else custom)
    return float(int(252.0 * math.exp(-setup.cost_scaling_factor * beyond))) if beyond > 0 else 253.0
