"""Results of maps on which some controllers lack runs, or failed."""

from __future__ import annotations

from evolution.driving import RunResult
from evolution.search.judging import (
    failed_trials,
    filled_trials,
    finished_trials,
    solved_trials,
    without_failed_trials,
)


def runs(*times):
    """The runs of a controller with these times; a failed run has none."""
    return tuple(RunResult("timeout", 150.0, 1.0) if time is None else RunResult("goal", time, 1.0) for time in times)


def times_of(of_map):
    return [[run.time_s if run.success else None for run in some] for some in of_map]


PARTIAL = (runs(20.0, 21.0), runs(30.0, None, 32.0, None, 34.0))
"""The first controller lacks three runs; the second fails twice, once where the first one drove."""


def test_runs_that_a_controller_lacks_are_those_it_has_again():
    assert times_of(filled_trials(PARTIAL)) == [[20.0, 21.0, 20.0, 21.0, 20.0], [30.0, None, 32.0, None, 34.0]]
    whole = (runs(20.0, 21.0), runs(30.0, 31.0))
    assert filled_trials(whole) == whole


def test_later_repeats_that_no_failure_ended_are_not_finished():
    assert times_of(finished_trials(PARTIAL)) == [[20.0, 21.0], [30.0, None, None]]


def test_failed_repeats_are_counted_and_can_be_left_out():
    assert failed_trials(PARTIAL) == 2
    assert times_of(without_failed_trials(PARTIAL)) == [[20.0], [30.0, 32.0, 34.0]]
    assert times_of(solved_trials(PARTIAL)) == [[20.0], [30.0]]
    never = (runs(20.0), runs(None))
    assert solved_trials(never) == never
