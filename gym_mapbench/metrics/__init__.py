"""Metrics of recorded runs, and of maps.

In: an :class:`Episode`, which a run records, or a scenario and a robot. Out: numbers by name (:func:`measure`,
:func:`~gym_mapbench.metrics.map_metrics.measure_map`), SI units. Nothing here drives, draws or writes.
"""

from gym_mapbench.metrics.episode import RECOVERY_KINDS, Episode, Event, Outcome
from gym_mapbench.metrics.run_metrics import (
    ALWAYS,
    METRICS,
    MORE_IS_BETTER,
    OF_BODIES,
    OF_EVERY_RUN,
    WEIGHTED_BY_SUCCESS,
    measure,
    score_barn,
)

__all__ = [
    "ALWAYS",
    "METRICS",
    "MORE_IS_BETTER",
    "OF_BODIES",
    "OF_EVERY_RUN",
    "RECOVERY_KINDS",
    "WEIGHTED_BY_SUCCESS",
    "Episode",
    "Event",
    "Outcome",
    "measure",
    "score_barn",
]
