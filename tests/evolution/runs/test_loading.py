"""What is shown of the best map set of a run."""

from __future__ import annotations

import pytest

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
