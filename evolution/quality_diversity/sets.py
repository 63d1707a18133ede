"""The best set of an atlas' maps for a fitness, found exactly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from evolution.files import Row
from evolution.quality_diversity.elites import Elite
from evolution.search import FITNESSES, Experiment, Fitness, best_set, check_sizes
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.scenario import MapSet

SETS = ("gini", "cluster", "roles", "pairs")
"""Fitnesses of which every atlas gets the best set."""


def best_set_of(elites: Sequence[Elite], experiment: Experiment, name: str) -> tuple[MapSet, float]:
    """Return the best set of an atlas for a fitness, and its fitness on the held-out seeds that it is chosen by.

    Args:
        elites: The maps.
        experiment: Options of judging, maps in a set, and controllers.
        name: The fitness.

    Raises:
        ConfigError: If the atlas has too few maps, or the fitness needs other sets or cannot find its exact best set.
        RunError: If the scale of the cluster fitness cannot be calibrated.
    """
    size, controllers = experiment.search.maps_per_set, len(experiment.controllers)
    with FITNESSES.blamed(name):
        FITNESSES.get(name).check(size, controllers)
    check_sizes(len(elites), size)
    judging = experiment.search.judging.replace(fitness=name, objectives=())
    maps = {one.scenario.name: one for one in elites}
    fitness = Fitness.of(judging, experiment.run.time_limit).calibrated([(one.results,) for one in elites])
    names = best_set({key: one.results for key, one in maps.items()}, fitness, size)
    found = [maps[key] for key in names]
    return MapSet(tuple(one.scenario for one in found)), fitness(tuple(one.results for one in found)).fitness


def best_sets_of(elites: Sequence[Elite], experiment: Experiment) -> tuple[dict[str, MapSet], list[Row]]:
    """Return the best set for each of :data:`SETS` that has one, and a row for each: its maps, or why it has none."""
    sets: dict[str, MapSet] = {}
    rows: list[Row] = []
    for name in SETS:
        try:
            sets[name], fitness = best_set_of(elites, experiment, name)
        except (ConfigError, RunError) as error:
            rows.append({"fitness": name, "value": None, "maps": f"none: {error}"})
        else:
            rows.append({"fitness": name, "value": fitness, "maps": _names_in(sets, name)})
    return sets, rows


def _names_in(sets: Mapping[str, MapSet], name: str) -> str:
    return ", ".join(scenario.name for scenario in sets[name])
