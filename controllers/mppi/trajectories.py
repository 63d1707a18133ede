"""The trajectories that MPPI has sampled in a call, for a reader; the kernels score them without keeping them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import Twist
from controllers.mppi.noise import Layout
from controllers.mppi.optimizer import Optimizer
from controllers.mppi.params import MppiParams
from gym_mapbench.world.scenario import Pose


class MppiSamples(NamedTuple):
    """Some of the sampled trajectories of a call.

    Args:
        points: ``(n, time_steps, 2)`` x and y, m, in the frame of the local costmap; the cheapest first.
        costs: ``(n,)`` their costs.
        chosen: ``(time_steps, 2)`` the trajectory of the controls whose first command is sent; none if the call failed.
    """

    points: NDArray[np.float64]
    costs: NDArray[np.float64]
    chosen: NDArray[np.float64]


def samples_of(optimizer: Optimizer, params: MppiParams, pose: Pose, count: int) -> MppiSamples | None:
    """Return some of the trajectories of the last call, chosen evenly from the cheapest to the most expensive.

    Args:
        optimizer: After the call.
        params: MPPI's parameters.
        pose: Pose at the beginning of the call.
        count: Most trajectories.
    """
    explored = optimizer.explored
    if explored is None:
        return None
    costs = Layout(params.batch_size, params.time_steps).flat(optimizer.total).astype(np.float64)
    order = np.argsort(costs, kind="stable")
    some = order[np.linspace(0, len(order) - 1, min(count, len(order))).astype(int)]
    v, w = (
        base + noise.transpose(0, 2, 1).reshape(-1, params.time_steps)[some]
        for base, noise in ((explored.v, explored.noise_v), (explored.w, explored.noise_w))
    )
    chosen = np.empty((0, 2))
    if optimizer.chosen is not None and not optimizer.failed:
        chosen_v, chosen_w = (one[None] for one in optimizer.chosen)
        chosen = trajectories(pose, optimizer.start, chosen_v, chosen_w, params.model_dt)[0]
    return MppiSamples(trajectories(pose, optimizer.start, v, w, params.model_dt), costs[some], chosen)


def trajectories(
    pose: Pose, velocity: Twist, v: NDArray[np.floating], w: NDArray[np.floating], dt: float
) -> NDArray[np.float64]:
    """Return the points of trajectories, ``(n, steps, 2)`` m; the first step has the speeds at the start, as in Nav2.

    Args:
        pose: Pose at the start.
        velocity: Speeds at the start.
        v: ``(n, steps)`` speeds, m/s.
        w: ``(n, steps)`` turn rates, rad/s.
        dt: Time of a step, s.
    """
    speeds = np.column_stack([np.full(len(v), velocity.v), v[:, :-1]]).astype(np.float64)
    turns = np.column_stack([np.full(len(w), velocity.w), w[:, :-1]]).astype(np.float64)
    headings = pose.yaw + dt * (np.cumsum(turns, axis=1) - turns)
    steps = dt * speeds[:, :, None] * np.stack([np.cos(headings), np.sin(headings)], axis=2)
    points: NDArray[np.float64] = np.array([pose.x, pose.y]) + np.cumsum(steps, axis=1)
    return points
