"""Studies: what they run, what they refuse, and that nothing is lost."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import sys
import textwrap
from itertools import combinations
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from evolution.driving import Resources, RunResult
from evolution.driving.store import ResultStore
from evolution.runs.directory import CHECKPOINT, CONFIG, STORE, TIMING
from evolution.runs.loading import load_run
from evolution.runs.results import validation_sentence
from evolution.search import JudgingSettings
from evolution.studies import StudySettings, load_definition, load_results, load_study, run_study, study_names
from evolution.studies.directory import STUDY
from evolution.studies.path_length import PathLengthFitness
from evolution.studies.running import _Meter, work_of
from evolution.studies.settings import MAX_SEED
from evolution.studies.tasks import _complete, check_study
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.noise import NOISES, NoiseSettings, read_noise
from tests.evolution.fake_runs import WORKERS, broken_warm_up
from tests.evolution.fake_study import small_study
from tests.evolution.processes import PATIENCE

pytestmark = pytest.mark.usefixtures("fake_driving")

ROOT = Path(__file__).resolve().parents[3]
TWO = [
    {"name": "ga", "experiment": {"search": {"pop_size": 6}}},
    {"name": "best", "method": "best_triple", "of": "ga"},
]


def lasting_files(path):
    """Everything but wall-clock values and the store."""
    volatile = (TIMING, STORE, f"{STORE}-wal", f"{STORE}-shm")
    files = [file for file in Path(path).rglob("*") if file.is_file() and file.name not in volatile]
    return {str(file.relative_to(path)): file.read_bytes() for file in files}


def changed(**options):
    """The document of a small study with something changed."""
    document = small_study().model_dump(mode="json")
    return {**document, **options}


@pytest.mark.parametrize("name", [name for name in study_names() if isinstance(load_definition(name), StudySettings)])
def test_studies_of_the_package_can_be_run(name):
    settings = load_study(name)
    assert [task.configuration.name for task in check_study(settings)] == list(settings.names)
    assert load_study(ROOT / "evolution" / "studies" / "definitions" / f"{name}.yaml") == settings
    assert StudySettings(**yaml.safe_load(yaml.safe_dump(settings.model_dump(mode="json")))) == settings


def test_the_thesis_study_is_chapter_5():
    settings = load_study("thesis")
    tasks = {task.configuration.name: task.experiment.search for task in check_study(settings)}
    assert settings.runs == 24
    assert [tasks[f"gini_{n}"].ga.pop_size for n in (20, 40, 60)] == [20, 40, 60]
    assert {tasks[name].evaluations for name in ("gini_20", "gini_40", "gini_60", "cluster")} == {600}
    assert settings.configuration("cluster").pop_size_from == ("gini_20", "gini_40", "gini_60")
    assert settings.configuration("cluster").cluster_scale_from == ("gini_20", "gini_40", "gini_60")
    assert settings.reevaluation.seeds == 10


def test_every_configuration_runs_with_the_same_seeds(study_path):
    results = load_results(study_path)
    assert results.missing == ()
    assert [(run.configuration.name, run.seed) for run in results.runs] == [
        (name, seed) for name in small_study().names for seed in (0, 1)
    ]
    for run in results.runs:
        assert load_run(run.path).finished
        assert run.experiment.search.seed == run.seed
        assert run.generations[-1]["evaluations"] == 24
        assert run.generations[-1]["best"] == run.fitness
    # The same seed draws the same first population.
    first = [load_run(study_path / "runs" / name / "seed-0001").individuals[:12] for name in ("gini_12", "random")]
    assert first[0] == first[1]


def test_all_runs_share_one_store(study_path):
    assert [path.relative_to(study_path).name for path in study_path.rglob(STORE)] == [STORE]
    driven = sum(len(load_run(path.parent).runs) for path in (study_path / "runs").rglob(CONFIG))
    with ResultStore(study_path / STORE) as store:
        assert len(store) < driven


def test_the_best_triple_is_the_best_of_all_maps_driven(study_path):
    results = load_results(study_path)
    for best, random in zip(results.of("best_of_random"), results.of("random"), strict=True):
        assert [row["evaluations"] for row in best.generations] == [row["evaluations"] for row in random.generations]
        assert all(a["best"] <= b["best"] for a, b in zip(best.generations, random.generations, strict=True))
        assert {row["map"] for row in load_run(best.path).runs} <= set(load_run(random.path).maps)


def test_a_configuration_takes_from_earlier_ones(study_path):
    results = load_results(study_path)
    means = {n: np.mean([run.fitness for run in results.of(f"gini_{n}")]) for n in (6, 12)}
    gaps = []
    for name in ("gini_6", "gini_12"):
        for run in results.of(name):
            times: dict[str, list] = {}
            for row in load_run(run.path).runs:
                times.setdefault(row["map"], []).append(row["time_s"] if row["outcome"] == "goal" else None)
            gaps += [abs(a - b) for of_map in times.values() if None not in of_map for a, b in combinations(of_map, 2)]
    for run in results.of("cluster"):
        assert run.experiment.search.ga.pop_size == min(means, key=means.get)
        assert run.experiment.search.judging.cluster_scale == pytest.approx(np.median(gaps))
    assert results.resolved["cluster"]["seeds"] == [0, 1]


def test_a_repeated_map_adds_no_length():
    fitness = PathLengthFitness.of(JudgingSettings(), 150.0)

    def judged(*lengths):
        return fitness(tuple(((RunResult("goal", 0.0, length),),) for length in lengths)).fitness

    assert judged(6.0, 5.0, 4.0) == pytest.approx(-5.0)
    assert judged(6.0, 6.0, 6.0) == pytest.approx(-2.0)
    assert judged(6.0, 6.0, 3.0) == pytest.approx(-3.0)


def test_path_length_drives_no_controller_but_for_the_set_it_found(study_path):
    for seed in (0, 1):
        search = load_run(study_path / "searches" / "path_length" / f"seed-000{seed}")
        driven = load_run(study_path / "runs" / "path_length" / f"seed-000{seed}")
        assert {row["controller"] for row in search.runs} == {"global_planner"}
        assert search.best.digest == driven.best.digest
        assert search.checkpoint["evaluations"] == 24
        assert driven.controllers == ("dwb", "mppi", "rpp")
        lengths = [entry["score"] for entry in search.best_results["maps"]]
        assert search.best_results["fitness"] == pytest.approx(-np.mean(lengths))
        assert search.best_results["fitness"] == min(row["fitness"] for row in search.individuals)


VALIDATED = {
    "pop_size": 6,
    "archive": True,
    "elite_seeds": 1,
    "validation": {"seeds": 2, "candidates": 3, "held_out_seeds": 2},
}


def test_a_set_that_is_judged_again_has_no_held_out_fitness(tmp_path):
    names = {"triple": "best_triple", "again": "again", "lengths": "path_length"}
    later = [{"name": one, "method": how, **({} if one == "lengths" else {"of": "ours"})} for one, how in names.items()]
    anew = {"name": "anew", "method": "again", "of": "ours", "experiment": {"search": {"pattern_weight": 10.0}}}
    study = small_study(
        runs=1,
        budget=12,
        experiment={"search": VALIDATED},
        configurations=[{"name": "ours"}, *later, anew],
        reevaluation={"seeds": 0},
    )
    results = run_study(study, tmp_path / "s")
    assert results.missing == ()
    loaded = {run.configuration.name: load_run(run.path) for run in results.runs}
    says = {name: validation_sentence(run.best_results, run.config["search"]) for name, run in loaded.items()}
    assert says["again"] == says["ours"] != []
    assert says["triple"] == says["lengths"] == says["anew"] == []
    ours, again = loaded["ours"].best_results, loaded["again"].best_results
    assert again["fitness"] == again["validation"]["fitness"] == ours["fitness"]
    assert [entry["score"] for entry in again["maps"]] == [entry["score"] for entry in ours["maps"]]


@pytest.mark.parametrize("search", [VALIDATED, {"pop_size": 6, "fitness": "roles"}])
def test_long_paths_are_searched_for_whatever_the_other_searches_look_for(tmp_path, search):
    study = small_study(
        runs=1,
        budget=12,
        experiment={"search": search},
        configurations=[{"name": "lengths", "method": "path_length"}],
        reevaluation={"seeds": 0},
    )
    assert run_study(study, tmp_path / "s").missing == ()
    found = load_run(tmp_path / "s" / "searches" / "lengths" / "seed-0000")
    assert found.best_results["fitness"] == min(row["fitness"] for row in found.individuals)
    assert {row["repeat"] for row in found.runs} == {0}


def test_a_configuration_with_few_seeds_takes_from_all_of_them(tmp_path):
    second = {"name": "second", "runs": 1, "pop_size_from": ["first"]}
    first = {"name": "first", "experiment": {"search": {"pop_size": 6}}}
    study = small_study(budget=6, configurations=[first, second], reevaluation={"seeds": 0})
    assert run_study(study, tmp_path / "s").missing == ()


def test_the_automaton_draws_other_maps(study_path):
    walls = {
        name: np.mean(
            [grid.occupancy.mean() for grid in load_run(study_path / "runs" / name / "seed-0000").maps.values()]
        )
        for name in ("random", "cellular")
    }
    assert not np.isclose(walls["random"], walls["cellular"], rtol=0.02)


def test_the_noise_of_the_re_evaluation_leaves_nothing_of_the_searchs():
    assert _complete("nominal", "study") == "nominal"
    whole = _complete({"level": "rough", "scan": 0.5}, "study")
    assert NoiseSettings(**whole) == NOISES["rough"].replace(scan=0.5)
    assert set(whole) == set(NoiseSettings.model_fields)
    with pytest.raises(ConfigError, match=r"study: reevaluation\.noise: unknown key 'scna'; did you mean 'scan'"):
        _complete({"scna": 0.5}, "study")


def test_the_best_sets_are_driven_again_with_fresh_seeds(study_path):
    results = load_results(study_path)
    fresh = json.loads((study_path / "reevaluation" / "gini_6" / "seed-0000.json").read_text())
    assert fresh["noise"] == read_noise("nominal", "noise").model_dump(mode="json")
    searched = {row["seed"] for row in load_run(results.runs[0].path).runs}
    again = {one["seed"] for entry in fresh["maps"] for runs in entry["runs"].values() for one in runs}
    assert len(again) == 3 * 3 * 4
    assert not searched & again
    assert max(small_study().seeds) < MAX_SEED


def test_a_finished_study_resumes_to_itself(study_path, tmp_path):
    shutil.copytree(study_path, tmp_path / "again")
    seen = []
    run_study(small_study(), tmp_path / "again", resume=True, on_progress=seen.append)
    assert seen == []
    assert lasting_files(tmp_path / "again") == lasting_files(study_path)


def test_progress_is_over_the_whole_study(tmp_path):
    seen = []
    run_study(small_study(configurations=TWO), tmp_path / "s", on_progress=seen.append)
    fractions = [one.fraction for one in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == pytest.approx(1.0)
    assert seen[-1].seconds_left == pytest.approx(0.0)
    assert [(one.configuration, one.seed) for one in seen if one.step == "done"] == [
        (name, seed) for name in ("ga", "best") for seed in (0, 1)
    ]


KILLED = """
import os, signal
import pytest
from gym_mapbench.world.noise import read_noise
from tests.evolution.fake_study import use_fakes
from tests.evolution.studies.test_study import TWO, run_study, small_study

use_fakes(pytest.MonkeyPatch())
left = {after}

def kill_at(progress):
    global left
    left -= 1
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    run_study(small_study(configurations=TWO), {path!r}, on_progress=kill_at)
"""


@pytest.mark.slow
def test_a_killed_study_resumes_to_the_same_bytes(tmp_path):
    study = small_study(configurations=TWO)
    run_study(study, tmp_path / "whole")
    script = KILLED.format(path=str(tmp_path / "killed"), after=7)
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=False, timeout=PATIENCE, cwd=ROOT)
    assert done.returncode == -9
    partial = load_results(tmp_path / "killed")
    assert [(run.configuration.name, run.seed) for run in partial.runs] == [("ga", 0)]
    assert partial.missing[0] == "ga, seed 1: stopped after 12 of 24 evaluations"
    assert partial.missing[1] == "best: none of its 2 searches was begun"
    results = run_study(study, tmp_path / "killed", resume=True, resources=Resources(workers=2, executor=WORKERS))
    assert results.missing == ()
    assert lasting_files(tmp_path / "killed") == lasting_files(tmp_path / "whole")


def test_a_part_can_be_run_first(tmp_path):
    study = small_study(configurations=TWO)
    part = run_study(study, tmp_path / "s", only=["ga"], runs=1)
    assert [(run.configuration.name, run.seed) for run in part.runs] == [("ga", 0)]
    assert part.missing == ("ga: 1 of 2 searches was not begun (seed 1)", "best: none of its 2 searches was begun")
    waiting = run_study(study, tmp_path / "s", resume=True, only=["best"])
    assert waiting.missing[0] == "best, seed 1: builds on ga, whose run 1 is not finished"
    assert (waiting.failed, len(waiting.runs)) == (1, 2)
    whole = run_study(study, tmp_path / "s", resume=True)
    assert (whole.missing, whole.failed) == ((), 0)
    with pytest.raises(ConfigError, match="unknown configuration 'gaa'; did you mean 'ga'"):
        run_study(study, tmp_path / "s", resume=True, only=["gaa"])


def test_what_builds_on_others_waits_for_them(tmp_path):
    waiting = run_study(small_study(), tmp_path / "s", only=["cluster"])
    assert waiting.missing[0] == "cluster: builds on gini_6, which has not finished 2 of 2 runs"
    assert (waiting.failed, waiting.runs) == (2, ())


SHORT = {"environment": {"time_limit": 1.0}}
"""A world in which nobody arrives in time."""
ONE_CONTROLLER = {"controllers": [{"name": "dwb"}], "search": {"pop_size": 6}}
"""No pair of controllers, no gap, no cluster scale."""


def test_a_run_that_cannot_be_made_costs_itself_and_what_builds_on_it(tmp_path):
    study = small_study(
        configurations=[
            {"name": "short", "experiment": {"run": SHORT, "search": {"pop_size": 6, "fitness": "cluster"}}},
            {"name": "best", "method": "best_triple", "of": "short"},
            {"name": "like_short", "experiment": {"search": {"pop_size": 6}}, "pop_size_from": ["short"]},
            {"name": "ga", "experiment": {"search": {"pop_size": 6}}},
        ]
    )
    seen = []
    for resume in (False, True):
        results = run_study(study, tmp_path / "s", resume=resume, on_progress=seen.append)
        assert [(run.configuration.name, run.seed) for run in results.runs] == [("ga", 0), ("ga", 1)]
        why = (
            "judging.cluster_scale: cannot be calibrated from the first population (no map that all controllers solved)"
        )
        assert [line.split("; give a value")[0] for line in results.missing[:5]] == [
            f"short, seed 0: {why}",
            f"short, seed 1: {why}",
            "best, seed 0: builds on short, whose run 0 is not finished",
            "best, seed 1: builds on short, whose run 1 is not finished",
            "like_short: builds on short, which has not finished 2 of 2 runs",
        ]
        assert results.failed == 6
    assert [one.fraction for one in seen][-1] == pytest.approx(1.0)
    assert load_results(tmp_path / "s").failed == 0


def test_what_would_cost_every_run_stops_the_study(tmp_path, monkeypatch):
    study = small_study(configurations=TWO)
    monkeypatch.setattr("evolution.runs.exclusive.preparation_of", lambda _: broken_warm_up)
    with pytest.raises(RunError, match="workers cannot start: ImportError: no LLVM here"):
        run_study(study, tmp_path / "s", resources=Resources(executor=WORKERS))
    shutil.rmtree(tmp_path / "s" / "runs")
    (tmp_path / "s" / "runs").touch()
    with pytest.raises(RunError, match="runs/ga/seed-0000: cannot be made"):
        run_study(study, tmp_path / "s", resume=True)


def test_controllers_are_made_before_anything_runs(tmp_path):
    other = {**ONE_CONTROLLER, "controllers": [{"name": "dwp"}]}
    configurations = [TWO[0], {"name": "other", "experiment": other}]
    with pytest.raises(ConfigError, match="small: other: unknown controller 'dwp'; did you mean 'dwb'"):
        run_study(small_study(configurations=configurations), tmp_path / "s")
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize(
    ("controller", "message"),
    [
        ("dwp", "mine: a: unknown controller 'dwp'; did you mean 'dwb'"),
        ({"name": "rpp", "params": {"lookahead": 1.0}}, "mine: a: .*lookahead"),
        ({"name": "rl", "kind": "none.zip"}, r"mine: a: .*none\.zip"),
    ],
)
def test_nav2s_controllers_are_made_before_anything_runs(controller, message):
    document = {"name": "mine", "configurations": [{"name": "a", "experiment": {"controllers": [controller]}}]}
    with pytest.raises(ConfigError, match=message):
        check_study(StudySettings(**document))


def test_a_single_controller_is_refused_before_anything_runs():
    alone = [{"name": "a", "experiment": {"search": {"pop_size": 6}, "controllers": [{"name": "dwb"}]}}]
    with pytest.raises(ConfigError, match="small: a: controllers: expected two or more to compare, got dwb alone"):
        check_study(small_study(configurations=alone))


def test_a_run_that_failed_half_way_leaves_nothing_to_the_progress_of_the_next():
    configuration = {"name": "a", "experiment": {"search": {"pop_size": 6, "runs": 108}}}
    (task,) = check_study(small_study(configurations=[configuration], reevaluation={"seeds": 0}))
    seen = []
    meter = _Meter(SimpleNamespace(driven=0), 2 * work_of(task), seen.append)
    generation = SimpleNamespace(driven=54, reused=0, row={"evaluations": 6, "best": 0.0})
    meter.search(task, generation)
    meter.skip(task)
    meter.search(task, generation)
    assert [one.fraction for one in seen] == [0.25, 0.75]


def test_what_was_taken_from_few_seeds_is_said_and_can_be_taken_from_all(study_path, tmp_path):
    names = ("gini_6", "gini_12", "cluster")
    document = small_study().model_dump(mode="json")
    study = small_study(configurations=[one for one in document["configurations"] if one["name"] in names])
    run_study(study, tmp_path / "s", runs=1)
    early = run_study(study, tmp_path / "s", resume=True)
    (line,) = early.missing
    what, _, advice = line.partition("; to take it from all: ")
    assert re.fullmatch(r"cluster: pop_size \d+ and cluster_scale [\d.]+ taken from 1 of 2 seeds", what)
    remove, go_on = advice.split(" and then ")
    assert go_on == f"mapbench study {tmp_path / 's'} --resume"
    subprocess.run(remove.split(), check=True)
    assert run_study(study, tmp_path / "s", resume=True).missing == ()
    for part in [f"{kind}/{name}" for kind in ("runs", "reevaluation") for name in names]:
        assert lasting_files(tmp_path / "s" / part) == lasting_files(study_path / part) != {}


def test_a_study_does_not_continue_with_another_model_in_the_same_file(tmp_path):
    model = tmp_path / "learned.zip"
    shutil.copy(ROOT / "examples" / "policies" / "ppo.zip", model)
    controllers = [{"name": "rpp"}, {"name": "learned", "kind": str(model)}]
    study = small_study(configurations=TWO, experiment={"controllers": controllers})
    run_study(study, tmp_path / "s", only=["ga"], runs=1)
    run_study(study, tmp_path / "s", only=["ga"], runs=1, resume=True)
    shutil.copy(ROOT / "examples" / "policies" / "ppo_path.zip", model)
    with pytest.raises(ConfigError, match=r"models\..*learned\.zip was \w+ when the study began, got \w+"):
        run_study(study, tmp_path / "s", resume=True)


def test_only_the_same_study_continues(tmp_path):
    study = small_study(configurations=TWO)
    run_study(study, tmp_path / "s", only=["ga"], runs=1)
    with pytest.raises(ConfigError, match="already holds a study; continue it with --resume"):
        run_study(study, tmp_path / "s")
    other = json.loads(json.dumps(study.model_dump(mode="json")))
    other["configurations"][0]["experiment"]["search"]["ga"]["pop_size"] = 8
    with pytest.raises(
        ConfigError, match=r"configurations.ga.experiment.search.ga.pop_size was 6 when .* began, got 8"
    ):
        run_study(StudySettings(**other), tmp_path / "s", resume=True)
    document = json.loads((tmp_path / "s" / STUDY.mark).read_text())
    for changes, message in (
        ({"version": "0.0.0"}, r"written by version 0.0.0; version \S+ cannot continue it"),
        ({"format_version": 9}, "expected mapbench-study 1, got mapbench-study 9"),
        ({"study": {"name": "x"}}, "study.json: missing key 'configurations'"),
    ):
        (tmp_path / "s" / STUDY.mark).write_text(json.dumps({**document, **changes}))
        with pytest.raises(RunError, match=message):
            run_study(study, tmp_path / "s", resume=True)
    with pytest.raises(RunError, match=r"not a study directory \(no study.json\)"):
        run_study(study, tmp_path / "none", resume=True)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "file").touch()
    with pytest.raises(ConfigError, match="expected a new or empty directory"):
        run_study(study, tmp_path / "other")


def test_what_is_missing_or_damaged_is_said_and_the_rest_stays(study_path, tmp_path):
    path = tmp_path / "s"
    shutil.copytree(study_path, path)
    shutil.rmtree(path / "runs" / "cellular")
    (path / "runs" / "gini_6" / "seed-0000" / CHECKPOINT).unlink()
    (path / "runs" / "gini_12" / "seed-0001" / "best_results.json").write_text("{")
    (path / "runs" / "random" / "seed-0000" / CONFIG).unlink()
    (path / "reevaluation" / "cluster" / "seed-0001.json").unlink()
    (path / "reevaluation" / "cluster" / "seed-0000.json").write_text('{"map_set": "of another run"}')
    results = load_results(path)
    assert [re.sub(r"\S*/", "", line) for line in results.missing] == [
        "gini_6, seed 0: stopped after 0 of 24 evaluations",
        "gini_12, seed 1: best_results.json: not a JSON file (Expecting property name enclosed in double quotes: "
        "line 1 column 2 (char 1)); to repeat the run: rm -r seed-0001 and then mapbench study s --resume",
        "random, seed 0: seed-0000: not a run directory (no config.json); to repeat the run: rm -r seed-0000 and "
        "then mapbench study s --resume",
        "cellular: none of its 2 searches was begun",
        "cluster, seed 0: seed-0000.json: fitness: is missing; mapbench study s --resume repeats it",
        "cluster, seed 1: not re-evaluated yet",
    ]
    assert len(results.runs) == 14 - 5
    assert [run.reevaluation for run in results.of("cluster")] == [None, None]


def bad_configurations(**second):
    return [{"name": "a"}, {"name": "b", **second}]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"configuration": []}, "unknown key 'configuration'; did you mean 'configurations'"),
        ({"configurations": []}, "configurations: expected at least one"),
        ({"configurations": [{"name": "a/b"}]}, "name: expected up to 60 letters, digits and"),
        ({"configurations": [{"name": "a"}, {"name": "a"}]}, "expected different names, got 'a' twice"),
        (
            {"configurations": bad_configurations(method="ga", of="a")},
            "best_triple or again and with no",
        ),
        ({"configurations": bad_configurations(method="best_triple")}, "expected with method best_triple"),
        (
            {"configurations": bad_configurations(method="best_triple", of="a", experiment={"controllers": ["dwb"]})},
            "experiment.controllers: best_triple judges recorded runs",
        ),
        (
            {"configurations": bad_configurations(method="best_triple", of="a", experiment={"search": {"repeats": 2}})},
            r"experiment\.search\.repeats: best_triple judges recorded runs",
        ),
        ({"configurations": bad_configurations(method="bets_triple")}, "method: expected 'ga', 'random'"),
        ({"configurations": bad_configurations(pop_size_from=["c"])}, "b: unknown earlier configuration 'c'"),
        ({"configurations": bad_configurations(experiment={"serch": {}})}, "unknown section 'serch'; did you mean"),
        (
            {"configurations": bad_configurations(experiment={"run": "fast"})},
            "run: expected a mapping of options, got str",
        ),
        ({"configurations": bad_configurations(experiment={"search": {"seed": 3}})}, r"search\.seed: expected none"),
        ({"configurations": bad_configurations(experiment={"search": {"algorithm": "ga"}})}, "expected none beside"),
        ({"configurations": bad_configurations(experiment={"search": 3})}, "search: expected a mapping"),
        ({"experiment": {"search": {"evaluations": 500}}}, r"search\.evaluations: expected none for the whole study"),
        ({"experiment": {"search": {"ga": {"algorithm": "nsga2"}}}}, r"search\.algorithm: expected none for the whole"),
        ({"runs": 0}, "runs: expected greater than or equal to 1"),
        (
            {"runs": 2, "configurations": bad_configurations(runs=3)},
            "b: runs: expected at most 2, as many as the study",
        ),
        ({"reevaluation": {"seed": 3}}, "reevaluation: unknown key 'seed'; did you mean 'seeds'"),
    ],
)
def test_bad_studies_are_one_line(options, message):
    with pytest.raises(ConfigError, match=message) as caught:
        StudySettings.from_mapping(changed(**options), "mine.yaml")
    assert str(caught.value).startswith("mine.yaml: ")
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("second", "message"),
    [
        ({"experiment": {"search": {"pop_sise": 3}}}, "b: search: unknown key 'pop_sise'; did you mean"),
        ({"experiment": {"search": {"pop_size": 30}}}, "small: b: search: evaluations: expected at least pop_size"),
        ({"method": "best_triple", "of": "a", "experiment": {"search": {"maps_per_set": 4}}}, "maps_per_set up to 3"),
        ({"method": "path_length", "experiment": {"search": {"fitness": "cluster"}}}, "expected cluster_scale_from"),
    ],
)
def test_bad_experiments_are_refused_before_anything_runs(tmp_path, second, message):
    first = {"name": "a", "experiment": {"search": {"pop_size": 6}}}
    merged = {"experiment": {"search": {"pop_size": 6}}, **second}
    if "of" not in second:
        merged["experiment"] = {"search": {"pop_size": 6, **merged["experiment"]["search"]}}
    study = small_study(configurations=[first, {"name": "b", **merged}])
    with pytest.raises(ConfigError, match=message):
        run_study(study, tmp_path / "s")
    assert not (tmp_path / "s").exists()


def test_studies_are_found_by_name_or_file(tmp_path):
    with pytest.raises(ConfigError, match="unknown study 'thesos'; did you mean 'thesis'"):
        load_study("thesos")
    with pytest.raises(ConfigError, match=r"none\.yaml: cannot be read"):
        load_study(tmp_path / "none.yaml")
    (tmp_path / "list.yaml").write_text("- a\n")
    with pytest.raises(ConfigError, match=r"list\.yaml: expected a mapping of options"):
        load_study(tmp_path / "list.yaml")


def test_the_file_of_a_finished_study_describes_it(study_path, tmp_path):
    assert load_study(study_path / "study.json") == load_results(study_path).settings
    (tmp_path / "study.json").write_text('{"format": "mapbench-study", "study": {}}')
    with pytest.raises(RunError, match=r"study\.json: version: is missing"):
        load_study(tmp_path / "study.json")


def test_a_study_is_laid_over_one_of_the_package(tmp_path):
    own = "base: evolve\nname: mine\nexperiment: {search: {pop_size: 8}, controllers: [dwb, rpp]}\n"
    (tmp_path / "mine.yaml").write_text(own)
    mine, evolve = load_study(tmp_path / "mine.yaml"), load_study("evolve")
    assert mine == evolve.replace(name="mine", experiment=mine.experiment)
    assert mine.experiment["controllers"] == ["dwb", "rpp"]
    search, before = mine.experiment["search"], evolve.experiment["search"]
    assert search == {**before, "ga": {**before["ga"], "pop_size": 8}}


@pytest.mark.parametrize(
    ("own", "message"),
    [
        ("base: evolv\n", "unknown study 'evolv'; did you mean 'evolve'"),
        ("base: [a]\n", "unknown study"),
        ("base: evolve\nexperiment: 3\n", "experiment: expected"),
        ("base: evolve\nexperiment: {search: {pop_size: 8, ga: {pop_size: 9}}}\n", "expected once, got it under two"),
        ("base: evolve\nworlds: {a: {}, b: {}}\n", "unknown key"),
    ],
)
def test_what_cannot_be_laid_over_a_study_is_one_line(tmp_path, own, message):
    (tmp_path / "mine.yaml").write_text(own)
    with pytest.raises(ConfigError, match=message) as caught:
        load_definition(tmp_path / "mine.yaml")
    assert str(caught.value).startswith(f"{tmp_path / 'mine.yaml'}: ")
    assert "\n" not in str(caught.value)
