"""The optimizer: roll out, score, take the soft-max mean, filter, shift.

Source: nav2_mppi_controller/src/optimizer.cpp (Humble).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, FollowerSetup, Twist
from controllers.mppi.batch import Batch, Demands
from controllers.mppi.critics import CRITICS
from controllers.mppi.kernels.update import (
    add_mean_noise,
    add_scores,
    clip_controls,
    filter_controls,
    remember,
    shift,
    soft_max,
)
from controllers.mppi.noise import Layout, NoiseSource
from controllers.mppi.params import MppiParams
from controllers.mppi.scene import Scene
from gym_mapbench.errors import ConfigError

SAME_PERIOD = 1e-6

Controls = NDArray[np.float32]


class Optimizer:
    """Keeps the control sequence of a run and improves it call by call.

    Args:
        params: MPPI's parameters.
        setup: What the controller server says about the run.
        source: Where noise comes from.

    Attributes:
        batch: The trajectories of the last rollout, and the control sequence.
        costs: ``(critics, blocks, samples)`` what each critic added in the last rollout.
        total: ``(blocks, samples)`` costs as in the soft-max.

    Raises:
        ConfigError: If the control period is longer than ``model_dt``.
    """

    def __init__(self, params: MppiParams, setup: FollowerSetup, source: NoiseSource) -> None:
        if setup.control_period > params.model_dt + SAME_PERIOD:
            raise ConfigError(
                f"model_dt: expected at least the control period ({setup.control_period:g} s), got {params.model_dt:g}"
            )
        self._params, self._source = params, source
        self._shifts = abs(setup.control_period - params.model_dt) < SAME_PERIOD
        layout = Layout(params.batch_size, params.time_steps)
        self.batch = Batch(layout, params.model_dt, (params.vx_std, params.wz_std), params.gamma)
        self.critics = [
            CRITICS[name](params.critic(name), params, setup) for name in params.critics if params.critic(name).enabled
        ]
        shape = (layout.blocks, layout.samples)
        self.costs = np.zeros((len(self.critics), *shape), dtype=np.float32)
        self.total, self._weights = np.zeros((2, *shape), dtype=np.float32)
        self._lanes = np.zeros((2, layout.samples // 4), dtype=np.float32)
        self._history_v, self._history_w = np.zeros((2, 4), dtype=np.float32)
        self.reset()

    def reset(self) -> None:
        """Forget the control sequence and its history, lift the speed limit, take new noise."""
        self.batch.v[:] = 0.0
        self.batch.w[:] = 0.0
        self._history_v[:] = 0.0
        self._history_w[:] = 0.0
        self.set_speed_limit(0.0)
        self.batch.noise = self._source.draw()

    def set_speed_limit(self, speed: float, percentage: bool = False) -> None:
        """Scale all limits so that ``vx_max`` becomes ``speed`` (m/s), or by per cent; 0 lifts the limit."""
        ratio = 1.0
        if speed:
            ratio = speed / 100.0 if percentage else speed / self._params.vx_max
        self._limits = tuple(ratio * value for value in (self._params.vx_min, self._params.vx_max, self._params.wz_max))

    def compute(self, scene: Scene) -> Twist:
        """Improve the control sequence and return the next command.

        Raises:
            ControllerAbort: If all trajectories collide. Humble's retries skip all critics and fail again, so only
                their resets are left of them.
        """
        self.optimize(scene)
        if scene.failed:
            for _ in range(self._params.retry_attempt_limit + 1):
                self.reset()
            raise ControllerAbort("Optimizer fail to compute path")
        self.filter()
        return self.send()

    def optimize(self, scene: Scene) -> None:
        """Roll out, score and update ``iteration_count`` times."""
        self.total[:] = 0.0
        for _ in range(self._params.iteration_count):
            if self._params.regenerate_noises:
                self.batch.noise = self._source.draw()
            self._score(scene)
            self._update()

    def filter(self) -> tuple[Controls, Controls]:
        """Smooth the control sequence; return copies of v and w."""
        filter_controls(self.batch.v, self._history_v)
        filter_controls(self.batch.w, self._history_w)
        return self.batch.v.copy(), self.batch.w.copy()

    def send(self) -> Twist:
        """Return the next command and move the control sequence on by a period."""
        v, w = self.batch.v, self.batch.w
        sent = 1 if self._shifts else 0
        remember(v, sent, self._history_v)
        remember(w, sent, self._history_w)
        command = Twist(float(v[sent]), float(w[sent]))
        if self._shifts:
            shift(v)
            shift(w)
        return command

    def _score(self, scene: Scene) -> None:
        """Roll out and add up what the critics say; after a failure the rest is not asked."""
        demands = Demands()
        for critic in self.critics:
            critic.demand(scene, demands)
        self.batch.roll_out(scene, demands)
        for critic, costs in zip(self.critics, self.costs, strict=True):
            scores = None if scene.failed else critic.score(scene, self.batch)
            if scores is None:
                costs[:] = 0.0
            else:
                add_scores(scores, critic.factor, critic.own.cost_power, costs, self.total)

    def _update(self) -> None:
        """Replace the control sequence by the soft-max mean of the sampled ones, within the limits."""
        batch, params = self.batch, self._params
        np.add(self.total, batch.effort, out=self.total)
        weight = soft_max(self.total, params.batch_size, params.temperature, self._weights)
        add_mean_noise(batch.noise.v, batch.noise.w, self._weights, weight, self._lanes, batch.v, batch.w)
        radius = params.AckermannConstraints.min_turning_r if params.motion_model == "Ackermann" else 0.0
        clip_controls(batch.v, batch.w, *self._limits, radius)
