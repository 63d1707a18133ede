"""Draw docs/controllers.gif: the controllers of a kept run on the last map of its best set, four times as fast.

Run from the root of the project: python docs/draw_controllers.py
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.patches import Circle
from PIL import Image

from docs.generate.gallery import KEPT
from evolution.pictures import colour_of, draw_map, drive_best, new_figure
from evolution.runs import load_run
from gym_mapbench.metrics.episode import Episode

OUT = Path("docs/controllers.gif")
RADIUS = 0.22
"""Radius of the robot of the kept run, m."""
EVERY = 10
"""Control steps between two pictures; there are 20 a second."""
SPEED = 4
COLOURS = 32
PAUSE = 2500


def main() -> None:
    """Re-run the recorded runs and write the animation."""
    run = load_run(KEPT / "quick")
    episodes = drive_best(run)[-1].episodes
    frames = [Image.fromarray(frame) for frame in drawn(episodes, run.controllers)]
    palette = frames[-1].quantize(COLOURS)
    pictures = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    durations = [1000 * EVERY // 20 // SPEED] * (len(pictures) - 1) + [PAUSE]
    pictures[0].save(OUT, save_all=True, append_images=pictures[1:], duration=durations, loop=0, optimize=True)


def drawn(episodes: Sequence[Episode], names: Sequence[str]) -> Iterator[np.ndarray]:
    """Draw one picture for every :data:`EVERY` control steps of the longest run."""
    figure, (axes,) = new_figure(width=6.4, height=4.0)
    figure.set_layout_engine("none")
    axes.set_position((0.01, 0.02, 0.6, 0.9))
    draw_map(axes, episodes[0].scenario)
    axes.set_axis_off()
    axes.autoscale(False)
    artists = [artists_of(axes, colour_of(names, one.controller)) for one in episodes]
    place = {"loc": "center left", "bbox_to_anchor": (1.0, 0.5), "frameon": False, "fontsize": 12}
    legend = axes.legend([line for line, _ in artists], names, **place)
    canvas = FigureCanvasAgg(figure)
    longest = max(len(one.trajectory) for one in episodes)
    for step in [*range(0, longest, EVERY), longest]:
        for (line, robot), text, episode in zip(artists, legend.get_texts(), episodes, strict=True):
            path = episode.trajectory[: step + 1, :2]
            line.set_data(*path.T)
            robot.center = path[-1]
            text.set_text(words(episode, step))
        axes.set_title(f"{min(step, longest - 1) * episodes[0].control_period:.1f} s", fontsize=12)
        canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[..., :3].copy()


def artists_of(axes: Any, colour: str) -> tuple[Any, Any]:
    """Return the line of a path and the disc of a robot."""
    (line,) = axes.plot([], [], color=colour, linewidth=2)
    return line, axes.add_patch(Circle((0.0, 0.0), RADIUS, color=colour, alpha=0.85, zorder=5))


def words(episode: Episode, step: int) -> str:
    """Return the line of the legend: who drives, and the time once it is known."""
    ended = step >= len(episode.trajectory) - 1
    return f"{episode.controller}: {episode.outcome}, {episode.time:.1f} s" if ended else episode.controller


if __name__ == "__main__":
    main()
