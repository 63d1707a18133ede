"""What is shown of the best map set of a run."""

from __future__ import annotations

from pathlib import Path

import pytest

from evolution.runs import LoadedRun
from evolution.runs.loading import _time_or_outcome


@pytest.mark.parametrize(
    ("outcomes", "shown"),
    [
        ({}, "no run"),
        ({20.0: "goal", 24.0: "goal", 60.0: "goal"}, 24.0),
        ({20.0: "goal", 24.0: "goal", 60.0: "goal", 150.0: "timeout"}, "24.00 (1 of 4 failed)"),
        ({150.0: "timeout", 3.0: "collision"}, "timeout"),
    ],
)
def test_a_failed_run_does_not_hide_the_times_of_the_others(outcomes, shown):
    assert _time_or_outcome([{"time_s": time, "outcome": outcome} for time, outcome in outcomes.items()]) == shown


@pytest.mark.parametrize(
    ("fitness", "title"),
    [
        (-2.944, "Best map set, fitness -2.94"),
        (120.0, "Best map set; the search found no set that all controllers solve and that has the pattern"),
    ],
)
def test_penalties_are_no_fitness_in_the_title_of_the_best_map_set(fitness, title):
    config = {"controllers": [{"name": "dwb"}]}
    run = LoadedRun(Path("run"), config, {}, [], [], [], None, {"fitness": fitness, "maps": []}, [])
    assert run.table().title == title
    assert run.table("runs").title == ""
