"""Minimising: removes and shrinks the obstacles of a map while a verdict about its controllers holds.

In: a scenario, a plan of runs and a verdict to keep. Out: the smallest map that was found, its runs on held-out seeds,
and a directory that can be continued.
"""

from __future__ import annotations

from evolution.minimizing.results import MINIMIZATION, Minimized, load_minimized
from evolution.minimizing.running import MinimizeSettings, run_minimizing, smallest_map
from evolution.minimizing.verdicts import TOLERANCE, read_verdict

__all__ = [
    "MINIMIZATION",
    "TOLERANCE",
    "MinimizeSettings",
    "Minimized",
    "load_minimized",
    "read_verdict",
    "run_minimizing",
    "smallest_map",
]
