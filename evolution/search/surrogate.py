"""The surrogate: what the runs on all maps say of the times on maps with similar genes.

One run on a map says little, because times scatter. But maps of one family, on one route and of the same motifs, differ
by a few numbers, their genes. The surrogate predicts the value of each controller on such a map, also on a map without
runs, by a Gaussian process for each controller and each kind of maps.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from evolution.driving import RunResult
from evolution.search.gaussian_process import Array, Evidence, GaussianProcess, Prediction, prior_prediction
from evolution.search.judging import Fitness, MapResults
from evolution.search.judging.expected_fitness import Estimate
from gym_mapbench.generator import MotifGenes
from gym_mapbench.world.scenario import Scenario

FEWEST = 10
"""Fewest maps of a kind for which hyperparameters are fitted."""
REFIT = 1.1
"""Factor by which the maps of a kind grow until hyperparameters are fitted again."""
FAILURES, RUNS = 0.05, 5.0
"""Failed runs and runs of each controller that are added to those on the maps nearby."""
TIME = "time"
"""The metric of which a failed run has the time limit."""


class Point(NamedTuple):
    """A map as the surrogate sees it.

    Args:
        kind: Family, route and motifs.
        genes: Its other genes, the size of the deviations among them.
    """

    kind: Hashable
    genes: tuple[float, ...]


def point_of(scenario: Scenario) -> Point | None:
    """Return the kind and genes of a map; None if it is not built of motifs."""
    if scenario.genome is None:
        return None
    genes = MotifGenes.from_mapping(scenario.genome.genes, "genes")
    kind = (scenario.genome.family, genes.route.name, tuple((one.motif, *sorted(one.shared)) for one in genes.sections))
    numbers = [genes.route.bend if genes.route.name == "bent" else 0.0]
    for section in genes.sections:
        deviations = [value for one in section.elements for value in one.values()]
        numbers += [float(len(section.elements)), *(section.shared[gene] for gene in sorted(section.shared))]
        numbers.append(float(np.sqrt(np.mean(np.square(deviations)))) if deviations else 0.0)
    return Point(kind, tuple(numbers))


@dataclass(frozen=True)
class Forecast:
    """What the surrogate predicts for a map.

    Args:
        logarithms: Of each controller's value.
        goals: Chance that no run of a trial fails, by the failures on maps nearby.
    """

    logarithms: tuple[Prediction, ...]
    goals: float

    def estimate(self, fitness: Fitness) -> Estimate:
        """Return the estimate of the map; the deviation includes that of the prediction."""
        return self._estimate(fitness, 0.0, [float(np.hypot(one.deviation, one.noise)) for one in self.logarithms])

    def estimate_at(self, fitness: Fitness, shift: float) -> Estimate:
        """Return the estimate for expected logarithms that differ from the predicted means.

        Args:
            fitness: Scores values.
            shift: The difference, in posterior standard deviations, the same for all controllers.
        """
        return self._estimate(fitness, shift, [one.noise for one in self.logarithms])

    def _estimate(self, fitness: Fitness, shift: float, spreads: Sequence[float]) -> Estimate:
        means = [one.mean + shift * one.deviation for one in self.logarithms]
        values = tuple(map(math.exp, means))

        def score_with(place: int, logarithm: float) -> float:
            return fitness.score_of((*values[:place], math.exp(logarithm), *values[place + 1 :]))

        pairs = zip(means, spreads, strict=True)
        halves = [
            0.5 * (score_with(place, mean + spread) - score_with(place, mean - spread))
            for place, (mean, spread) in enumerate(pairs)
        ]
        limit = math.log(fitness.time_limit) if fitness.settings.metric == TIME else np.inf
        in_time = float(np.prod(scipy.special.ndtr((limit - np.array(means)) / np.array(spreads))))
        success = min(in_time, self.goals) if fitness.policy.excludes else 1.0
        return Estimate(values, fitness.score_of(values), math.hypot(*halves), success)


class Surrogate:
    """Predicts the values of controllers on maps that are built of motifs."""

    def __init__(self) -> None:
        self._points: dict[str, Point | None] = {}
        self._hyperparameters: dict[tuple[Hashable, int], tuple[int, Array]] = {}
        self._evidence: dict[tuple[Hashable, int], Evidence] = {}
        self._processes: dict[tuple[Hashable, int], GaussianProcess] = {}
        self._numbers: dict[tuple[Hashable, int], dict[str, int]] = {}
        self._counts: dict[str, list[tuple[int, int]]] = {}
        self._means: list[float] = []

    def update(self, scenarios: Mapping[str, Scenario], results: Mapping[str, MapResults], fitness: Fitness) -> None:
        """Condition the processes on all runs so far; there are none if the logarithm of a value is not defined.

        Args:
            scenarios: The maps by digest.
            results: Results of those that have runs.
            fitness: Names the metric and the time limit.
        """
        for name in results:
            if name not in self._points:
                self._points[name] = point_of(scenarios[name])
        self._processes, self._numbers = {}, {}
        logarithms = self._logarithms(results, fitness)
        self._means = [_median_of_all(some) for some in zip(*logarithms.values(), strict=True)]
        self._counts = {name: [_failed_of(runs) for runs in results[name]] for name in logarithms}
        kinds: dict[Hashable, list[str]] = {}
        for name in logarithms:
            if point := self._points[name]:
                kinds.setdefault(point.kind, []).append(name)
        for kind, names in kinds.items():
            for place in range(len(self._means)):
                if known := [name for name in names if logarithms[name][place]]:
                    self._condition((kind, place), {name: logarithms[name][place] for name in known})

    def forecasts(self, scenarios: Mapping[str, Scenario]) -> dict[str, Forecast]:
        """Return what is predicted for maps, by digest; for those that are built of motifs, if there are runs."""
        kinds: dict[Hashable, dict[str, Point]] = {}
        for name, scenario in scenarios.items():
            if self._means and (point := self._points.get(name) or point_of(scenario)):
                kinds.setdefault(point.kind, {})[name] = point
        found: dict[str, Forecast] = {}
        for kind, points in kinds.items():
            found |= self._forecasts_of(kind, points)
        return found

    def _forecasts_of(self, kind: Hashable, points: Mapping[str, Point]) -> dict[str, Forecast]:
        genes = np.array([point.genes for point in points.values()])
        columns = []
        for place, mean in enumerate(self._means):
            if process := self._processes.get((kind, place)):
                numbers = self._numbers[kind, place]
                columns.append(process.predict(genes, [numbers.get(name) for name in points]))
            else:
                columns.append([prior_prediction(mean)] * len(points))
        rows = zip(points, zip(*columns, strict=True), self._goals(kind, genes, list(points)), strict=True)
        return {name: Forecast(row, chance) for name, row, chance in rows}

    def _goals(self, kind: Hashable, genes: Array, names: Sequence[str]) -> list[float]:
        """Return the chance that no run of a trial fails on maps: runs on maps nearby count by their closeness."""
        own = [(process, self._numbers[key]) for key, process in self._processes.items() if key[0] == kind]
        if not own:
            return [(1.0 - FAILURES / RUNS) ** len(self._means)] * len(genes)
        process, numbers = max(own, key=lambda pair: float(pair[0].evidence.runs.sum()))
        counts = np.array([self._counts[name] for name in numbers], dtype=float)
        near = process.evidence.toward(genes, [numbers.get(name) for name in names]).near
        failed, runs = np.einsum("ij,jcn->nic", near, counts)
        return [float(one) for one in np.prod(1.0 - (FAILURES + failed) / (RUNS + runs), axis=1)]

    def _condition(self, key: tuple[Hashable, int], values: Mapping[str, Sequence[float]]) -> None:
        """Make the process of a controller on one kind of maps; its hyperparameters are fitted as the maps grow."""
        count, parameters = self._hyperparameters.get(key, (0, None))
        genes = np.array([point.genes for name in values if (point := self._points[name])])
        runs, evidence = list(values.values()), self._evidence.get(key)
        if evidence is None or not evidence.is_of(genes, runs, parameters):
            evidence = Evidence(genes, runs, parameters)
        process = GaussianProcess(evidence, self._means[key[1]])
        if len(values) >= max(FEWEST, REFIT * count):
            process = process.fitted()
            self._hyperparameters[key] = (len(values), process.evidence.parameters)
        self._evidence[key], self._processes[key] = process.evidence, process
        self._numbers[key] = {name: number for number, name in enumerate(values)}

    def _logarithms(self, results: Mapping[str, MapResults], fitness: Fitness) -> dict[str, list[list[float]]]:
        """Return the logarithms of the values, ``[controller][run]``; none if a value is not positive.

        A failed run without a value counts as the time limit, or as the largest value of another metric.
        """
        metric = fitness.settings.metric
        solved = [run.value(metric) for of_map in results.values() for runs in of_map for run in runs if run.success]
        if not solved or min(solved) <= 0.0:
            return {}
        failed = fitness.time_limit if metric == TIME else max(solved)

        def logarithm(run: RunResult) -> float:
            return math.log(fitness.value_of([run]) if run.success or not fitness.policy.excludes else failed)

        return {name: [list(map(logarithm, runs)) for runs in of_map] for name, of_map in results.items()}


def _failed_of(runs: Sequence[RunResult]) -> tuple[int, int]:
    """Return the number of failed runs, and of all runs."""
    return sum(not run.success for run in runs), len(runs)


def _median_of_all(of_maps: Sequence[Sequence[float]]) -> float:
    values = [value for some in of_maps for value in some]
    return float(np.median(values)) if values else 0.0
