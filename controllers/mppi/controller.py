"""MppiFollower: Nav2's Model Predictive Path Integral controller as a path follower."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import FollowerSetup, InvalidPath, LocalPlan, Twist
from controllers.mppi.lyrical import make_optimizer
from controllers.mppi.noise import make_source
from controllers.mppi.optimizer import Optimizer
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import PathHandler, end_of
from controllers.mppi.trajectories import MppiSamples, samples_of
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose


class MppiFollower:
    """Model Predictive Path Integral control.

    Args:
        params: Parameters; the defaults of Nav2's code if None.
    """

    _optimizer: Optimizer
    _start: Pose

    def __init__(self, params: MppiParams | None = None) -> None:
        self.params = params or MppiParams()
        self._paths = PathHandler(self.params)
        self._last_call: float | None = None
        self._local: LocalPlan | None = None

    def reset(self, setup: FollowerSetup) -> None:
        """Forget everything of the last run.

        Raises:
            ConfigError: If the control period is longer than ``model_dt``.
        """
        self._optimizer = make_optimizer(self.params, setup, make_source(self.params, setup.rng))
        self._paths = PathHandler(self.params)
        self._last_call = self._local = None

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Take a new global plan, ``(n, 3)`` x, y in m and yaw in rad, start to goal."""
        self._paths.set_plan(path)

    def move_plan(self, path: NDArray[np.float64]) -> None:
        """Take the same plan at its new place; poses that were passed stay passed."""
        self._paths.move_plan(path)

    def take_local_plan(self, local: LocalPlan) -> None:
        """Take the part of the plan to follow (Lyrical)."""
        self._local = local

    def end_action(self) -> None:
        """Forget the control sequence and take new noise (``reset``, called since Jazzy when an action ends)."""
        self._optimizer.reset()

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Limit the speed to ``speed`` m/s or per cent of ``vx_max``; 0 lifts it, and so does Humble's reset."""
        self._optimizer.set_speed_limit(speed, percentage)

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Return the next command; arguments as in :class:`controllers.base.PathFollower`.

        Raises:
            InvalidPath: If no path is left ahead.
            ControllerAbort: If all trajectories collide, in Humble.
            ControllerError: If all trajectories collide, in Jazzy; in Lyrical also if the chosen one does.
        """
        patience = self.params.reset_period
        if patience is not None and self._last_call is not None and now - self._last_call > patience:
            self._optimizer.reset()
        self._last_call, self._start = now, pose
        path, goal = self._way(pose, costmap)
        return self._optimizer.compute(pose, velocity, path, goal, costmap)

    def _way(self, pose: Pose, costmap: Costmap) -> tuple[NDArray[np.float64], tuple[float, float]]:
        """Return the local path, and the goal in the sense of the critics, m."""
        if self.params.release != "lyrical":
            path = self._paths.local_path(pose, costmap)
            return path, self._paths.goal(path)
        if self._local is None:
            raise InvalidPath("Received plan with zero length")
        return self._local.path, end_of(self._local.path)

    def last_samples(self, count: int) -> MppiSamples | None:
        """Return some of the trajectories that the last call has sampled, and the chosen one; None before a call.

        Args:
            count: Most trajectories; they are chosen evenly from the cheapest to the most expensive.
        """
        return None if self._last_call is None else samples_of(self._optimizer, self.params, self._start, count)
