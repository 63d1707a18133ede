"""Validation: compares our navigation with recorded results of Nav2's own code, and our plant with Gazebo Fortress.

The recordings hold costmaps, their layers, planner, controllers, and the parts around the controllers: behaviour tree,
recoveries, controller server, velocity smoother.

In: a directory of recorded results. Out: a list of :class:`Measure`, each with its target, the number of cases and the
worst of them.
"""

from __future__ import annotations

from evolution.validation.around import AroundOracle, around_measures
from evolution.validation.closed_loop import closed_loop_measures, disagreements, drive_recorded
from evolution.validation.layers import LayersOracle, layer_measures
from evolution.validation.measures import Measure
from evolution.validation.mppi_units import mppi_measures
from evolution.validation.oracle import Oracle
from evolution.validation.plant import PlantOracle, plant_measures
from evolution.validation.plant_runs import PlantRuns, plant_run_measures
from evolution.validation.units import (
    costmap_measures,
    dwb_measures,
    dynamic_window_measures,
    local_plan_measures,
    navfn_measures,
    other_measures,
    rpp_measures,
)

__all__ = [
    "AroundOracle",
    "LayersOracle",
    "Measure",
    "Oracle",
    "PlantOracle",
    "PlantRuns",
    "around_measures",
    "closed_loop_measures",
    "costmap_measures",
    "disagreements",
    "drive_recorded",
    "dwb_measures",
    "dynamic_window_measures",
    "layer_measures",
    "local_plan_measures",
    "mppi_measures",
    "navfn_measures",
    "other_measures",
    "plant_measures",
    "plant_run_measures",
    "rpp_measures",
]
