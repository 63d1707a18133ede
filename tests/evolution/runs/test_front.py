"""What is said of a Pareto front after its re-evaluation."""

from __future__ import annotations

import pytest

from evolution.runs.front import front_sentence


def a_set(remains):
    values = {"fitness": -1.0, "n_obstacles": 3.0}
    held_out = {f"held_out_{name}": value if remains is not None else None for name, value in values.items()}
    return {**values, **held_out, "remains": remains, "goals": 5, "runs": 6}


@pytest.mark.parametrize(
    ("front", "words"),
    [
        ([1], "the only set of the Pareto front on held-out seeds; it remains on it."),
        ([0], "the only set of the Pareto front on held-out seeds; it does not remain on it."),
        ([0, None], "1 of the 2 sets of the Pareto front on held-out seeds; it does not remain on it."),
        ([1, 0, None], "2 of the 3 sets of the Pareto front on held-out seeds; 1 of these remains on it."),
        ([0, 0], "2 of the 2 sets of the Pareto front on held-out seeds; 0 of these remain on it."),
    ],
)
def test_sets_that_remain_on_a_front_are_counted_in_words(front, words):
    rows = [a_set(remains) for remains in front]
    (sentence,) = front_sentence(rows, [{"fitness": -1.0, "n_obstacles": 3.0}], ["fitness", "n_obstacles"])
    assert sentence.startswith(f"The search re-evaluated {words}")


def test_a_front_that_was_not_re_evaluated_has_no_sentence():
    assert front_sentence([a_set(None)], [], ["fitness", "n_obstacles"]) == []


def test_a_front_that_is_better_on_held_out_seeds_dominates_the_whole_box_and_no_more():
    (sentence,) = front_sentence(
        [a_set(1) | {"held_out_fitness": -1.5}], [{"fitness": -1.0, "n_obstacles": 3.0}], ["fitness", "n_obstacles"]
    )
    assert "The hypervolume is 1.00, where the search reported 1.00." in sentence
