"""A film of several controllers on one map: all robots at once, with a legend, the time, and the result at the end."""

from __future__ import annotations

import textwrap
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from evolution.pictures.animation import Frame, write_gif
from evolution.pictures.map_figures import draw_map, line_of
from evolution.pictures.style import colour_of
from evolution.runs import summary_of_map
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

STEP = 0.4
"""Simulated seconds between two frames."""
MILLISECONDS = 50
"""Shown time of a frame."""
LAST_MILLISECONDS = 3000
SIZE = (7.2, 4.0)
"""Width and height, inches at 100 pixels."""
INK = "#222222"
LINE = 24
"""Characters in a line of the result."""


def save_comparison(episodes: Sequence[Episode], path: Path, title: str = "", labels: Sequence[str] = ()) -> None:
    """Write a GIF of several runs on one map, :data:`STEP` simulated seconds every :data:`MILLISECONDS`.

    Args:
        episodes: The runs, all of one scenario; the outcome of each appears when the run ends.
        path: The file.
        title: Shown above the legend.
        labels: Names of the controllers for the reader; those of the episodes if empty.
    """
    drawn = list(comparison_frames(episodes, title, labels or [one.controller for one in episodes]))
    write_gif(drawn, path, MILLISECONDS, LAST_MILLISECONDS)


def comparison_frames(episodes: Sequence[Episode], title: str, labels: Sequence[str]) -> Iterator[Frame]:
    """Draw the runs at equal intervals from the start to the end of the longest run; see :func:`save_comparison`."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE, dpi=100)
    canvas: Any = FigureCanvasAgg(figure)
    end = max(episode.time for episode in episodes)
    for time in [*np.arange(0.0, end, STEP).tolist(), end]:
        figure.clear()
        _draw_map_at(figure.add_axes((0.01, 0.02, 0.54, 0.96)), episodes, time)
        _draw_legend_at(figure, episodes, labels, time, title)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _draw_map_at(axes: Axes, episodes: Sequence[Episode], time: float) -> None:
    """Draw the map with trails and robots at a time, s."""
    names = [episode.controller for episode in episodes]
    draw_map(axes, episodes[0].scenario)
    axes.set_axis_off()
    for episode in episodes:
        row = min(round(time / episode.control_period), len(episode.trajectory) - 1)
        pose = Pose(*episode.trajectory[row, :3].tolist())
        axes.plot(*episode.trajectory[: row + 1, :2].T, **line_of(names, episode.controller), zorder=3)
        colour = colour_of(names, episode.controller)
        axes.add_patch(_body(episode.robot, pose, facecolor=colour, edgecolor="white", alpha=0.85, zorder=6))
        axes.plot(*_heading(episode.robot, pose).T, color="white", linewidth=2, zorder=7)


def _body(robot: RobotSpec, pose: Pose, **style: Any) -> Patch:
    """Return the robot's footprint at a pose, or its disc if it has none."""
    from matplotlib.patches import Circle, Polygon

    if robot.footprint is None:
        return Circle((pose.x, pose.y), robot.radius, **style)
    return Polygon(_placed(robot.footprint, pose), closed=True, **style)


def _heading(robot: RobotSpec, pose: Pose) -> NDArray[np.float64]:
    """Return the line from the robot's centre to its front."""
    front = robot.radius if robot.footprint is None else max(x for x, _ in robot.footprint)
    return _placed([(0.0, 0.0), (front, 0.0)], pose)


def _placed(points: Sequence[tuple[float, float]], pose: Pose) -> NDArray[np.float64]:
    """Return points of the robot frame in the map frame, m."""
    cos, sin = np.cos(pose.yaw), np.sin(pose.yaw)
    placed: NDArray[np.float64] = np.asarray(points) @ np.array([[cos, sin], [-sin, cos]]) + [pose.x, pose.y]
    return placed


def _draw_legend_at(
    figure: Figure, episodes: Sequence[Episode], labels: Sequence[str], time: float, title: str
) -> None:
    """Draw the names with a line that grows until the run ends, the time, and at the end the difference."""
    names, end = [episode.controller for episode in episodes], max(episode.time for episode in episodes)
    axes = figure.add_axes((0.57, 0.27, 0.41, 0.53))
    for row, (episode, label) in enumerate(zip(episodes, labels, strict=True)):
        now = min(time, episode.time)
        axes.plot([0.0, now], [row + 0.2] * 2, **line_of(names, episode.controller), solid_capstyle="butt")
        done = time >= episode.time
        state = f"{episode.outcome}, {episode.time:.1f} s" if done else f"{now:.1f} s"
        axes.text(0.0, row - 0.08, label, color=colour_of(names, episode.controller), fontsize=13, weight="bold")
        axes.text(end, row - 0.08, state, ha="right", fontsize=12, color=INK)
    axes.set(xlim=(0.0, end), ylim=(len(episodes) - 0.4, -0.6))
    axes.set_axis_off()
    result = textwrap.fill(_result(episodes, labels), LINE) if time >= end else ""
    figure.text(0.57, 0.95, textwrap.fill(title, LINE + 16), fontsize=10, color=INK, va="top")
    figure.text(0.57, 0.12, result, fontsize=13, weight="bold", color=INK, va="bottom")
    speed = f"{1000 * STEP / MILLISECONDS:.0f} times as fast as the robots"
    figure.text(0.57, 0.04, f"{time:.0f} s, {speed}", fontsize=10, color=INK)


def _result(episodes: Sequence[Episode], labels: Sequence[str]) -> str:
    """Say which run was slowest, and by how much."""
    runs = {
        label: [{"outcome": episode.outcome, "time_s": episode.time}]
        for label, episode in zip(labels, episodes, strict=True)
    }
    return summary_of_map("", runs).difference
