"""A batch of trajectories: its memory, its rollout and what the rollout collects."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controllers.mppi.kernels.controls import score_controls
from controllers.mppi.kernels.points import RING, open_window, sweep
from controllers.mppi.kernels.rollout import REFRESH_EVERY, SMALL_CHANGE, STATE_ROWS
from controllers.mppi.kernels.walk import pick
from controllers.mppi.noise import Layout, Noise
from controllers.mppi.scene import Scene

Rows = NDArray[np.float32]

# Fixed-point units per cell: as many as the float32 displacement is good for.
MOST_BITS = 16
# The start's units are moved by this, so that a point in doubt has 0 to 4 units to a cell border.
CENTRED = 2.0


@dataclass
class Demands:
    """What critics want the rollout to collect.

    Args:
        contribution: ``(256,)`` what a point on a cell of each cost adds to ``Batch.sums``; None for no look at cells.
        goal: Whether to sum up distances to the end of the local path.
        heading: Whether to sum up differences from the heading there.
        either_way: Whether a heading may count from behind.
        steps: Steps whose points to keep.
        yaws: Whether to keep headings as well.
        speeds: Highest and lowest speed that costs nothing, m/s.
    """

    contribution: Rows | None = None
    goal: bool = False
    heading: bool = False
    either_way: bool = False
    steps: set[int] = field(default_factory=set)
    yaws: bool = False
    speeds: tuple[float, float] = (math.inf, -math.inf)


class Batch:
    """The trajectories of one rollout.

    Args:
        layout: Size of the batch.
        dt: Time between points, s.
        stds: Standard deviations of the noise of v and w.
        gamma: Weight of the control effort.

    Attributes:
        v, w: ``(time_steps,)`` control sequence, m/s and rad/s.
        noise: Noise in use.
        excess, reverse, effort: ``(blocks, samples)``; see :func:`~controllers.mppi.kernels.controls.score_controls`.
        sums, doubt, distance, angle: The same; see :func:`~controllers.mppi.kernels.points.sweep`.
        kept: ``(2 or 3, kept steps, blocks, samples)`` points of the steps demanded, and the last.
        rows: ``(7, samples)`` state of a rollout.
        scratch: ``(8, samples)`` free to use.
        slots: ``(samples,)`` free to use.
        chosen: ``(all samples,)`` free to use.
        scores: ``(blocks, samples)`` free to use.
    """

    noise: Noise
    kept: Rows

    def __init__(self, layout: Layout, dt: float, stds: tuple[float, float], gamma: float) -> None:
        self.layout, self.dt = layout, dt
        self._gains = (gamma / stds[0] ** 2, gamma / stds[1] ** 2)
        self.v, self.w = np.zeros((2, layout.time_steps), dtype=np.float32)
        shape = (layout.blocks, layout.samples)
        self.excess, self.reverse, self.effort, self.sums, self.distance, self.angle, self.scores = np.zeros(
            (7, *shape), dtype=np.float32
        )
        self.doubt = np.zeros(shape, dtype=np.int32)
        self.scratch = np.zeros((8, layout.samples), dtype=np.float32)
        self.slots = np.zeros(layout.samples, dtype=np.uint32)
        self.chosen = np.zeros(shape[0] * shape[1], dtype=np.int64)
        self.rows = np.zeros((STATE_ROWS, layout.samples), dtype=np.float32)
        self._ring = np.zeros((RING, layout.samples), dtype=np.uint32)
        self._keep = np.full(layout.time_steps, -1, dtype=np.int64)
        self._window = np.zeros(0, dtype=np.float32)
        self.kept = np.zeros((2, 1, *shape), dtype=np.float32)

    def roll_out(self, scene: Scene, demands: Demands) -> None:
        """Roll out all samples from where the robot is, and collect what is demanded."""
        self._prepare_steps(demands)
        score_controls(
            self.noise.v, self.noise.w, self.v, self.w, scene.state[3], demands.speeds, self._gains,
            self.excess, self.reverse, self.effort,
        )  # fmt: skip
        grid, scale = self._prepare_window(scene, demands)
        end_x, end_y, end_yaw = scene.end
        goal = (*scene.from_start(end_x, end_y), math.cos(end_yaw), math.sin(end_yaw))
        sweep(
            *self.rollout(scene), self.rows, self._keep, self.kept,
            demands.contribution is not None, grid, scale, self._ring, self._window, self.sums, self.doubt,
            (demands.goal, demands.heading, demands.either_way), goal, self.distance, self.angle,
        )  # fmt: skip

    def rollout(self, scene: Scene) -> tuple[Any, ...]:
        """Return what every kernel that rolls out all samples begins with."""
        return self.noise.v, self.noise.w, self.v, self.w, scene.state, self.dt, self._refresh_every(scene)

    def part(self, scene: Scene, chosen: NDArray[np.int64]) -> tuple[Any, ...]:
        """Return what a kernel that rolls out some samples begins with; the parts are padded by the kernels' unit."""
        width = -(-len(chosen) // 32) * 32
        v, w = np.empty((2, self.layout.time_steps, width), dtype=np.float32)
        pick(self.noise.v, chosen, v)
        pick(self.noise.w, chosen, w)
        rows = np.empty((STATE_ROWS, width), dtype=np.float32)
        return v, w, self.v, self.w, scene.state, self.dt, self._refresh_every(scene), rows

    def _refresh_every(self, scene: Scene) -> int:
        """Steps between two evaluations of sine and cosine: 1 if the heading may change fast."""
        fastest = max(abs(scene.state[4]), float(np.abs(self.w).max()) + self.noise.fastest)
        return REFRESH_EVERY if fastest * self.dt < SMALL_CHANGE else 1

    def _prepare_steps(self, demands: Demands) -> None:
        """Lay out ``kept`` for the demanded steps and the last."""
        steps = sorted(demands.steps | {self.layout.time_steps - 1})
        self._keep[:] = -1
        self._keep[steps] = range(len(steps))
        shape = (3 if demands.yaws else 2, len(steps), self.layout.blocks, self.layout.samples)
        if self.kept.shape != shape:
            self.kept = np.zeros(shape, dtype=np.float32)

    def _prepare_window(self, scene: Scene, demands: Demands) -> tuple[tuple[int, ...], tuple[float, ...]]:
        """Cut out the part of the costmap that trajectories can reach, and lay a fixed-point grid over it."""
        self.sums[:] = 0.0
        self.distance[:] = 0.0
        self.angle[:] = 0.0
        if demands.contribution is None:
            return (0, 0, 0, 0, 0, 0), (0.0, 0.0, 0.0)
        resolution, origin_x, origin_y = scene.place
        x, y = (scene.pose.x - origin_x) / resolution, (scene.pose.y - origin_y) / resolution
        col, row = math.floor(x), math.floor(y)
        reach = self._reach(scene)
        row_0, rows, first_row = _clip_span(row, reach / resolution, scene.costmap.costs.shape[0])
        col_0, cols, first_col = _clip_span(col, reach / resolution, scene.costmap.costs.shape[1])
        stride_bits = (cols + 1).bit_length()
        if len(self._window) < (rows + 2) << stride_bits:
            self._window = np.zeros((rows + 2) << stride_bits, dtype=np.float32)
        open_window(scene.costmap.costs, row_0, col_0, rows, cols, stride_bits, demands.contribution, self._window)
        bits = _exact_bits(max(abs(scene.pose.x), abs(scene.pose.y)) + reach, reach, resolution)
        unit = 1 << bits
        self.doubt[:] = unit
        grid = (bits, stride_bits, first_col * unit, first_row * unit, (cols + 1) * unit, (rows + 1) * unit)
        return grid, (unit / resolution, (x - col) * unit + CENTRED, (y - row) * unit + CENTRED)

    def _reach(self, scene: Scene) -> float:
        """How far from the start any trajectory can come, m."""
        return self.dt * (abs(scene.state[3]) + float(np.abs(self.v).sum()) + self.noise.longest)


def _clip_span(centre: int, reach: float, size: int) -> tuple[int, int, int]:
    """Cut a map of ``size`` cells to those within ``reach`` (cells) of a cell.

    Returns:
        First cell, number of cells, and where ``centre`` lies in the window, whose border is cell 0.
    """
    cells = math.ceil(reach) + 2
    first = min(max(centre - cells, 0), size)
    count = max(min(centre + cells + 1, size) - first, 0)
    return first, count, min(max(centre - first + 1, -cells), count + cells + 1)


def _exact_bits(coordinate: float, reach: float, resolution: float) -> int:
    """Bits of a fixed-point cell coordinate whose error, against Nav2's arithmetic, is at most one unit.

    Nav2 rounds world coordinates to float32; here the displacement is scaled and shifted in float32.
    """
    world = float(np.spacing(np.float32(coordinate))) / 2
    scaled = reach * 3 * 2.0**-24
    return max(1, min(MOST_BITS, math.floor(math.log2(resolution / (world + scaled)))))
