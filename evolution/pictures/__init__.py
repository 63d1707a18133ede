"""Pictures: figures and films of recorded runs.

In: recorded episodes and the tables of a run. Out: Matplotlib figures, PNG, SVG, GIF and MP4 files; equal data give
equal bytes.
"""

from __future__ import annotations

from evolution.pictures.animation import check_display, check_film, save_animation, show_animation
from evolution.pictures.comparison_film import save_comparison
from evolution.pictures.map_figures import (
    PEOPLE_COLOUR,
    DrivenMap,
    draw_map,
    draw_trajectories,
    map_set_figure,
    maps_figure,
)
from evolution.pictures.parameter_figures import sweep_figure
from evolution.pictures.plots import (
    box_figure,
    critical_difference_figure,
    curse_figure,
    effects_figure,
    learning_figure,
    lorenz_figure,
    spread_figure,
    times_figure,
)
from evolution.pictures.run_figures import (
    FIGURES,
    best_maps_figure,
    drive_best,
    recorded_maps,
    solved_lorenz_figure,
    write_run_figures,
)
from evolution.pictures.style import FORMATS, colour_of, new_figure, save_figure
from evolution.pictures.tuning_figures import front_figure, history_figure, importance_figure

__all__ = [
    "FIGURES",
    "FORMATS",
    "PEOPLE_COLOUR",
    "DrivenMap",
    "best_maps_figure",
    "box_figure",
    "check_display",
    "check_film",
    "colour_of",
    "critical_difference_figure",
    "curse_figure",
    "draw_map",
    "draw_trajectories",
    "drive_best",
    "effects_figure",
    "front_figure",
    "history_figure",
    "importance_figure",
    "learning_figure",
    "lorenz_figure",
    "map_set_figure",
    "maps_figure",
    "new_figure",
    "recorded_maps",
    "save_animation",
    "save_comparison",
    "save_figure",
    "show_animation",
    "solved_lorenz_figure",
    "spread_figure",
    "sweep_figure",
    "times_figure",
    "write_run_figures",
]
