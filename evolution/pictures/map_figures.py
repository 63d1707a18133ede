"""Figures of maps: alone, or with the trajectories and the times of the runs on them (thesis, figures 5.3 and 5.5)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import fill
from typing import TYPE_CHECKING, Any

import numpy as np

from evolution.pictures.style import DASHES, RING, WIDTHS, colour_of, new_figure
from evolution.runs import OUTLIER, ControllerTimes, MapSummary
from gym_mapbench.generator import elements_line
from gym_mapbench.metrics.episode import RECOVERY_KINDS, Episode
from gym_mapbench.world.crowd import place_crowd
from gym_mapbench.world.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLUMNS = 4
LONGEST_LINE = 54
"""Characters of a title that are as wide as a map of a set."""
STRIP = 0.3
"""Height of the times of one controller, inches."""
SIGNS = (
    "Maps: one run of each controller, {}. Circle: start. Star: goal. Crosses: recoveries.\n"
    "Below: every dot is the time of one run; lines end at the median; rings mark outliers, which take more than "
    f"{OUTLIER:g} times the median."
)

NEAREST = "the one nearest to the medians"
FIRST_OF_FAILED = "or the first on a map with failed runs"
WALKS = np.arange(0.0, 30.0, 0.1)
"""Times at which the places of people are drawn, s."""
SIGNS_OF_PEOPLE = f"\nDiscs: people at the start, with their ways of the first {round(WALKS[-1])} s."
PEOPLE_COLOUR = "#d08770"


@dataclass(frozen=True)
class DrivenMap:
    """One map of a best set with its results, and with one recorded run of every controller.

    Args:
        summary: Times of all runs on the map.
        repeat: Which repeat is recorded: the one nearest to the median times, or the first if a run failed.
        episodes: The recorded runs of this repeat, one for each controller; empty if none was recorded.
    """

    summary: MapSummary
    repeat: int = 0
    episodes: tuple[Episode, ...] = ()

    @property
    def name(self) -> str:
        """Name of the map."""
        return self.summary.name

    @property
    def recorded_sample(self) -> str:
        """Which of the runs of each controller is recorded."""
        runs = self.summary.runs
        if runs == "1":
            return "the only run"
        why = "as some runs fail" if self.summary.failed else "nearest to the medians"
        return f"run {self.repeat + 1} of {runs}, {why}"


def maps_figure(scenarios: Sequence[Scenario]) -> Figure:
    """Draw maps with start and goal, four in a row, each under its name."""
    columns, rows = min(COLUMNS, len(scenarios)), -(-len(scenarios) // COLUMNS)
    figure, places = new_figure(columns, width=2.4 * columns, height=2.6 * rows, rows=rows)
    for axes in places.flat:
        axes.set_axis_off()
    for axes, scenario in zip(places.flat, scenarios, strict=False):
        draw_map(axes, scenario)
        axes.set_title(scenario.name, fontsize=10)
    return figure


def map_set_figure(maps: Sequence[DrivenMap], names: Sequence[str]) -> Figure:
    """Draw the maps of one set side by side: trajectories on each map, and the times of all its runs below.

    Args:
        maps: The maps, each with episodes.
        names: All controllers, which fixes their colours.
    """
    tallest = max(rows / cols for rows, cols in (one.episodes[0].scenario.map.shape for one in maps))
    heights = [4.0 * tallest, 0.5 + STRIP * len(names)]
    figure, places = new_figure(len(maps), 4.6 * len(maps), 0.9 + sum(heights), rows=2, heights=heights)
    longest = max([time for one in maps for of in one.summary.controllers for time in of.times], default=1.0)
    for one, (map_axes, time_axes) in zip(maps, places.reshape(2, -1).T, strict=True):
        draw_map(map_axes, one.episodes[0].scenario)
        draw_trajectories(map_axes, one.episodes, names)
        map_axes.set_title(fill(f"{one.name}: {one.summary.difference}", LONGEST_LINE), fontsize=11)
        _draw_times(time_axes, one.summary, names)
        time_axes.set_xlim(0.0, 1.1 * longest)
    # Just below what the layout fills; pictures are saved with all that is drawn around it.
    figure.text(0.5, -0.01, _signs(maps), ha="center", va="top", fontsize=9, color="#555555")
    return figure


def _signs(maps: Sequence[DrivenMap]) -> str:
    """Explain what the figure of a map set shows."""
    shown = f"{NEAREST}, {FIRST_OF_FAILED}" if any(one.summary.failed for one in maps) else NEAREST
    people = any(one.episodes[0].scenario.bodies for one in maps)
    return SIGNS.format(shown) + (SIGNS_OF_PEOPLE if people else "")


def draw_map(axes: Axes, scenario: Scenario) -> None:
    """Draw walls, people, start (circle) and goal (star) of a scenario; for a map of motifs its line of elements.

    Axes are in m. People who see the robot are drawn as they walk without it.
    """
    x0, y0, x1, y1 = scenario.map.bounds
    axes.imshow(scenario.map.occupancy, cmap="Greys", origin="lower", extent=(x0, x1, y0, y1), vmax=1.4)
    if scenario.genome is not None:
        line = elements_line(scenario.genome, scenario.start[:2], scenario.goal[:2])
        axes.plot(*line.T, ":", color="#999999", marker="+", markersize=5, linewidth=1, zorder=2)
    _draw_people(axes, scenario)
    axes.plot(scenario.start.x, scenario.start.y, "o", color="#444444", markersize=7, zorder=4)
    axes.plot(scenario.goal.x, scenario.goal.y, "*", color="#444444", markersize=12, zorder=4)
    axes.set(xlim=(x0, x1), ylim=(y0, y1))  # elements at the ends of a route may be outside the map
    axes.set_aspect("equal")
    axes.set(xlabel="x, m", ylabel="y, m")


def _draw_people(axes: Axes, scenario: Scenario) -> None:
    """Draw where the people of a scenario are at the start (discs), and where they walk (lines)."""
    if not scenario.bodies:
        return
    from matplotlib.patches import Circle

    places = place_crowd(scenario.map, scenario.bodies, WALKS)
    for body, walk in zip(scenario.bodies, places.swapaxes(0, 1), strict=True):
        axes.plot(walk[:, 0], walk[:, 1], color=PEOPLE_COLOUR, linewidth=1, alpha=0.6, zorder=1.5)
        axes.add_patch(Circle(walk[0, :2], body.shape.radius, color=PEOPLE_COLOUR, alpha=0.8, zorder=2.5))


def draw_trajectories(axes: Axes, episodes: Sequence[Episode], names: Sequence[str]) -> None:
    """Draw the trajectories of several controllers, each with its own dashes; crosses mark recoveries."""
    for episode in episodes:
        axes.plot(*episode.trajectory[:, :2].T, **line_of(names, episode.controller), zorder=3)
        steps = [round(event.time / episode.control_period) for event in episode.events if event.kind in RECOVERY_KINDS]
        where = episode.trajectory[np.minimum(steps, len(episode.trajectory) - 1).astype(int), :2]
        axes.plot(*where.T, "x", color=colour_of(names, episode.controller), markersize=6, zorder=5)


def line_of(names: Sequence[str], name: str) -> dict[str, Any]:
    """Return colour, dashes and width of the lines of a controller."""
    place = list(names).index(name) % len(DASHES)
    return {"color": colour_of(names, name), "linestyle": DASHES[place], "linewidth": WIDTHS[place]}


def _draw_times(axes: Axes, summary: MapSummary, names: Sequence[str]) -> None:
    """Draw the times of every controller on a line of its own, which is also the legend of the trajectories."""
    for row, one in enumerate(summary.controllers):
        axes.plot([0.0, one.median], [row, row], **line_of(names, one.controller), solid_capstyle="butt")
        axes.plot(one.times, np.full(len(one.times), row), "o", color="#222222", markersize=3, alpha=0.5)
        axes.plot(one.outliers, np.full(len(one.outliers), row), **RING)
        for time in one.outliers[-1:]:
            axes.annotate(f"{time:.0f} s", (time, row), (0, 6), textcoords="offset points", ha="center", fontsize=8)
    axes.set_yticks(range(len(summary.controllers)), [_label(one) for one in summary.controllers])
    axes.set(ylim=(len(summary.controllers) - 0.4, -0.6), xlabel=f"travel time, s ({summary.sample})")
    axes.spines[["top", "right"]].set_visible(False)


def _label(one: ControllerTimes) -> str:
    """Name a controller with its median time and the number of its failed runs."""
    failed = f"\n{one.failed} of {one.runs} failed" if one.failed else ""
    return f"{one.controller} {one.median:.1f} s{failed}" if one.times else f"{one.controller}{failed}"
