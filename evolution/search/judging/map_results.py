"""The results of one map: number of repeats, whether every run reached the goal, whether any touched a wall.

A *trial* of a map is one run of each controller. Runs of different controllers are independent of each other, so a
controller that has fewer runs than another takes part in further trials with the same runs, in their order. A
controller without any run was left out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from evolution.driving import RunResult, SetResults

MapResults = tuple[tuple[RunResult, ...], ...]
"""Results of one map: ``results[controller][repeat]``."""


def repeats_of(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return the number of repeats on a map: of the controller that has most."""
    return max(map(len, of_map))


def is_solved(of_map: Sequence[Sequence[RunResult]]) -> bool:
    """Return whether every run of all controllers reached the goal, and none was left out."""
    return all(runs and all(run.success for run in runs) for runs in of_map)


def solved_trials(of_map: MapResults) -> MapResults:
    """Return the results without the trials in which a run failed; all results if a controller has no other.

    Each run counts once, also where a controller takes part in further trials with it.
    """
    solved = without_failed_trials(of_map)
    return solved if all(solved) else of_map


def without_failed_trials(of_map: MapResults) -> MapResults:
    """Return the results without the trials in which a run failed; controllers may have been left out."""
    failed = [number for number, runs in enumerate(_trials(of_map)) if not all(run.success for run in runs)]
    return tuple(tuple(run for number, run in enumerate(runs) if number not in failed) for runs in of_map)


def failed_trials(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return the number of trials in which a run failed."""
    return sum(not all(run.success for run in runs) for runs in _trials(of_map))


def is_untouched(of_map: Sequence[Sequence[RunResult]]) -> bool:
    """Return whether no run touched a wall or body; runs that ended in an error measured nothing."""
    return not any(run.value("n_contacts") for runs in of_map for run in runs if run.outcome != "error")


def missing_runs(results: SetResults) -> int:
    """Return the number of runs of a set that controllers lack because they were left out."""
    return sum(repeats_of(of_map) for of_map in results for runs in of_map if not runs)


def singles_of(of_map: Sequence[Sequence[RunResult]]) -> list[MapResults]:
    """Return each trial of a map alone."""
    return [
        tuple((runs[number % len(runs)],) if runs else () for runs in of_map) for number in range(repeats_of(of_map))
    ]


def _trials(of_map: Sequence[Sequence[RunResult]]) -> list[list[RunResult]]:
    """Return the runs of each trial; controllers may have been left out."""
    return [[runs[number % len(runs)] for runs in of_map if runs] for number in range(repeats_of(of_map))]


def success_share(of_map: MapResults) -> float:
    """Return the share of successful runs, every controller alike; a controller that was left out has failed."""
    return successes_of(of_map) / (len(of_map) * repeats_of(of_map))


def successes_of(of_map: Sequence[Sequence[RunResult]]) -> float:
    """Return the number of successful runs in all trials."""
    return sum_over_trials(of_map, lambda run: run.success)


def sum_over_trials(of_map: Sequence[Sequence[RunResult]], value: Callable[[RunResult], float]) -> float:
    """Return the sum of a value of all runs in all trials; runs that take part in more trials count more."""
    repeats = repeats_of(of_map)
    return sum(sum(map(value, runs)) * (repeats / len(runs)) for runs in of_map if runs)
