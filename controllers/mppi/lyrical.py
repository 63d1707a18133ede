"""The optimizer as Lyrical has it.

It starts from the last command as far as the measured speeds allow, averages the controls as they were sampled, filters
before it limits, and checks the chosen trajectory.

Source: nav2_mppi_controller (Lyrical): src/optimizer.cpp, motion_models.hpp and optimal_trajectory_validator.hpp.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerError, FollowerSetup, Twist
from controllers.mppi.kernels.cycle import average, roll_out
from controllers.mppi.kernels.delay import delay, limit_batch
from controllers.mppi.kernels.sequence import limit_from_start, start_sequence
from controllers.mppi.kernels.update import FILTER, LINEAR_FILTER, send, smooth_and_remember
from controllers.mppi.kernels.validation import collides_along
from controllers.mppi.noise import NoiseSource
from controllers.mppi.optimizer import Array, Optimizer, Rollout
from controllers.mppi.params import MppiParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose


class LyricalOptimizer(Optimizer):
    """Keeps the control sequence of a run and improves it call by call; arguments as :class:`Optimizer`."""

    def __init__(self, params: MppiParams, setup: FollowerSetup, source: NoiseSource) -> None:
        self._queues = tuple(_queue(seconds, params) for seconds in (params.model_delay_vx, params.model_delay_wz))
        super().__init__(params, setup, source)
        self._nothing = np.zeros(params.time_steps, dtype=np.float32)
        self._averaged: tuple[Array, Array] = (self._limited[0], self._limited[1])
        self._filter = LINEAR_FILTER if params.sgf_order == 1 else FILTER
        ahead = np.float32(params.TrajectoryValidator.collision_lookahead_time) / np.float32(params.model_dt)
        self._checked = int(ahead)

    def _forget(self) -> None:
        """Forget the control sequence, its history and the commands sent."""
        super()._forget()
        for queue in self._queues:
            queue[:] = 0.0

    def compute(
        self, pose: Pose, velocity: Twist, path: NDArray[np.float64], goal: tuple[float, float], costmap: Costmap
    ) -> Twist:
        """Improve the control sequence and return the next command; arguments as in :meth:`optimize`.

        A call whose chosen trajectory collides is retried from a reset ``retry_attempt_limit`` times. If all
        trajectories collide, Nav2's retries ask no critic and fail again; here only their resets remain.

        Raises:
            ControllerError: If the chosen trajectory collides each time, or all trajectories do.
        """
        plan, self.chosen = self._begin(pose, velocity, path, goal, costmap), None
        for retries in range(self._params.retry_attempt_limit, -1, -1):
            self.total[:] = 0.0
            self._improve(plan, costmap.costs)
            self.smooth()
            self.limit()
            if not self.failed and not self.collides(costmap):
                sent = self.send()
                self.chosen = self.v.copy(), self.w.copy()
                return sent
            self._fall_back()
            if self.failed:
                self._fail_again(retries)
                break
        raise ControllerError("Optimizer fail to compute path")

    def _fall_back(self) -> None:
        """Reset within a call; with ``regenerate_noises``, the next noise is already there."""
        self._forget()
        if not self._params.regenerate_noises:
            self._noise = self._source.sample()

    def _fail_again(self, retries: int) -> None:
        """Take the noise that retries without critics take."""
        for _ in range(retries * (self._params.iteration_count if self._params.regenerate_noises else 1)):
            self._noise = self._source.sample()

    def _speeds_at_start(self, velocity: Twist) -> Twist:
        """Return the last command, or the speeds nearest to it that the measured ones can become within a period."""
        if self._params.open_loop:
            return self.sent
        names = ("control_period", "ax_min", "ax_max", "az_max")
        period, low, high, turn = (float(self._tuning[name][0]) for name in names)
        low, high, turn = period * low, period * high, period * turn
        return Twist(
            min(max(self.sent.v, velocity.v + low), velocity.v + high),
            min(max(self.sent.w, velocity.w - turn), velocity.w + turn),
        )

    def _end_iteration(self) -> None:
        self.smooth()
        self.limit()

    def _roll_out(self, costs: NDArray[np.uint8]) -> Rollout:
        """Sample controls, and roll out the velocities that the base can reach with them."""
        tuning, call, limited = self._tuning, self._call, self._limited
        start_sequence(tuning, call, self.v, self.w)
        reach = limit_batch(tuning, call, *self._noise[:2], self.v, self.w, limited)
        self._averaged = self._noise[:2]
        if self._params.clamp_raw_controls:
            self._averaged = limited[0] - self.v[:, None], limited[1] - self.w[:, None]
        longest, fastest = self._delay(*reach)
        rollout = limited[0], limited[1], self._nothing, self._nothing
        refresh_every = roll_out(
            tuning, call, self._scan, costs, (limited[0], limited[1], longest, fastest), self._nothing, self._nothing,
            (self._nothing, self._nothing, np.float32(0.0)), *self._speeds, self._keep, self._kept, self._looked,
            self._collected,
        )  # fmt: skip
        return refresh_every, *rollout

    def _delay(self, longest: float, fastest: float) -> tuple[float, float]:
        """Let the velocities come later; return bounds of the sum of a sample's speeds and of its turn rates."""
        for velocities, queue in zip(self._limited, self._queues, strict=True):
            if len(queue):
                delay(velocities, queue)
        speeds, turns = (np.abs(queue) for queue in self._queues)
        return longest + float(speeds.sum()), max(fastest, float(turns.max(initial=0.0)))

    def _update(self, rollout: Rollout, rows: NDArray[np.int64]) -> None:
        """Add up the costs and replace the control sequence by the mean of the controls as sampled."""
        summed = self._collected, rows, self._factors, self._powers, self.critic_costs, self.total
        average(self._tuning, *self._averaged, self.v, self.w, *summed)

    def smooth(self) -> None:
        """Apply the Savitzky-Golay filter to the control sequence, and remember the filtered command."""
        smooth_and_remember(self.v, self.w, self._history_v, self._history_w, self._filter, self._shifts)

    def limit(self) -> None:
        """Bring the control sequence within the limits of speed and acceleration."""
        limit_from_start(self._tuning, self._call, self.v, self.w)

    def collides(self, costmap: Costmap) -> bool:
        """Whether the trajectory validator refuses the control sequence."""
        return bool(
            collides_along(
                self._call, self._params.model_dt, self.v, self.w, self._checked, costmap.costs, self._corners,
                self._params.TrajectoryValidator.consider_footprint,
            )
        )  # fmt: skip

    def send(self) -> Twist:
        """Return the next command and move the control sequence on by a period."""
        self.sent = Twist(*send(self.v, self.w, self._history_v, self._history_w, self._shifts, False))
        for queue, value in zip(self._queues, self.sent, strict=True):
            queue[:-1] = queue[1:]
            queue[-1:] = value
        return self.sent


def _queue(seconds: float | None, params: MppiParams) -> Array:
    """Return room for the commands that a delay holds back."""
    steps = int(np.floor(np.float32(seconds or 0.0) / np.float32(params.model_dt) + np.float32(0.5)))
    return np.zeros(steps, dtype=np.float32)


def make_optimizer(params: MppiParams, setup: FollowerSetup, source: NoiseSource) -> Optimizer:
    """Make the optimizer of the release; arguments as :class:`Optimizer`."""
    return (LyricalOptimizer if params.release == "lyrical" else Optimizer)(params, setup, source)
