"""The best maps of a run as one set: its fitness on other seeds in words."""

from __future__ import annotations

from statistics import median
from types import SimpleNamespace

import pytest

from evolution.benchmark import reevaluation_sentence
from evolution.driving import RunResult
from evolution.runs import Reevaluation
from evolution.search import Fitness
from evolution.search.judging import JudgingSettings


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
        trials=[SimpleNamespace(fitness=one, success_rate=1.0 if one <= 0 else 0.5) for one in trials],
        fitness=median(trials),
        scores=(None,),
        ranks_kept=(),
        results=(),
    )
    said = reevaluation_sentence(judged, SimpleNamespace(best_results={"fitness": reported}))
    assert said.startswith(f"As a map set: {expected}")
    assert "60.00" not in said
    assert "120.00" not in said


def test_a_trial_with_a_failed_run_is_not_solved_whatever_its_fitness():
    """Two maps of the cluster pattern gain 20 * 8/9, the failed run on the third one costs 100/9: -6.67 (Eq. 4.5)."""
    fitness = Fitness.of(JudgingSettings(fitness="cluster", cluster_scale=1.0), 150.0)
    equal, different = ((RunResult("goal", time, 1.0),) for time in (10.0, 12.0))
    failed = (RunResult("controller_failure", 9.0, 1.0),)
    one_fails = ((equal, equal, equal), (equal, equal, different), (equal, different, failed))
    all_fail = ((failed,) * 3,) * 3
    trials = tuple(map(fitness, (one_fails, all_fail, all_fail)))
    assert trials[0].fitness == pytest.approx(-20 * 8 / 9 + 100 / 9)
    judged = Reevaluation(one_fails, trials, trials, (None, None, None))
    said = reevaluation_sentence(judged, SimpleNamespace(best_results={"fitness": -15.0}))
    assert said.startswith("As a map set: all controllers solve it and it has the pattern in 0 of 3 trials (")
