"""A figure of maps side by side, without runs on them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from evolution.pictures.plots import draw_map, new_figure
from gym_mapbench.world.scenario import Scenario

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = 4


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
