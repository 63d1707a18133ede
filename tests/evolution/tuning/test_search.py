"""The search and what follows it: same seed, same bytes; stopped, killed and continued."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace

import pytest
import yaml

from evolution.driving import Resources
from evolution.files import read_json
from evolution.report.tuning_page import report_of_tuning
from evolution.results import kind_of, load
from evolution.tuning import load_tuning, run_tuning, sampling
from evolution.tuning.search import Searched, search
from evolution.tuning.validation import Finalist, dominates, finalists_among, front_of
from evolution.tuning.verdict import CostDifference, verdict_of
from gym_mapbench.errors import ConfigError, RunError
from tests.evolution.fake_runs import IN_PROCESS
from tests.evolution.tuning import fakes

pytestmark = pytest.mark.usefixtures("fake_tuning")
DIRECT = Resources(workers=1, executor=IN_PROCESS)


def tune(path, plan=None, **options):
    return run_tuning(plan or fakes.plan(), fakes.text(), path, **{"resources": DIRECT, **options})


def files_of(path):
    """Everything but the store, whose bytes depend on the order of the runs."""
    return {
        file.relative_to(path).as_posix(): file.read_bytes()
        for file in sorted(path.rglob("*"))
        if file.is_file() and "sqlite" not in file.name
    }


@pytest.fixture(scope="module")
def done(tmp_path_factory, fake_tuning):
    return tune(tmp_path_factory.mktemp("tuning") / "tuned")


def test_the_tuned_file_differs_in_the_tuned_keys_only(done):
    before, after = (yaml.safe_load(text) for text in (fakes.text().text, done.params.read_text()))
    own, tuned = (one["controller_server"]["ros__parameters"]["rpp"] for one in (before, after))
    changed = {name for name in own if own[name] != tuned[name]}
    assert changed <= {"lookahead_dist", "use_rotate_to_heading", "inflation_cost_scaling_factor"}
    assert "lookahead_dist" in changed
    for values in (before, after):
        del values["controller_server"]["ros__parameters"]["rpp"]
        del values["local_costmap"]["local_costmap"]["ros__parameters"]["inflation_layer"]["cost_scaling_factor"]
    assert before == after


def test_it_finds_the_better_value_and_says_so(done):
    (row,) = [row for row in done.table("changes") if row["parameter"] == "lookahead_dist"]
    assert row["before"] == 0.6
    assert abs(row["after"] - 0.9) < 0.1
    assert "the tuned values are better" in done.verdict[0]
    assert len(done.table("test")) == 2 * 8 * 2
    assert len(done.table("trials")) == 24
    assert done.table("importances")[0]["parameter"] == "lookahead_dist"


def test_the_units_of_the_comparison_are_maps_only_if_there_are_enough(done):
    winner = Finalist(1, {**fakes.plan().own, "lookahead_dist": 0.9, "use_rotate_to_heading": False}, (1.0,), 1.0, True)
    few = [row for row in done.summary.test if row["map"] in ("map_2_0", "map_2_1")]
    for rows, unit in ((done.summary.test, "of 8 maps and"), (few, "of 4 pairs of runs and")):
        said = verdict_of(fakes.plan(), Searched([], [{}]), winner, rows)
        assert sum(unit in sentence for sentence in said) == 1
        assert any("about these maps only" in sentence for sentence in said) == (rows is few)


def test_the_page_counts_maps_by_their_walls(done, tmp_path):
    assert report_of_tuning(done).subtitle.startswith("8 training maps, 8 test maps; ")
    one = fakes.plan()
    there = one.test[0]
    back = replace(there, start=there.goal, goal=there.start, name="back")
    result = tune(tmp_path / "tasks", replace(one, test=(there, back)))
    assert report_of_tuning(result).subtitle.startswith("8 training maps, 2 tasks on 1 test map; ")


def test_without_importances_the_largest_changes_stand_in_the_sentence(done):
    plan = fakes.plan()
    vars(plan)["own"] = {**{f"weight_{n}": 100.0 for n in range(6)}, "lookahead_dist": 0.6}
    winner = Finalist(1, {**dict.fromkeys(plan.own, 101.0), "lookahead_dist": 0.9}, (1.0,), 1.0, True)
    (said,) = [line for line in verdict_of(plan, Searched([], [{}]), winner, done.summary.test) if " change; " in line]
    assert said.startswith("7 parameters change; the 5 largest changes: lookahead_dist rises from 0.6 to 0.9")


def test_too_few_test_maps_tell_nothing():
    assert CostDifference(-0.1234, None, None).in_words("time") == (
        "the mean cost time changes by -0.12; it takes 5 test maps or tasks, on which it does not always change alike, "
        "to tell whether the tuned values are better"
    )
    assert CostDifference(0.5, -0.2, 1.2).in_words("time") == (
        "the tuned values are not shown to be better: the mean cost time changes by +0.50 (95 % interval -0.20 to 1.20)"
    )


def test_the_first_trial_has_the_own_values(done):
    first = done.table("trials")[0]
    assert (first["trial"], first["state"], first["lookahead_dist"]) == (0, "complete", 0.6)


def test_bad_trials_are_stopped_early_and_never_validated(done):
    trials = done.table("trials")
    stopped = [row for row in trials if row["state"] == "stopped"]
    assert stopped
    assert all(4 <= row["maps"] < 8 for row in stopped)
    best = min(row["cost time"] for row in trials if row["state"] == "complete")
    assert all(row["cost time"] > best for row in stopped)
    assert not {row["trial"] for row in stopped} & {row["trial"] for row in done.table("finalists")}


def test_same_bytes_with_worker_processes(done, tmp_path):
    tune(tmp_path / "again", resources=Resources(workers=3))
    assert files_of(tmp_path / "again") == files_of(done.path)


@pytest.mark.parametrize("runs", [37, 150])
def test_a_killed_tuning_continues_to_the_same_bytes(done, tmp_path, runs):
    left = iter(range(runs, -1, -1))

    def interrupt(*_):
        if next(left) == 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        tune(tmp_path / "killed", on_run=interrupt)
    with pytest.raises(RunError, match="was not finished; continue it with --resume"):
        load_tuning(tmp_path / "killed")
    tune(tmp_path / "killed", resume=True)
    assert files_of(tmp_path / "killed") == files_of(done.path)


def test_a_continued_tuning_has_the_options_it_began_with(done, tmp_path):
    shutil.copytree(done.path, tmp_path / "copy")
    with pytest.raises(ConfigError, match=r"settings\.seed was 0 when the tuning began, got 1"):
        tune(tmp_path / "copy", fakes.plan(seed=1), resume=True)
    for plan, message in (
        (fakes.plan(7), "number of training maps was 8 when the tuning began, got 7"),
        (replace(fakes.plan(), test=fakes.maps(8, 3)), "test map 1 was map_2_0 when the tuning began, got map_3_0"),
    ):
        with pytest.raises(ConfigError, match=message):
            tune(tmp_path / "copy", plan, resume=True)
    with pytest.raises(ConfigError, match="already holds a tuning"):
        tune(tmp_path / "copy")


def test_it_can_be_loaded_like_other_results(done):
    assert kind_of(done.path).directory.what == "tuning"
    assert load(done.path).summary == done.summary
    with pytest.raises(ConfigError, match="unknown table 'tests'; did you mean 'test'"):
        done.table("tests")


def test_a_damaged_summary_is_named(done, tmp_path):
    shutil.copytree(done.path, tmp_path / "copy")
    summary = read_json(tmp_path / "copy/summary.json")
    del summary["winner"]
    (tmp_path / "copy/summary.json").write_text(json.dumps(summary))
    with pytest.raises(RunError, match=r"summary\.json: winner: is missing"):
        load_tuning(tmp_path / "copy")


def test_the_summary_of_another_tuning_is_refused(done, tmp_path):
    shutil.copytree(done.path, tmp_path / "copy")
    config = read_json(tmp_path / "copy/tuning.json")
    config["tuning"]["settings"]["seed"] += 1
    (tmp_path / "copy/tuning.json").write_text(json.dumps(config))
    with pytest.raises(
        RunError, match=r"summary\.json: expected the summary of the tuning in tuning\.json, got that of"
    ):
        load_tuning(tmp_path / "copy")


def test_no_better_value_leaves_the_file_as_it_was(tmp_path):
    result = tune(tmp_path / "own", fakes.plan(trials=1))
    assert result.verdict[0].startswith("No trial beats the own values")
    assert result.params.read_text() == fakes.text().text
    assert result.summary.changes == []


def test_several_objectives_give_a_front_of_parameter_files(tmp_path):
    result = tune(tmp_path / "front", fakes.plan(trials=16, objectives=("time", "clearance")))
    front = result.summary.front
    assert len(front) > 1
    said = f"The Pareto front of time and clearance has {len(front)} trials, with a parameter file for each in front/; "
    assert any(sentence.startswith(said) for sentence in result.verdict)
    paragraphs = {one.title: one.paragraphs for one in report_of_tuning(result).sections}
    assert "with several objectives no trial stops early" in paragraphs["History"][0]
    assert "The cost clearance of a run is its least distance to a wall" in paragraphs["History"][0]
    assert "the trial with the lowest cost time." in paragraphs["Validation"][0]
    assert {file.stem for file in (result.path / "front").iterdir()} == {f"trial_{number}" for number in front}
    rows = {row["trial"]: row for row in result.table("finalists")}
    costs = [(rows[number]["cost time"], rows[number]["cost clearance"]) for number in front]
    assert costs == sorted(costs)
    assert [second for _, second in costs] == sorted((second for _, second in costs), reverse=True)
    assert all(row["state"] == "complete" for row in result.table("trials"))


def test_requirements_keep_trials_out(tmp_path):
    result = tune(tmp_path / "careful", fakes.plan(requirements=("clearance>=0.2",)))  # a lookahead of at most 0.5
    (row,) = [row for row in result.table("changes") if row["parameter"] == "lookahead_dist"]
    assert row["after"] <= 0.5


def test_random_search_stops_at_its_budget_of_runs(tmp_path):
    result = tune(tmp_path / "random", fakes.plan(sampler="random", trials=1000, runs=60))
    assert 60 <= result.summary.runs["search"] < 60 + 4 * 8


class Refusing:
    """A plan whose controller refuses some values."""

    def __init__(self, plan):
        self.plan = plan

    def __getattr__(self, name):
        return getattr(self.plan, name)

    def jobs_with(self, values):
        if values["lookahead_dist"] > 0.7:
            raise ConfigError("too far")
        return self.plan.jobs_with(values)


def test_refused_values_cost_no_run():
    with DIRECT.evaluator(fakes.run_job) as evaluator:
        found = search(Refusing(fakes.plan(trials=12)), evaluator)
    refused = [trial for trial in found.trials if trial.state == "refused"]
    assert refused
    assert all(trial.values["lookahead_dist"] > 0.7 and not trial.rows for trial in refused)


def finalist(number, *costs, feasible=True):
    return Finalist(number, {}, costs, 1.0, feasible)


def test_fronts_by_hand():
    assert dominates((1, 2), (1, 3))
    assert not dominates((1, 2), (1, 2))
    assert not dominates((1, 3), (2, 1))
    found = [finalist(0, 3, 3), finalist(1, 1, 4), finalist(2, 2, 2), finalist(3, 0, 0, feasible=False)]
    assert [one.number for one in front_of(found)] == [1, 2]
    assert [one.number for one in front_of(found[3:])] == [3]  # nothing meets the requirements: the own values stay


def test_finalists_are_the_own_values_and_the_best_complete_trials():
    with DIRECT.evaluator(fakes.run_job) as evaluator:
        trials = search(fakes.plan(), evaluator).trials
    chosen = finalists_among(trials, 3)
    rest = [trial.estimate for trial in trials[1:] if trial.state == "complete" and trial not in chosen]
    assert chosen[0] is trials[0]
    assert len(chosen) == 4
    assert max(trial.estimate for trial in chosen[1:]) <= min(rest)


def test_without_optuna_one_line_says_what_to_install(monkeypatch):
    def missing(name):
        raise ImportError(name)

    monkeypatch.setattr(sampling.importlib, "import_module", missing)
    with pytest.raises(ConfigError, match=r"tuning needs optuna \(pip install 'gym-mapbench\[tune\]'\)"):
        sampling.optuna()
