"""What the page of a run says in words about the search."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from evolution.report.run_page import _held, _map_sentence, _outcome, _unfinished
from evolution.report.sections import _how_to_read


def a_run(bests, finished=True, driven=7, **search):
    return SimpleNamespace(
        path="runs/a",
        config={"search": {"evaluations": 40, **search}},
        generations=[{"best": best} for best in bests],
        finished=finished,
        checkpoint={"evaluations": 12},
        runs=[{}] * driven,
        best_results={"success_rate": 1.0},
    )


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (a_run([-1.0, -2.5]), "The search improved the best fitness from -1.00 to -2.50 (lower is better)."),
        (a_run([-1.0, -1.0]), "found nothing better than its first population, fitness -1.00"),
        (a_run([5578.0, -2.5]), "reached fitness -2.50; its first population had no set that all solve"),
        (a_run([-3.5, -2.78], archive={"elite": True}), "The best set has fitness -2.78 (lower is better)."),
        (a_run([-3.5, -2.78], finished=False, archive={"elite": True}), "The best set so far has fitness -2.78"),
    ],
)
def test_a_gain_is_said_where_fitnesses_can_be_compared(run, expected):
    assert expected in _outcome(run)


def test_an_unfinished_search_is_not_validated_yet():
    assert _held(a_run([-1.0], finished=False, validation={})) == []
    assert _held(a_run([-1.0], finished=False, validation={"seeds": 5}))[0].startswith("It is not validated yet")
    assert _held(a_run([-1.0], validation={"seeds": 5})) == ["No set is validated."]


def test_how_far_a_search_has_come_is_counted_in_what_limits_it():
    assert _unfinished(a_run([-1.0])) == []
    assert "12 of 40 sets; mapbench evolve --resume runs/a" in _unfinished(a_run([-1.0], finished=False))[0]
    assert "7 of 900 runs" in _unfinished(a_run([-1.0], finished=False, runs=900))[0]


def test_times_that_look_alike_are_said_once():
    def entry(low, high):
        return {"name": "map_1", "values": {"dwb": low, "rpp": high}, "runs": {}}

    assert _map_sentence(entry(19.39, 19.41)).endswith("take about the same (19.4 s).")
    assert _map_sentence(entry(19.0, 20.0)).endswith("take about the same (19.0 to 20.0 s).")


def test_a_rising_line_is_explained():
    assert "rises where" in _how_to_read("convergence", a_run([-1.0], archive={"elite": True}))
    assert (
        _how_to_read("convergence", a_run([-1.0]))
        == _how_to_read("times", a_run([-1.0], archive={"elite": True}))
        == ""
    )
