"""The candidates of one cycle: their twists and where they would lead.

Source: nav2_dwb_controller/dwb_plugins (StandardTrajectoryGenerator, LimitedAccelGenerator).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.dwb.kernels.rollout import first_velocities, roll_out, trace
from controllers.dwb.params import DwbParams, MapGridParams
from controllers.releases import Release
from gym_mapbench.costmap import Costmap
from gym_mapbench.scenario import Pose

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

SLACK: dict[Release, float] = {"humble": 1e-5, "jazzy": float(np.finfo(np.float32).eps)}
"""How far a sample may exceed the limits of speed: in the squared speed, m^2/s^2, and in the turn rate, rad/s."""


class Trajectories:
    """All candidates of one cycle, rolled out; refilled every cycle.

    Args:
        params: The parameters, scaled by the speed limit in force.
        control_period: Seconds between two calls.

    Attributes:
        state: ``(5,)`` the robot's x, y, yaw, v, omega.
        limits: ``(4,)`` acceleration and deceleration of v, then of omega.
        sim_time: Duration of all trajectories, s.
        twists: ``(n, 2)`` sampled (v m/s, omega rad/s), in Nav2's order.
        velocities: ``(n, 2)`` commands: the sample, or with ``limit_vel_cmd_in_traj`` the velocity of the first step.
        steps: ``(n,)`` number of time steps.
        ends: ``(n, 2)`` last positions, m.
        box: Lowest and highest x, lowest and highest y of all points that critics look up, m: those ahead of the last
            poses or, if a map grid aggregates all poses, all that can be reached.
        headings: ``(n,)`` index at which the headings of each candidate begin in ``yaw``, ``cos`` and ``sin``.
        yaw: Headings of all groups of candidates, one after another, rad, not wrapped.
        cos: Their cosines.
        sin: Their sines.
    """

    state: Floats
    twists: Floats
    velocities: Floats
    steps: Integers
    headings: Integers
    ends: Floats
    yaw: Floats
    cos: Floats
    sin: Floats
    box: tuple[float, float, float, float]
    _last_cells: Integers

    def __init__(self, params: DwbParams, control_period: float) -> None:
        p, inf = params, np.inf
        self._axes = np.array(
            [
                [p.min_vel_x, p.max_vel_x, p.acc_lim_x, p.decel_lim_x, p.vx_samples],
                [-p.max_vel_theta, p.max_vel_theta, p.acc_lim_theta, p.decel_lim_theta, p.vtheta_samples],
            ]
        )
        self._speeds = np.array([p.max_speed_xy, p.min_speed_xy, p.min_speed_theta, SLACK[p.release]])
        by_distance = [inf, p.linear_granularity, p.angular_granularity]
        self._granularity = np.array([p.time_granularity, inf, inf] if p.discretize_by_time else by_distance)
        self._horizon = (p.sim_period or control_period) if p.samples_one_period else p.sim_time
        self._gives_first_velocity = p.limit_vel_cmd_in_traj
        ahead = {p.GoalAlign.forward_point_distance, p.PathAlign.forward_point_distance}
        grids = (p.critic(name) for name in p.critics)
        self._whole_way = any(isinstance(grid, MapGridParams) and grid.aggregation_type != "last" for grid in grids)
        self._rows = {forward: row for row, forward in enumerate(sorted(ahead | {0.0}))}
        self._forwards = np.array(list(self._rows))
        self.sim_time = p.sim_time
        # The LimitedAccelGenerator drives the sample from the first step on.
        self.limits = np.array([inf, -inf, inf, -inf]) if p.samples_one_period else self._axes[:, 2:4].ravel()

    def fill(self, pose: Pose, velocity: Twist, costmap: Costmap) -> None:
        """Sample and roll out the candidates of this cycle, and find where on the costmap they end."""
        self.state = np.array([*pose, *velocity], dtype=np.float64)
        m = costmap
        (
            self.twists, self.steps, self.headings, self.ends, self.yaw, self.cos, self.sin, self._last_cells, self.box,
        ) = roll_out(
            self.state, self._axes, self._horizon, self._speeds, self.sim_time, self._granularity, self.limits,
            self._forwards, m.origin_x, m.origin_y, m.resolution, m.costs.shape,
        )  # fmt: skip
        self.velocities = self.twists
        if self._gives_first_velocity:
            self.velocities = first_velocities(self.state, self.limits, self.sim_time, self.twists, self.steps)
        if self._whole_way:
            fastest = max(abs(velocity.v), abs(self._axes[0, 0]), abs(self._axes[0, 1]))
            reach = fastest * self.sim_time + self._forwards[-1]
            self.box = (pose.x - reach, pose.x + reach, pose.y - reach, pose.y + reach)

    def last_cells(self, forward: float) -> Integers:
        """Flat costmap indices of the points ``forward`` (m) of the last poses, ``(n,)``, -1 off the map."""
        cells: Integers = self._last_cells[self._rows[forward]]
        return cells

    def poses(self, candidate: int) -> Floats:
        """Return the poses of one candidate, ``(steps + 1, 3)`` x, y in m and yaw in rad."""
        count, first = self.steps[candidate], self.headings[candidate]
        way = slice(first, first + count + 1)
        poses = np.empty((count + 1, 3))
        poses[:, 2] = self.yaw[way]
        target, dt = self.twists[candidate, 0], self.sim_time / count
        trace(self.state, target, self.limits, dt, self.cos[way], self.sin[way], poses)
        return poses
