"""Quality-diversity: an atlas of maps, which shows who can be slower than whom, by how much, and on which map.

In: an experiment and an evaluator. Out: a grid of cells by the ratios of the controllers' times, with the simplest
reliable map of each cell, and the best sets of these maps.
"""

from __future__ import annotations

from evolution.quality_diversity.elites import Elite, boundary_length, quality
from evolution.quality_diversity.grid import Axes, MapGrid, ribs_archives
from evolution.quality_diversity.results import ATLAS, ELITES, HISTORY, MAPS, REPORT, Atlas, load_atlas
from evolution.quality_diversity.running import run_atlas
from evolution.quality_diversity.search import AtlasSearch, GridFigures, search_atlas
from evolution.quality_diversity.sets import SETS, best_set_of, best_sets_of
from evolution.quality_diversity.settings import AtlasSettings

__all__ = [
    "ATLAS",
    "ELITES",
    "HISTORY",
    "MAPS",
    "REPORT",
    "SETS",
    "Atlas",
    "AtlasSearch",
    "AtlasSettings",
    "Axes",
    "Elite",
    "GridFigures",
    "MapGrid",
    "best_set_of",
    "best_sets_of",
    "boundary_length",
    "load_atlas",
    "quality",
    "ribs_archives",
    "run_atlas",
    "search_atlas",
]
