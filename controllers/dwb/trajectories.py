"""The candidates of one cycle: their twists and the poses they would drive through.

Source: nav2_dwb_controller/dwb_plugins (StandardTrajectoryGenerator, LimitedAccelGenerator).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels_sampling import (
    axis_samples,
    candidate_twists,
    count_steps,
    find_cells,
    group_candidates,
    lay_out,
    roll_out,
)
from controllers.dwb.kernels_scoring import worst_costs
from controllers.dwb.params import DwbParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


class Trajectories:
    """All candidates, rolled out; refilled every cycle.

    Candidate ``i`` has poses ``0..steps[i]``. Pose k has its position at ``x[places[i, 0] + k * places[i, 1]]``
    (``y`` and ``cells`` alike) and its heading at ``yaw[places[i, 2] + k]`` (``cos`` and ``sin`` alike).

    Attributes:
        twists: ``(n, 2)`` sampled (v m/s, omega rad/s), in Nav2's order.
        velocities: ``(n, 2)`` what the robot would be told: the sample, or with ``limit_vel_cmd_in_traj`` the
            velocity of the first step.
        steps: ``(n,)`` number of time steps.
        places: ``(n, 3)`` see above.
        x, y: Positions, m.
        yaw, cos, sin: Headings, rad, not wrapped.
        cells: Flat costmap index of every position, -1 off the map.
        worst: ``(n,)`` dearest cell under each trajectory, 256 if it leaves the map.
    """

    def __init__(self) -> None:
        self._positions = np.empty((2, 0))
        self._headings = np.empty((3, 0))
        self._cells = np.empty(0, dtype=np.int32)

    def fill(self, params: DwbParams, control_period: float, pose: Pose, velocity: Twist, costmap: Costmap) -> None:
        """Sample and roll out the candidates of this cycle.

        Args:
            params: The parameters, scaled by the speed limit in force.
            control_period: Seconds between two calls.
            pose: Pose of the robot.
            velocity: Its velocity.
            costmap: The local costmap.
        """
        self.twists, index = self._sample(params, control_period, velocity)
        self.steps = self._count_steps(params)
        order, start = group_candidates(index, self.steps)
        self.places, positions, headings = lay_out(order, start, self.steps)
        self._reserve(positions, headings)
        self._roll_out(params, order, start, np.array([*pose, *velocity], dtype=np.float64))
        self._look_up(costmap)

    def poses(self, candidate: int) -> Floats:
        """Return the poses of one candidate, ``(steps + 1, 3)`` x, y in m and yaw in rad."""
        first, width, heading = self.places[candidate]
        k = np.arange(self.steps[candidate] + 1)
        return np.stack([self.x[first + k * width], self.y[first + k * width], self.yaw[heading + k]], axis=1)

    def _sample(self, params: DwbParams, control_period: float, velocity: Twist) -> tuple[Floats, Integers]:
        reach = (params.sim_period or control_period) if params.samples_one_period else params.sim_time
        p = params
        vx = axis_samples(velocity.v, p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, reach, p.vx_samples)
        turn = p.max_vel_theta
        omega = axis_samples(velocity.w, -turn, turn, p.acc_lim_theta, p.decel_lim_theta, reach, p.vtheta_samples)
        twists, index = candidate_twists(vx, omega, p.max_speed_xy, p.min_speed_xy, p.min_speed_theta)
        return twists, index

    def _count_steps(self, params: DwbParams) -> Integers:
        if params.discretize_by_time:
            return np.full(len(self.twists), max(1, math.ceil(params.sim_time / params.time_granularity)))
        steps: Integers = count_steps(
            self.twists, params.sim_time, params.linear_granularity, params.angular_granularity
        )
        return steps

    def _reserve(self, positions: int, headings: int) -> None:
        """Make room: buffers grow and are kept, since a fresh page costs more than the arithmetic on it."""
        if positions > self._positions.shape[1]:
            self._positions = np.empty((2, 2 * positions))
            self._cells = np.empty(2 * positions, dtype=np.int32)
        if headings > self._headings.shape[1]:
            self._headings = np.empty((3, 2 * headings))
        self.x, self.y = self._positions[:, :positions]
        self.yaw, self.cos, self.sin = self._headings[:, :headings]
        self.cells = self._cells[:positions]

    def _roll_out(self, params: DwbParams, order: Integers, start: Integers, state: Floats) -> None:
        limits = np.array([params.acc_lim_x, params.decel_lim_x, params.acc_lim_theta, params.decel_lim_theta])
        if params.samples_one_period:
            limits = np.array([np.inf, -np.inf, np.inf, -np.inf])
        first = np.empty_like(self.twists)
        roll_out(
            self.twists, self.steps, order, start, self.places, state, limits, params.sim_time,
            self.x, self.y, self.yaw, self.cos, self.sin, first,
        )  # fmt: skip
        self.velocities = first if params.limit_vel_cmd_in_traj else self.twists

    def _look_up(self, costmap: Costmap) -> None:
        rows, cols = costmap.costs.shape
        find_cells(self.x, self.y, costmap.origin_x, costmap.origin_y, costmap.resolution, rows, cols, self.cells)
        self.worst = np.empty(len(self.steps), dtype=np.int16)
        worst_costs(self.steps, self.places, self.cells, costmap.costs, self.worst)
