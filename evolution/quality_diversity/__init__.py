"""Quality-diversity: an atlas of maps, which shows who can be slower than whom, by how much, and on which map.

In: an experiment and an evaluator. Out: a grid of cells by the ratios of the controllers' times, with the simplest
reliable map of each cell, and the best sets of these maps.
"""

from __future__ import annotations

from evolution.quality_diversity.elites import Elite
from evolution.quality_diversity.results import ATLAS, ELITES, HISTORY, REPORT, Atlas, load_atlas
from evolution.quality_diversity.running import run_atlas
from evolution.quality_diversity.search import search_atlas
from evolution.quality_diversity.settings import AtlasSettings

__all__ = [
    "ATLAS",
    "ELITES",
    "HISTORY",
    "REPORT",
    "Atlas",
    "AtlasSettings",
    "Elite",
    "load_atlas",
    "run_atlas",
    "search_atlas",
]
