"""The candidates of one cycle: their twists and the poses they would drive through.

Source: nav2_dwb_controller/dwb_plugins (StandardTrajectoryGenerator, LimitedAccelGenerator).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels.rollout import first_velocities, look_under, roll_out
from controllers.dwb.kernels.sampling import choose_candidates
from controllers.dwb.params import DwbParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose

Floats = NDArray[np.float64]


class Trajectories:
    """All candidates, rolled out; refilled every cycle.

    Candidate ``i`` has poses ``0..steps[i]``. Pose k has its position at ``x[places[i, 0] + k * places[i, 1]]``
    (``y`` and ``cells`` alike) and its heading at ``yaw[places[i, 2] + k]`` (``cos`` and ``sin`` alike).

    Args:
        params: The parameters, scaled by the speed limit in force.
        control_period: Seconds between two calls.

    Attributes:
        twists: ``(n, 2)`` sampled (v m/s, omega rad/s), in Nav2's order.
        velocities: ``(n, 2)`` what the robot would be told: the sample, or with ``limit_vel_cmd_in_traj`` the
            velocity of the first step.
        steps: ``(n,)`` number of time steps.
        places: ``(n, 3)``; see above.
        x, y: Positions, m.
        yaw, cos, sin: Headings, rad, not wrapped.
        cells: Flat costmap index of every position, -1 off the map.
        worst: ``(n,)`` dearest cell under each trajectory, 256 if it leaves the map.
    """

    def __init__(self, params: DwbParams, control_period: float) -> None:
        p, inf = params, np.inf
        self._axes = np.array(
            [
                [p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, p.vx_samples],
                [-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta, p.vtheta_samples],
            ]
        )
        self._speeds = np.array([p.max_speed_xy, p.min_speed_xy, p.min_speed_theta])
        by_distance = [inf, p.linear_granularity, p.angular_granularity]
        self._granularity = np.array([p.time_granularity, inf, inf] if p.discretize_by_time else by_distance)
        self._sim_time = p.sim_time
        self._reach = (p.sim_period or control_period) if p.samples_one_period else p.sim_time
        # The LimitedAccelGenerator drives the sample from the first step on.
        self._limits = np.array([inf, -inf, inf, -inf]) if p.samples_one_period else self._axes[:, 2:4].ravel()
        self._gives_first_velocity = p.limit_vel_cmd_in_traj
        self._positions = np.empty((2, 0))
        self._headings = np.empty((3, 0))
        self._cells = np.empty(0, dtype=np.int32)

    def fill(self, pose: Pose, velocity: Twist, costmap: Costmap) -> None:
        """Sample and roll out the candidates of this cycle, and look at the costmap under them."""
        state = np.array([*pose, *velocity], dtype=np.float64)
        self.twists, self.steps, order, start, self.places, positions, headings = choose_candidates(
            velocity.v, velocity.w, self._axes, self._reach, self._speeds, self._sim_time, self._granularity
        )
        self._reserve(positions, headings)
        roll_out(
            state, self._limits, self._sim_time, self.twists, self.steps, order, start, self.places,
            self.x, self.y, self.yaw, self.cos, self.sin,
        )  # fmt: skip
        self.velocities = self.twists
        if self._gives_first_velocity:
            self.velocities = first_velocities(state, self._limits, self._sim_time, self.twists, self.steps)
        look_under(
            costmap.costs, costmap.origin_x, costmap.origin_y, costmap.resolution,
            self.x, self.y, self.steps, self.places, self.cells, self.worst,
        )  # fmt: skip

    def poses(self, candidate: int) -> Floats:
        """Return the poses of one candidate, ``(steps + 1, 3)`` x, y in m and yaw in rad."""
        first, width, heading = self.places[candidate]
        k = np.arange(self.steps[candidate] + 1)
        return np.stack([self.x[first + k * width], self.y[first + k * width], self.yaw[heading + k]], axis=1)

    def _reserve(self, positions: int, headings: int) -> None:
        """Make room: buffers grow and are kept, since a fresh page costs more than the arithmetic on it."""
        if positions > len(self._cells):
            self._positions = np.empty((2, 2 * positions))
            self._cells = np.empty(2 * positions, dtype=np.int32)
        if headings > self._headings.shape[1]:
            self._headings = np.empty((3, 2 * headings))
        self.x, self.y = self._positions[0, :positions], self._positions[1, :positions]
        self.yaw, self.cos, self.sin = self._headings[:, :headings]
        self.cells = self._cells[:positions]
        self.worst = np.empty(len(self.steps), dtype=np.int64)
