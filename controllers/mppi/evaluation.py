"""One call of MPPI from given controls and noise, with all intermediate quantities.

It runs the same code as :class:`~controllers.mppi.controller.MppiFollower`, so that a comparison with recorded
calls of Nav2 tests the code that drives the robot.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, FollowerSetup, Twist
from controllers.mppi.lyrical import make_optimizer
from controllers.mppi.noise import Layout, Noise
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import end_of
from gym_mapbench.costmap import Costmap
from gym_mapbench.world.scenario import Pose

Array = NDArray[np.float32]


@dataclass(frozen=True)
class Evaluation:
    """What happened in one call.

    Args:
        critics: Names of the critics, in their order.
        costs: ``(critics, batch_size)`` what each critic added.
        total: ``(batch_size,)`` their sum and the control effort, as in the soft-max.
        softmax_v, softmax_w: ``(time_steps,)`` control sequence after soft-max and, up to Jazzy, limits; m/s and rad/s.
        filtered_v, filtered_w: The same after the Savitzky-Golay filter.
        limited_v, limited_w: The same after the limits that Lyrical applies last.
        start: The speeds from which the trajectories start.
        furthest: Index of the furthest path point reached; -1 if no critic asked for it.
        failed: Whether all trajectories collide, so that Nav2 would give up.
        refused: Whether Lyrical's trajectory validator refuses the result, so that Nav2 would try again.
        command: The command that would be sent.
    """

    critics: tuple[str, ...]
    costs: Array
    total: Array
    softmax_v: Array
    softmax_w: Array
    filtered_v: Array
    filtered_w: Array
    limited_v: Array
    limited_w: Array
    start: Twist
    furthest: int
    failed: bool
    refused: bool
    command: Twist


class _Given:
    """A noise source that always gives the same set."""

    def __init__(self, noise: Noise) -> None:
        self._noise = noise

    def sample(self) -> Noise:
        return self._noise


def evaluate(
    params: MppiParams,
    setup: FollowerSetup,
    pose: Pose,
    velocity: Twist,
    path: NDArray[np.float64],
    costmap: Costmap,
    controls: tuple[Array, Array],
    noise: tuple[Array, Array],
    goal: tuple[float, float] | None = None,
    last: Twist = STOP,
) -> Evaluation:
    """Evaluate one call with an empty control history.

    Args:
        params: MPPI's parameters.
        setup: Footprint, control period, goal tolerance and inflation layer; its generator is not used.
        pose: Pose of the robot.
        velocity: Measured speeds.
        path: ``(m, 3)`` local path, as from :meth:`controllers.mppi.path_handler.PathHandler.local_path`.
        costmap: Local costmap.
        controls: Two ``(time_steps,)`` arrays: the control sequence before the call, m/s and rad/s.
        noise: Two ``(batch_size, time_steps)`` arrays, m/s and rad/s.
        goal: The goal in the sense of the critics, m; the end of the local path if None.
        last: The last command, from which Lyrical starts.
    """
    layout = Layout(params.batch_size, params.time_steps)
    optimizer = make_optimizer(params, setup, _Given(layout.pack(*noise)))
    optimizer.v[:], optimizer.w[:] = controls
    optimizer.sent = last
    optimizer.optimize(pose, velocity, path, goal or end_of(path), costmap)
    softmax = optimizer.v.copy(), optimizer.w.copy()
    optimizer.smooth()
    filtered = optimizer.v.copy(), optimizer.w.copy()
    optimizer.limit()
    limited = optimizer.v.copy(), optimizer.w.copy()
    return Evaluation(
        optimizer.critics,
        layout.flat(optimizer.critic_costs),
        layout.flat(optimizer.total),
        *softmax,
        *filtered,
        *limited,
        optimizer.start,
        optimizer.furthest,
        optimizer.failed,
        optimizer.collides(costmap),
        optimizer.send(),
    )
