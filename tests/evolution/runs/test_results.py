"""Sentences about the results of a run."""

from __future__ import annotations

import pytest

from evolution.runs import contact_sentence, failing_controller_sentence, slow_everywhere_sentence, table_sentence


def test_runs_with_a_contact_are_counted():
    counted = [{"map": str(number), "n_contacts": count} for number, count in enumerate((0.0, 2.0, 1.0, 0.0))]
    failed = {"n_contacts": None, "outcome": "error"}
    assert contact_sentence([*counted, failed]) == ["2 of 4 runs touch a wall or body (15.0 to 85.0 %)."]
    assert contact_sentence([{"outcome": "goal"}]) == [], "an earlier version counted none"
    one_map = [{"map": str(number // 5), "n_contacts": float(number < 5)} for number in range(20)]
    assert contact_sentence(one_map) == ["5 of 20 runs touch a wall or body (4.6 to 69.9 %)."], (
        "those of one map of four"
    )


def test_the_controller_that_fails_most_is_named_where_no_set_is_solved():
    stuck = {"controller": "graceful", "outcome": "controller_failure", "reason": "collision ahead; it stood at (1, 2)"}
    late = {"controller": "graceful", "outcome": "timeout", "reason": ""}
    goal = {"controller": "dwb", "outcome": "goal", "reason": ""}
    runs = [
        goal,
        stuck,
        late,
        late,
        {**stuck, "reason": "collision ahead; it stood at (3, 2)"},
        stuck,
        {**late, **goal},
    ]
    assert failing_controller_sentence({"success_rate": 0.5}, runs) == [
        "graceful reaches the goal in 0 of 5 runs. Its most frequent failure: collision ahead."
    ]
    assert failing_controller_sentence({"success_rate": 1.0}, runs) == []
    assert failing_controller_sentence({"success_rate": 0.0}, [late])[0].endswith("most frequent failure: timeout.")


def runs_of(**times):
    """A map of a set, with one run of each controller."""
    runs = {name: [{"outcome": "goal" if time else "timeout", "time_s": time}] for name, time in times.items()}
    return {"name": "map", "runs": runs}


@pytest.mark.parametrize(
    ("maps", "fitness", "named"),
    [
        ([runs_of(rpp=40, dwb=41, graceful=72), runs_of(rpp=50, dwb=40, graceful=80)], "gini", True),
        ([runs_of(rpp=40, dwb=41, graceful=72), runs_of(rpp=50, dwb=40, graceful=80)], "pairs", False),
        ([runs_of(rpp=40, dwb=41, graceful=42), runs_of(rpp=50, dwb=40, graceful=80)], "gini", False),
        ([runs_of(rpp=40, dwb=41, graceful=72), runs_of(rpp=80, dwb=40, graceful=50)], "gini", False),
        ([runs_of(rpp=40, dwb=41, graceful=72), runs_of(rpp=50, dwb=40, graceful=0)], "gini", False),
    ],
    ids=["everywhere", "another fitness", "a similar map", "each once", "a failure"],
)
def test_a_controller_that_is_slow_on_every_map_is_named(maps, fitness, named):
    expected = "On no map of the set all are alike: graceful always takes at least 1.8 times as long as the fastest."
    found = slow_everywhere_sentence({"maps": maps}, {"judging": {"fitness": fitness, "metric": "time"}})
    assert [line.startswith(expected) for line in found] == [True] * named


def test_what_times_and_scores_are_of_is_said_where_they_differ():
    assert table_sentence({"judging": {"metric": "time"}, "validation": None}) == []
    (said,) = table_sentence({"judging": {"metric": "path_length"}, "validation": {}})
    assert "Scores of path_length: when the set was selected, without the held-out runs." in said
