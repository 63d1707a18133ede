"""The plant of the recordings: 100 Hz, bounded accelerations, heading at mid-step."""

from __future__ import annotations

import math
from collections.abc import Callable

from controllers.base import STOP, Twist
from gym_mapbench.world.scenario import Pose, wrap_angle

STEP = 0.01
MOST_V, MOST_W = 0.025, 0.032
"""Largest changes of speed in one step, m/s and rad/s."""


class RecordedPlant:
    """A robot that follows the newest command.

    Args:
        pose: Where it starts.
        velocity: How fast it moves at first.
        is_stuck: Whether the robot keeps its pose in the step that ends at this time, s.
    """

    def __init__(self, pose: Pose, velocity: Twist, is_stuck: Callable[[float], bool] = lambda now: False) -> None:
        self.pose, self.velocity, self.command = pose, velocity, STOP
        self._is_stuck = is_stuck

    def advance(self, now: float) -> None:
        """Make the step that ends at ``now``, s."""
        v = self.velocity.v + _within(self.command.v - self.velocity.v, MOST_V)
        w = self.velocity.w + _within(self.command.w - self.velocity.w, MOST_W)
        self.velocity = Twist(v, w)
        if self._is_stuck(now):
            return
        x, y, yaw = self.pose
        middle = yaw + w * STEP / 2
        x, y = x + v * math.cos(middle) * STEP, y + v * math.sin(middle) * STEP
        self.pose = Pose(x, y, wrap_angle(yaw + w * STEP))


def _within(change: float, limit: float) -> float:
    return min(max(change, -limit), limit)
