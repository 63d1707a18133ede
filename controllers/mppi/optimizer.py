"""The optimizer of a run: its control sequence, its noise, and when both begin anew.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, FollowerSetup, Twist
from controllers.mppi.kernels.critics import CRITICS
from controllers.mppi.kernels.cycle import optimize
from controllers.mppi.kernels.update import send, smooth
from controllers.mppi.noise import Layout, Noise, NoiseSource
from controllers.mppi.params import MppiParams
from controllers.mppi.records import CALL, make_tuning
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.scenario import Pose

SAME_PERIOD = 1e-6
HISTORY = 4

Array = NDArray[np.float32]


class Optimizer:
    """Keeps the control sequence of a run and improves it call by call.

    Args:
        params: MPPI's parameters.
        setup: What the controller server says about the run.
        source: Where noise comes from.

    Attributes:
        v, w: ``(time_steps,)`` control sequence, m/s and rad/s.
        critics: Names of the critics that are enabled, in their order.
        critic_costs: ``(critics, blocks, samples)`` what each added in the last rollout.
        total: ``(blocks, samples)`` costs as in the soft-max.
        failed: Whether all trajectories of the last call collide.
        furthest: Index of the furthest path point the last call reached; -1 if no critic asked.

    Raises:
        ConfigError: If the control period is longer than ``model_dt``.
    """

    _noise: Noise

    def __init__(self, params: MppiParams, setup: FollowerSetup, source: NoiseSource) -> None:
        if setup.control_period > params.model_dt + SAME_PERIOD:
            raise ConfigError(
                f"model_dt: expected at least the control period ({setup.control_period:g} s), got {params.model_dt:g}"
            )
        self._params, self._source = params, source
        self._shifts = abs(setup.control_period - params.model_dt) < SAME_PERIOD
        self._tuning, self._call = make_tuning(params, setup), np.zeros(1, dtype=CALL)
        self._corners = np.array(setup.footprint.corners, dtype=np.float64)
        self.critics = tuple(name for name in params.critics if params.critic(name).enabled)
        self._order = np.array([CRITICS.index(name) for name in self.critics], dtype=np.int64)
        layout = Layout(params.batch_size, params.time_steps)
        self.critic_costs = np.zeros((len(self.critics), layout.blocks, layout.samples), dtype=np.float32)
        self.total = np.zeros((layout.blocks, layout.samples), dtype=np.float32)
        self.v, self.w = np.zeros((2, params.time_steps), dtype=np.float32)
        self._history_v, self._history_w = np.zeros((2, HISTORY), dtype=np.float32)
        self.reset()

    @property
    def failed(self) -> bool:
        """Whether all trajectories of the last call collide."""
        return bool(self._call["failed"][0])

    @property
    def furthest(self) -> int:
        """Index of the furthest path point the last call reached; -1 if no critic asked."""
        return int(self._call["furthest"][0])

    def reset(self) -> None:
        """Forget the control sequence and its history, lift the speed limit, take new noise."""
        for values in (self.v, self.w, self._history_v, self._history_w):
            values[:] = 0.0
        self.set_speed_limit(0.0)
        self._noise = self._source.draw()

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Scale all limits so that ``vx_max`` becomes ``speed`` (m/s), or by per cent; 0 lifts the limit."""
        ratio = 1.0
        if speed:
            ratio = speed / 100.0 if percentage else speed / self._params.vx_max
        self._tuning["highest_speed"] = ratio * self._params.vx_max
        self._tuning["lowest_speed"] = ratio * self._params.vx_min
        self._tuning["fastest_turn"] = ratio * self._params.wz_max

    def compute(self, pose: Pose, velocity: Twist, path: NDArray[np.float64], costmap: Costmap) -> Twist:
        """Improve the control sequence and return the next command; arguments as in :meth:`optimize`.

        Raises:
            ControllerAbort: If all trajectories collide. Humble's retries skip all critics and fail again, so only
                their resets are left of them.
        """
        self.optimize(pose, velocity, path, costmap)
        if self.failed:
            for _ in range(self._params.retry_attempt_limit + 1):
                self.reset()
            raise ControllerAbort("Optimizer fail to compute path")
        self.smooth()
        return self.send()

    def optimize(self, pose: Pose, velocity: Twist, path: NDArray[np.float64], costmap: Costmap) -> None:
        """Roll out, score and update ``iteration_count`` times.

        Args:
            pose: Robot.
            velocity: Measured speeds.
            path: ``(m, 3)`` local path, x, y in m and yaw in rad.
            costmap: Local costmap.
        """
        points = np.ascontiguousarray(path.T, dtype=np.float32)
        self._begin_call(pose, velocity, points, costmap)
        self.total[:] = 0.0
        for _ in range(self._params.iteration_count):
            if self._params.regenerate_noises:
                self._noise = self._source.draw()
            optimize(
                self._tuning, self._call, self._order, points, costmap.costs, self._corners,
                *self._noise, self.v, self.w, self.critic_costs, self.total,
            )  # fmt: skip

    def smooth(self) -> None:
        """Apply the Savitzky-Golay filter to the control sequence."""
        smooth(self.v, self.w, self._history_v, self._history_w)

    def send(self) -> Twist:
        """Return the next command and move the control sequence on by a period."""
        return Twist(send(self.v, self._history_v, self._shifts), send(self.w, self._history_w, self._shifts))

    def _begin_call(self, pose: Pose, velocity: Twist, points: Array, costmap: Costmap) -> None:
        """Write down what a call is about; what MPPI calls the goal is the end of the local path."""
        end_x, end_y, end_yaw = points[:, -1].tolist()
        x, y, yaw = pose
        squared_distance = (x - end_x) ** 2 + (y - end_y) ** 2
        self._call[0] = (
            x, y, yaw, *velocity, end_x, end_y, end_yaw, squared_distance,
            costmap.resolution, costmap.origin_x, costmap.origin_y, costmap.track_unknown_space, False, -1,
        )  # fmt: skip
