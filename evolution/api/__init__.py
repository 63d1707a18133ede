"""The interface for Python: the commands as functions that return tables.

::

    from evolution import atlas, bench, compare, evolve, load, study, train, tune

Work happens in worker processes, so these functions may be called from a script, with or without a ``__main__`` guard,
and from a notebook.
"""

from __future__ import annotations

from evolution.api.benchmarks import bench, compare, configuration_of, minimize
from evolution.api.improving import train, tune
from evolution.api.searches import atlas, compose, evolve, study
from evolution.results import load

__all__ = [
    "atlas",
    "bench",
    "compare",
    "compose",
    "configuration_of",
    "evolve",
    "load",
    "minimize",
    "study",
    "train",
    "tune",
]
