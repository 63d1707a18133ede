"""Room for several objectives: a two-objective fitness and NSGA-II, each one file, in a whole recorded search."""

from __future__ import annotations

import numpy as np
import pytest
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from evolution.driving import RunResult
from evolution.runs import RunDir, load_run
from evolution.search.judging import Fitness, Judgement, JudgingSettings, best_of
from gym_mapbench.errors import ConfigError, PluginError
from tests.evolution.search import two_objectives
from tests.evolution.search.test_loop import go_on, reproducible_files, run, with_search

FITNESS = "tests.evolution.search.two_objectives:PenaltyAndGain"
OPTIONS = {"algorithm": "tests.evolution.search.nsga2:ALGORITHM", "fitness": FITNESS, "pop_size": 8, "evaluations": 48}


def objectives(result):
    return np.array([one.judgement.objectives for one in result.population])


def test_nsga2_keeps_a_front_and_the_records_hold_both_objectives(tmp_path):
    result = run(tmp_path / "run", with_search(**OPTIONS))
    loaded = load_run(tmp_path / "run")
    assert loaded.finished
    assert len(loaded.individuals) == 48
    assert {"fitness", "negative_gain", "failures"} <= set(loaded.individuals[0])
    assert {"best", "best_negative_gain", "best_failures"} <= set(loaded.generations[0])
    everyone = np.array([[row["fitness"], row["negative_gain"]] for row in loaded.individuals])
    front = {tuple(everyone[place]) for place in NonDominatedSorting().do(everyone, only_non_dominated_front=True)}
    assert front <= set(map(tuple, objectives(result)))
    assert result.best.judgement.objectives == min(map(tuple, objectives(result)))
    assert loaded.best_results["fitness"] == result.best.judgement.fitness == loaded.generations[-1]["best"]


def test_a_search_with_two_objectives_repeats_and_resumes_to_the_same_bytes(tmp_path):
    run(tmp_path / "one", with_search(**OPTIONS))
    files = reproducible_files(tmp_path / "one")
    run(tmp_path / "two", with_search(**OPTIONS), workers=2)
    assert reproducible_files(tmp_path / "two") == files
    go_on(RunDir.open(tmp_path / "one"), with_search(**OPTIONS))
    assert reproducible_files(tmp_path / "one") == files


def test_the_archive_joins_a_search_with_two_objectives(tmp_path):
    archive = {"archive": {"elite": True, "elite_seeds": 1}, "validation": {"seeds": 2, "held_out_seeds": 2}}
    result = run(tmp_path / "run", with_search(**OPTIONS, **archive))
    assert result.validation is not None
    assert max(row["repeat"] for row in load_run(tmp_path / "run").runs) > 3


def test_an_algorithm_for_one_objective_refuses_two():
    with pytest.raises(ConfigError, match=r"ga\.algorithm: expected one for 2 objectives with fitness .*, got 'ga'"):
        with_search(fitness=FITNESS)


def test_judgements_are_ranked_by_violated_constraints_then_by_objectives():
    class Some:
        def __init__(self, objectives, constraints=()):
            self.judgement = Judgement(objectives, 1.0, 0.0, 0.0, (), (), constraints)

    good, better, violated = Some((2.0, 5.0), (-1.0,)), Some((2.0, 4.0), (0.0,)), Some((0.0, 0.0), (0.1,))
    assert best_of([violated, good, better]) is better
    assert best_of([violated, good]) is good
    assert best_of([good, Some((2.0, 5.0), (-3.0,))]) is good  # of equals, the first
    assert better.judgement.gain_over(violated.judgement) == -2.0


def test_a_wrong_number_of_objectives_is_said(monkeypatch):
    fitness = Fitness.of(JudgingSettings(fitness=FITNESS), 150.0)
    results = (((RunResult("goal", 10.0, 1.0),), (RunResult("goal", 20.0, 1.0),)),)
    assert fitness(results).objectives == (0.0, 0.0)
    monkeypatch.setattr(two_objectives.PenaltyAndGain, "objectives_of", lambda *_: (1.0,))
    with pytest.raises(PluginError, match="expected 2 objectives and 1 constraints, all finite, got"):
        fitness(results)
