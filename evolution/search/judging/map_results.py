"""The results of one map: number of repeats, whether every run reached the goal, whether any touched a wall."""

from __future__ import annotations

from collections.abc import Sequence

from evolution.driving import RunResult, SetResults

MapResults = tuple[tuple[RunResult, ...], ...]
"""Results of one map: ``results[controller][repeat]``."""


def repeats_of(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return the number of repeats on a map: of the controller that has most."""
    return max(map(len, of_map))


def is_solved(of_map: Sequence[Sequence[RunResult]]) -> bool:
    """Return whether all controllers reached the goal in every repeat, of at least one, and none was left out."""
    repeats = repeats_of(of_map)
    return repeats > 0 and all(len(runs) == repeats and all(run.success for run in runs) for runs in of_map)


def solved_trials(of_map: MapResults) -> MapResults:
    """Return the results of the repeats in which all controllers reached the goal; all results if there are none."""
    solved = [runs for runs in _trials(of_map) if len(runs) == len(of_map) and all(run.success for run in runs)]
    return tuple(zip(*solved, strict=True)) or of_map


def finished_trials(of_map: MapResults) -> MapResults:
    """Return the results without the repeats that some controllers lack although none failed."""
    trials = _trials(of_map)
    kept = [len(runs) == len(of_map) or not all(run.success for run in runs) for runs in trials]
    return tuple(tuple(run for run, whole in zip(runs, kept, strict=False) if whole) for runs in of_map)


def without_failed_trials(of_map: MapResults) -> MapResults:
    """Return the results without the repeats in which a run failed; controllers may lack runs of the others."""
    failed = [number for number, runs in enumerate(_trials(of_map)) if not all(run.success for run in runs)]
    return tuple(tuple(run for number, run in enumerate(runs) if number not in failed) for runs in of_map)


def failed_trials(of_map: Sequence[Sequence[RunResult]]) -> int:
    """Return the number of repeats in which a run failed."""
    return sum(not all(run.success for run in runs) for runs in _trials(of_map))


def is_untouched(of_map: Sequence[Sequence[RunResult]]) -> bool:
    """Return whether no run touched a wall or body; runs that ended in an error measured nothing."""
    return not any(run.value("n_contacts") for runs in of_map for run in runs if run.outcome != "error")


def missing_runs(results: SetResults) -> int:
    """Return the number of runs of a set that controllers lack on maps where another controller has more."""
    return sum(repeats_of(of_map) - len(runs) for of_map in results for runs in of_map)


def singles_of(of_map: MapResults) -> list[MapResults]:
    """Return each repeat of a map alone."""
    return [tuple(runs[number : number + 1] for runs in of_map) for number in range(repeats_of(of_map))]


def _trials(of_map: Sequence[Sequence[RunResult]]) -> list[list[RunResult]]:
    """Return the runs of each repeat; controllers may lack runs."""
    return [[runs[number] for runs in of_map if number < len(runs)] for number in range(repeats_of(of_map))]


def success_share(of_map: MapResults) -> float:
    """Return the share of successful runs; runs that were left out count as failed."""
    return sum(run.success for runs in of_map for run in runs) / (len(of_map) * repeats_of(of_map))
