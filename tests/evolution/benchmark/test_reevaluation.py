"""The best maps of a run as one set: its fitness on other seeds in words."""

from __future__ import annotations

from statistics import median
from types import SimpleNamespace

import pytest

from evolution.benchmark import reevaluation_sentence


@pytest.mark.parametrize(
    ("trials", "reported", "expected"),
    [
        (
            (-2.0, -4.0, -3.0),
            -5.0,
            "median fitness -3.00 in 3 trials (between -4.00 and -2.00; reported by the ",
        ),
        ((-2.0, 60.0, -3.0), -5.0, "median fitness -2.00 in 3 trials (between -3.00 and a sum of penalties; reported "),
        (
            (60.0, -3.0, 120.0),
            -5.0,
            "all controllers solve it and it has the pattern in 1 of 3 trials (reported by ",
        ),
        ((120.0,), 120.0, "all controllers solve it and it has the pattern in 0 of 1 trial (the search found no such "),
        ((-2.0,), 120.0, "median fitness -2.00 in 1 trial (between -2.00 and -2.00; the search found no set that all "),
    ],
)
def test_penalties_are_no_fitness_for_a_reader(trials, reported, expected):
    judged = SimpleNamespace(
        trials=[SimpleNamespace(fitness=one) for one in trials],
        fitness=median(trials),
        scores=(None,),
        ranks_kept=(),
        results=(),
    )
    said = reevaluation_sentence(judged, SimpleNamespace(best_results={"fitness": reported}))
    assert said.startswith(f"As a map set: {expected}")
    assert "60.00" not in said
    assert "120.00" not in said
