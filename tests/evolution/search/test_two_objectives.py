"""Several objectives: those of a third party's fitness, those that a search names, and the Pareto front."""

from __future__ import annotations

import re
from itertools import product
from statistics import fmean, median

import numpy as np
import pytest
from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

from evolution.driving import RunResult
from evolution.runs import RunDir, front_lines, hypervolumes, load_run, objectives_in
from evolution.search.algorithms import Evaluation
from evolution.search.judging import Fitness, Judgement, JudgingSettings, best_of
from evolution.search.validation_stage.front import spread
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.mapio.map_set_file import read_map_set
from gym_mapbench.metrics.map_metrics import n_obstacles
from gym_mapbench.world.gridmap import GridMap
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
    assert max(row["repeat"] for row in load_run(tmp_path / "run").runs) >= 1 + 2


def test_an_algorithm_for_one_objective_refuses_two():
    with pytest.raises(ConfigError, match=r"ga\.algorithm: expected one for 2 objectives .*with fitness .*, got 'ga'"):
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


OWN = {"algorithm": "nsga2", "fitness": "gini", "objectives": ("n_obstacles", "path_length"), "pop_size": 8}
VALIDATED = OWN | {"evaluations": 48, "validation": {"seeds": 2, "held_out_seeds": 3}}


def test_the_front_of_a_search_is_recorded_and_re_evaluated(tmp_path):
    result = run(tmp_path / "run", with_search(**VALIDATED))
    loaded = load_run(tmp_path / "run")
    names = ("fitness", "n_obstacles", "path_length")
    assert tuple(objectives_in(loaded.front)) == names
    assert [row["map_set"] for row in loaded.front] == [one.evaluation.map_set.digest for one in result.front]
    table = np.array([[row[name] for name in names] for row in loaded.front])
    assert not any((other <= one).all() and (other < one).any() for one in table for other in table)
    assert list(table[:, 0]) == sorted(table[:, 0])
    assert loaded.best.digest == loaded.front[0]["map_set"]
    again = [row for row in loaded.front if row["remains"] is not None]
    assert again
    assert all(row["runs"] == 3 * 3 * 3 for row in again)
    assert any(row["remains"] for row in again)
    assert [row["set"] for row in loaded.front] == list(range(1, 1 + len(loaded.front)))
    first = read_map_set(tmp_path / "run" / "front" / "1.json")
    found = [scenario.map.digest for one in first for scenario in one.scenarios()]
    assert found == [one.map.digest for one in result.front[0].evaluation.map_set]
    assert re.search(r"remains? on it", front_lines(loaded)[0])


def test_held_out_objectives_are_medians_over_trials_on_the_last_seeds(tmp_path):
    result = run(tmp_path / "run", with_search(**VALIDATED))
    point = result.front[0]
    rows = list(load_run(tmp_path / "run").runs)
    driven = {scenario.map.digest: {} for scenario in point.evaluation.map_set}
    for row in rows:
        if row["map"] in driven:
            driven[row["map"]].setdefault(row["controller"], []).append(
                RunResult(row["outcome"], row["time_s"], row["path_length_m"], metrics={"clearance": row["clearance"]})
            )
    last = [[of_map[name][-3:] for name in ("dwb", "mppi", "rpp")] for of_map in driven.values()]
    fitness = Fitness.of(JudgingSettings(), 150.0)
    trials = [
        tuple(tuple((runs[seed],) for runs in of_map) for of_map, seed in zip(last, seeds, strict=True))
        for seeds in product(range(3), repeat=3)
    ]
    assert point.values[0] == median(fitness(one).fitness for one in trials) == point.held_out.fitness


def test_a_front_repeats_with_other_workers_and_after_an_interruption(tmp_path):
    run(tmp_path / "one", with_search(**VALIDATED))
    files = reproducible_files(tmp_path / "one")
    assert "front.csv" in files
    assert "front/1.json" in files
    run(tmp_path / "two", with_search(**VALIDATED), workers=2)
    assert reproducible_files(tmp_path / "two") == files
    checkpoint = tmp_path / "two" / "checkpoint.json"
    (tmp_path / "two" / "front.csv").unlink()
    checkpoint.write_text(checkpoint.read_text().replace('"finished": true', '"finished": false'))
    go_on(RunDir.open(tmp_path / "two"), with_search(**VALIDATED))
    assert reproducible_files(tmp_path / "two") == files


def test_a_search_with_few_runs_re_evaluates_part_of_the_front(tmp_path):
    few = {"runs": 8 * 9 + 9 * 2 * 3 + 60 + 60, "validation": {"seeds": 2, "held_out_seeds": 3}}
    result = run(tmp_path / "run", with_search(**OWN, evaluations=48, **few))
    assert len(result.record.runs) <= few["runs"]
    assert result.front[0].values is not None


def test_without_noise_the_front_is_not_re_evaluated(tmp_path):
    result = run(tmp_path / "run", with_search(**OWN, evaluations=24))
    assert result.front
    assert all(one.values is None for one in result.front)
    loaded = load_run(tmp_path / "run")
    assert front_lines(loaded) == []
    assert len(loaded.front) == len(result.front)


def test_a_measure_of_maps_is_the_mean_over_the_maps_of_a_set(tmp_path):
    result = run(tmp_path / "run", with_search(**OWN, evaluations=24))
    for one in result.population:
        counts = [n_obstacles(scenario.map) for scenario in one.map_set]
        assert one.judgement.objectives[1] == fmean(counts)


def test_obstacles_that_touch_at_a_corner_are_one():
    cells = np.zeros((6, 6), bool)
    cells[1, 1] = cells[2, 2] = cells[4, 0] = cells[4, 4:] = True
    assert n_obstacles(GridMap(cells)) == 3.0
    assert n_obstacles(GridMap(np.zeros((3, 3), bool))) == 0.0


def test_hypervolume_of_a_worked_example():
    rows = [
        {"generation": 1, "fitness": -2.0, "n": 4.0, "violation": 0.0},
        {"generation": 1, "fitness": 0.0, "n": 2.0, "violation": 0.0},
        {"generation": 1, "fitness": -9.0, "n": 0.0, "violation": 1.0},
        {"generation": 2, "fitness": -1.0, "n": 3.0, "violation": 0.0},
        {"generation": 3, "fitness": -2.0, "n": 2.0, "violation": 0.0},
    ]
    assert hypervolumes(rows, ["fitness", "n"]) == {3: 0.0, 4: 0.25, 5: 1.0}


def test_the_front_is_spread_from_the_best_fitness_on():
    def point(*values):
        return Evaluation(None, (), Judgement(values, 1.0, 0.0, 0.0, (), ()))

    front = [point(-3.0, 9.0), point(-2.9, 8.9), point(-1.0, 2.0), point(0.0, 0.0)]
    assert [front.index(one) for one in spread(front)] == [0, 3, 2, 1]
    assert spread(front[:1]) == front[:1]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"objectives": ("n_obstacles",)}, r"ga\.algorithm: expected one for 2 objectives \(such as nsga2\)"),
        ({"objectives": ("n_obstacle",), "algorithm": "nsga2"}, "n_obstacle"),
        ({"objectives": ("jerk", "jerk"), "algorithm": "nsga2"}, "expected different names, got jerk, jerk"),
        ({"objectives": ("time",), "algorithm": "nsga2"}, "expected other metrics than that of the fitness, got time"),
        ({"objectives": ("jerk",), "algorithm": "nsga2", "failures": "par2"}, "expected 'exclude' with metric 'jerk'"),
        ({"objectives": ("jerk",), "algorithm": "nsga2", "fitness": "cluster"}, "expected measures of maps"),
    ],
)
def test_impossible_objectives_are_refused_in_one_line(options, message):
    with pytest.raises(ConfigError, match=message) as refused:
        with_search(**options)
    assert "\n" not in str(refused.value)


def test_files_of_a_search_with_one_objective_do_not_mention_others():
    assert "objectives" not in with_search().document()["search"]["judging"]
    assert with_search(**OWN).document()["search"]["judging"]["objectives"] == ["n_obstacles", "path_length"]


def test_the_maps_of_the_front_get_further_seeds_in_the_search(tmp_path):
    with_elite = OWN | {"archive": {"elite": True, "elite_seeds": 2}}
    result = run(tmp_path / "run", with_search(**with_elite, evaluations=48))
    for one in result.front:
        assert min(len(runs) for of_map in one.evaluation.results for runs in of_map) >= 1 + 2
    few = run(tmp_path / "few", with_search(**with_elite, evaluations=48, runs=100))
    assert len(few.record.runs) <= 100
