"""The held-out fitness of a set: its fitness on seeds that took no part in its selection."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import fmean, median

import numpy as np

from evolution.driving import RunResult, SetResults
from evolution.search.judging import Fitness, Judgement, MapResults, order_kept
from evolution.search.validation_stage.trials import judged_trials
from evolution.statistics import wilson_interval

MIDDLE = (2.5, 97.5)
"""Percentiles between which 95 % of the trials lie."""


@dataclass(frozen=True)
class ValidationResult:
    """The held-out fitness of the best set.

    Args:
        seeds: Held-out seeds on each map.
        fitness: Median fitness of a trial, over all combinations of one held-out seed for each map.
        interval: Bounds of the middle 95 % of these values.
        fitness_par2: The same median, if a failed run counts as twice the time limit.
        order_kept: Share of the trials in which the maps' scores have the order by which the set was selected.
        goals: Runs that reached the goal, with the held-out seeds.
        runs: Runs with the held-out seeds.
        goals_interval: 95 % interval (Wilson) of the share of goals.
        candidates: Maps that got held-out seeds before the selection.
    """

    seeds: int
    fitness: float
    interval: tuple[float, float]
    fitness_par2: float | None
    order_kept: float
    goals: int
    runs: int
    goals_interval: tuple[float, float]
    candidates: int


def held_out(results: SetResults, judged: Judgement, fitness: Fitness, seeds: int, candidates: int) -> ValidationResult:
    """Return the held-out fitness of a set, from its last repeats.

    Args:
        results: Results of the set.
        judged: Its judgement when it was selected.
        fitness: Judges sets.
        seeds: Number of last runs of each controller that are held out; fewer where a map has fewer.
        candidates: Number of candidates.
    """
    last = tuple(last_repeats(of_map, seeds) for of_map in results)
    trials = judged_trials(last, fitness)
    values = [one.fitness for one in trials]
    runs: list[RunResult] = [run for of_map in last for of_controller in of_map for run in of_controller]
    goals = sum(run.success for run in runs)
    low, high = np.percentile(values, MIDDLE)
    return ValidationResult(
        seeds=seeds,
        fitness=median(values),
        interval=(float(low), float(high)),
        fitness_par2=_fitness_par2(last, fitness),
        order_kept=fmean(order_kept(trials, judged.scores, fitness.kind.ordered)),
        goals=goals,
        runs=len(runs),
        goals_interval=wilson_interval(goals, len(runs)),
        candidates=candidates,
    )


def last_repeats(of_map: MapResults, seeds: int) -> MapResults:
    """Return the last runs of each controller on a map, at most ``seeds``."""
    return tuple(runs[max(len(runs) - seeds, 0) :] for runs in of_map)


def _fitness_par2(results: SetResults, fitness: Fitness) -> float | None:
    """Return the median fitness if failed runs count as twice the time limit; None if they cannot or are missing."""
    penalised = fitness.with_failures("par2")
    if penalised is None or any(len(set(map(len, one))) > 1 for one in results):
        return None
    return median(one.fitness for one in judged_trials(results, penalised))
