"""Tuning in rounds against evolved maps; no robot drives."""

from __future__ import annotations

import math

import pytest

from evolution.driving import RunResult
from evolution.search.judging import Fitness, JudgingSettings
from evolution.tuning import AgainstSettings, TuneSettings, load_tuning, run_tuning
from evolution.tuning.against import experiment_against, reference_for
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_scenarios
from tests.evolution.tuning import fakes

AGAINST = AgainstSettings(rounds=3, maps=2, evaluations=12, pop_size=6, families=({"name": "doors"},))
FILES = ("nav2_params.yaml", "summary.json", "trials.csv", "test.csv", "evolved.json")


def plan(**options):
    return fakes.plan(trials=24, against=AGAINST, **options)


@pytest.fixture(scope="module")
def tuned(fake_tuning, tmp_path_factory):
    return run_tuning(plan(), fakes.text(), tmp_path_factory.mktemp("rounds") / "tuning")


def test_every_round_searches_and_the_evolved_maps_stay(tuned):
    trials = tuned.summary.trials
    assert [sum(row["round"] == number for row in trials) for number in (1, 2, 3)] == [8, 8, 8]
    evolved = load_scenarios(tuned.path / "evolved.json")
    names = [one.name for one in evolved]
    assert 1 <= len(names) <= 4
    assert len({one.digest for one in evolved}) == len(names)
    most = max(row["maps"] for row in trials if row["round"] == 3)
    assert most == 8 + len(names)
    assert max(row["maps"] for row in trials if row["round"] == 1) == 8


def test_a_round_begins_with_the_own_values_and_the_best_before(tuned):
    rows = tuned.summary.trials
    own, first = rows[0], [row for row in rows if row["round"] == 1 and row["state"] == "complete"]
    second = [row for row in rows if row["round"] == 2]
    assert second[0]["lookahead_dist"] == own["lookahead_dist"]
    best = min(first, key=lambda row: row["cost time"])
    assert second[1]["lookahead_dist"] == pytest.approx(best["lookahead_dist"])


def test_the_table_of_rounds_has_each_group_of_maps(tuned):
    rows = tuned.summary.rounds
    assert [row["values"] for row in rows] == ["own", "round 1", "round 2", "round 3", "tuned"]
    assert "training maps" in rows[0]
    assert any(name.startswith("evolved after round") for name in rows[0])
    assert list(tuned.table("rounds")) == rows
    assert any("evolved against the best values" in sentence for sentence in tuned.verdict)


def test_the_results_are_the_same_after_an_interruption(tuned, tmp_path):
    class Killed(Exception):
        pass

    def kill(trial, runs):
        if runs > 60:
            raise Killed

    path = tmp_path / "tuning"
    with pytest.raises(Killed):
        run_tuning(plan(), fakes.text(), path, on_trial=kill)
    run_tuning(plan(), fakes.text(), path, resume=True)
    for name in FILES:
        assert (path / name).read_bytes() == (tuned.path / name).read_bytes()
    assert load_tuning(path).summary.rounds == tuned.summary.rounds


def test_maps_are_evolved_with_the_tuned_values_and_another_controller():
    of_round = experiment_against(plan(), {**plan().own, "lookahead_dist": 0.7}, 2, AGAINST)
    assert [one.name for one in of_round.controllers] == ["rpp", "dwb"]
    assert of_round.run.navigation.controller("rpp").params["lookahead_dist"] == 0.7
    assert of_round.search.maps_per_set == 1
    assert of_round.search.seed != experiment_against(plan(), plan().own, 1, AGAINST).search.seed
    assert reference_for(plan()) == "dwb"


def test_regret_of_worked_examples():
    fitness = Fitness.of(JudgingSettings(fitness="regret", failures="par2"), 150.0)

    def regret(*outcomes):
        return -fitness((tuple((RunResult(*one, 1.0),) for one in outcomes),)).fitness

    assert regret(("goal", 30.0), ("goal", 20.0)) == pytest.approx(math.log(1.5))
    assert regret(("goal", 20.0), ("goal", 30.0)) == 0.0
    assert regret(("timeout", 150.0), ("goal", 30.0)) == pytest.approx(math.log(10.0))
    assert regret(("collision", 3.0), ("timeout", 150.0)) == 0.0
    assert regret(("goal", 30.0), ("goal", 40.0), ("goal", 15.0)) == pytest.approx(math.log(2.0))


def test_impossible_rounds_are_refused():
    with pytest.raises(ConfigError, match="trials: expected one or more for each of 3 rounds, got 2"):
        TuneSettings(trials=2, against=AGAINST)
    with pytest.raises(ConfigError, match="rounds"):
        AgainstSettings(rounds=1)


def test_files_of_a_tuning_without_rounds_do_not_mention_them():
    assert "against" not in TuneSettings().model_dump()
    assert TuneSettings(against=AGAINST).model_dump()["against"]["rounds"] == 3
