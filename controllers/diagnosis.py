"""Why a run ended before the goal, in words: where the robot stood, what failed and why, and what would help."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.metrics.episode import RECOVERY_KINDS, Event

STANDING_RADIUS = 0.3
"""A robot that stays within this radius (m) counts as standing, however it turns."""
STANDING_SECONDS = 5.0
"""From this time on (s) it is said since when the robot stood."""

ADVICE = {
    "collision ahead": "RPP stops where its arc meets an obstacle within max_allowed_time_to_collision_up_to_carrot: a "
    "shorter lookahead_dist keeps the arc nearer to the path",
    "Optimizer fail to compute path": "all of MPPI's trajectories collide: the robot is too close to an obstacle to "
    "leave by its samples; a larger vx_std or wz_std, or a wider passage, helps",
    "no valid trajectories": "DWB sees no candidate without a collision: more samples (vx_samples, vtheta_samples) or "
    "a shorter sim_time leave it some",
    "NavFn follows at most": "Smac 2D and Theta* (--planner) know no such limit",
    "is in an obstacle": "the costmap leaves the robot no room at the start or at the goal",
    "no path": "the global costmap leaves no way: passages narrower than the robot, its footprint_padding and a cell "
    "on either side are closed",
}
"""Part of a failure's reason -> its meaning and a remedy."""


def diagnose(trajectory: NDArray[np.float64], control_period: float, events: Sequence[Event], explanation: str) -> str:
    """Say in one line why a run got no farther.

    Args:
        trajectory: ``(steps + 1, >= 2)`` x and y of every control step, m.
        control_period: Seconds of one step.
        events: What happened, in order.
        explanation: The controller's account of its last decision; may be empty.
    """
    parts = [where_it_stood(trajectory, control_period), *who_gave_up(events)]
    advice = next((text for mark, text in ADVICE.items() if any(mark in event.detail for event in events)), "")
    return "; ".join(part for part in (*parts, explanation, advice) if part)


def where_it_stood(trajectory: NDArray[np.float64], control_period: float) -> str:
    """Say where a robot ended, and since when it stood there if that was long."""
    x, y = trajectory[-1, :2]
    away = np.hypot(*(trajectory[:, :2] - trajectory[-1, :2]).T) > STANDING_RADIUS
    since = (int(np.flatnonzero(away)[-1]) + 1 if away.any() else 0) * control_period
    if (len(trajectory) - 1) * control_period - since < STANDING_SECONDS:
        return f"it ended at ({x:.2f}, {y:.2f})"
    return f"it stood at ({x:.2f}, {y:.2f}) from {since:.1f} s on"


def who_gave_up(events: Sequence[Event]) -> list[str]:
    """Say how often controller and planner failed, for which reason mostly, and how many recoveries were tried."""
    said = []
    for kind, who in (("controller_failure", "the controller"), ("replan_failure", "the planner")):
        reasons = Counter(event.detail for event in events if event.kind == kind)
        if reasons:
            reason, _ = reasons.most_common(1)[0]
            said.append(f"{who} failed {_times(reasons.total())} ({reason})")
    recoveries = sum(event.kind in RECOVERY_KINDS for event in events)
    tried = "1 recovery" if recoveries == 1 else f"{recoveries} recoveries"
    return [*said, f"{tried} did not help"] if recoveries else said


def _times(count: int) -> str:
    return "once" if count == 1 else f"{count} times"
