"""The face for Python: few names, tables, and no ``__main__`` guard."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import evolution
from evolution import bench, compare, configuration_of, evolve, load, minimize, study, tune
from evolution.benchmark import begin_benchmark, benchmark_document
from evolution.cli import main
from evolution.driving import ControllerSpec, JobPlan
from evolution.files import Table
from evolution.inputs import listed, numbered, read_parameters, tuning_of, world_from, world_of
from evolution.search import read_document
from evolution.studies import StudyResults
from evolution.tuning import TuneSettings
from gym_mapbench.errors import ConfigError, MapFormatError, RunError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.trust import allow_code
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.noise import read_noise
from gym_mapbench.world.scenario import Pose, Scenario
from tests.evolution import fake_runs
from tests.evolution.processes import PATIENCE
from tests.worlds import among, line

OFFICE = Path(__file__).resolve().parents[2] / "examples" / "office.yaml"


@pytest.fixture
def fake_robot(monkeypatch):
    """Runs without a robot."""
    for place in ("evolution.api.searches", "evolution.api.benchmarks"):
        monkeypatch.setattr(f"{place}.run_job", fake_runs.misbehave)
    for place in ("evolution.api.searches", "evolution.runs.exclusive"):
        monkeypatch.setattr(f"{place}.preparation_of", lambda *_: None)
    monkeypatch.setattr("evolution.api.searches.write_run_figures", lambda *_, **__: None)


def test_every_metric_that_is_asked_for_is_a_column_of_the_summary():
    asked = ["jerk", "path_length", "freezing_time", "time"]
    result = bench(OFFICE, "rpp", metrics=asked, workers=1, time_limit=1.0)
    assert [name for name in result.table().columns if name in asked] == ["jerk", "path_length", "freezing_time"]


def test_results_that_are_loaded_have_the_columns_of_their_metrics(tmp_path):
    asked = (name for name in ["path_length", "jerk"])  # a generator can be read once
    result = bench(OFFICE, "rpp", metrics=asked, workers=1, time_limit=1.0, out=tmp_path / "b")
    assert {"path_length", "jerk"} < set(result.table().columns)
    sides = [configuration_of(name, name, "rpp", time_limit=1.0) for name in ("thesis", "fair")]
    compared = compare(OFFICE, sides, metrics=["path_length", "freezing_time"], workers=1, out=tmp_path / "c")
    assert {"path_length", "freezing_time"} < set(compared.table().columns)
    for returned, loaded in ((result, load(tmp_path / "b")), (compared, load(tmp_path / "c"))):
        assert list(loaded.table()) == list(returned.table())
        assert loaded.to_json() == returned.to_json()
    assert list(load(tmp_path / "b").table("controllers")) == list(result.table("controllers"))


@pytest.mark.usefixtures("fake_robot")
def test_whole_numbers_of_numpy_are_those_of_python(tmp_path):
    python, numpy = tmp_path / "python", tmp_path / "numpy"
    bench(OFFICE, "rpp", repeats=2, seed=3, workers=1, out=python)
    bench(OFFICE, "rpp", repeats=np.int64(2), seed=np.uint8(3), workers=1, out=numpy)
    assert (numpy / "benchmark.json").read_bytes() == (python / "benchmark.json").read_bytes()
    assert rows_but_timings(numpy) == rows_but_timings(python)


def test_a_map_without_people_has_no_distance_to_people():
    """The 1000 m of a search there would be most of a mean over maps, and hide a touch from a rule."""
    asked = ["min_distance_to_people", "personal_space_time"]
    rooms = [replace(among(), name="empty"), among(line((2.5, 0.8), (1.0, 0.8), 0.5))]
    empty, crossed = bench(rooms, "rpp", metrics=asked, workers=1, time_limit=1.0).rows
    assert [empty[name] for name in asked] == [None, 0.0]
    assert 0.0 < crossed["min_distance_to_people"] < 2.0


@pytest.mark.usefixtures("fake_robot")
def test_bench_keeps_what_load_reads(tmp_path):
    result = bench(OFFICE, ["rpp", {"name": "far", "kind": "rpp"}], repeats=2, workers=1, out=tmp_path / "b")
    assert [(row["controller"], row["repeat"]) for row in result.rows] == [
        ("rpp", 0),
        ("rpp", 1),
        ("far", 0),
        ("far", 1),
    ]
    assert [row["goals"] for row in result.table()] == ["2/2", "2/2"]
    assert load(tmp_path / "b").rows == result.rows
    assert "<td>far</td>" in result._repr_html_()


def rows_but_timings(path):
    return [{key: value for key, value in row.items() if key != "wall"} for row in load(path).rows]


@pytest.mark.usefixtures("fake_robot")
@pytest.mark.parametrize("driven_before", [1, 2, 4])
def test_an_interrupted_bench_goes_on_to_the_same_results(tmp_path, driven_before):
    options = {"controllers": ["rpp", "far=rpp"], "repeats": 2, "workers": 1, "seed": 5}
    bench(OFFICE, out=tmp_path / "whole", **options)
    driven = []

    def interrupt(*_):
        driven.append(1)
        if len(driven) == driven_before:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bench(OFFICE, out=tmp_path / "part", on_run=interrupt, **options)
    assert not (tmp_path / "part" / "bench.json").exists()
    with pytest.raises(RunError, match="not finished; continue it with --resume"):
        load(tmp_path / "part")
    lefts = []
    result = bench(OFFICE, out=tmp_path / "part", resume=True, on_run=lambda *run: lefts.append(run[2]), **options)
    assert lefts == list(range(4 - driven_before))[::-1]
    assert rows_but_timings(tmp_path / "part") == rows_but_timings(tmp_path / "whole")
    assert [*load(tmp_path / "part").rows[0]] == [*load(tmp_path / "whole").rows[0]]
    again = bench(OFFICE, out=tmp_path / "part", resume=True, **options)
    assert again.to_json() == result.to_json() == (tmp_path / "part" / "bench.json").read_text()
    assert sorted(path.name for path in (tmp_path / "part").iterdir()) == [
        "bench.csv",
        "bench.json",
        "benchmark.json",
        "results.sqlite",
    ]


@pytest.mark.usefixtures("fake_robot")
@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"seed": 6}, "seed was 5 when the benchmark began, got 6"),
        ({"repeats": 3}, "repeats was 2 when the benchmark began, got 3"),
        ({"controllers": ["rpp", "dwb"]}, "list of controllers was far, rpp when the benchmark began, got dwb, rpp"),
        ({"time_limit": 20.0}, r"settings\.environment\.time_limit was 150\.0 when the benchmark began, got 20\.0"),
        ({"goal": (8.0, 6.0, 0.5)}, r"digest of map 1 office with start and goal was \w+ when the benchmark began"),
        ({"resume": False}, "already holds a benchmark; continue it with --resume, or choose another directory"),
    ],
)
def test_another_experiments_directory_is_left_alone(tmp_path, changes, message):
    options = {"controllers": ["rpp", "far=rpp"], "repeats": 2, "workers": 1, "seed": 5}
    bench(OFFICE, out=tmp_path, **options)
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    with pytest.raises(ConfigError, match=message) as caught:
        bench(OFFICE, out=tmp_path, **({"resume": True} | options | changes))
    assert "\n" not in str(caught.value)
    assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


@pytest.mark.usefixtures("fake_robot")
def test_maps_may_be_there_already():
    scenarios = load_scenarios(OFFICE)
    both = bench([OFFICE.with_name("hall.yaml"), *scenarios], "rpp", workers=1, time_limit=1.0)
    assert [row["map"] for row in both.rows] == ["hall", "office"]
    assert both.rows[1]["walls"] == scenarios[0].map.digest


@pytest.mark.parametrize("controllers", [lambda observation: (0.0, 0.0), 3, {"name": "rpp"}])
def test_controllers_of_another_type_are_refused_in_one_line(controllers):
    with pytest.raises(ConfigError, match="controllers: expected a name or a list of names or mappings, got "):
        bench(OFFICE, controllers)


@pytest.mark.usefixtures("fake_robot")
def test_evolve_and_continue(tmp_path):
    options = {"pop_size": 2, "evaluations": 4, "maps_per_set": 2}
    run = evolve("quick", out=tmp_path / "run", workers=1, **options)
    assert run.finished
    assert len(run.table("individuals")) == 4
    assert [row["map"] for row in run.table()] == ["map_1", "map_2"]
    again = evolve(resume=tmp_path / "run", workers=1)
    assert again.best_results == run.best_results == load(tmp_path / "run").best_results
    assert len(bench(run, "rpp", workers=1).rows) == 2


@pytest.mark.usefixtures("fake_robot")
@pytest.mark.parametrize("preset", ["thesis", "quick"])
def test_the_config_of_a_run_repeats_it(tmp_path, preset):
    """The operators of the default preset, which other presets do not have, must not come in between."""
    first = evolve(preset, out=tmp_path / "first", workers=1, pop_size=2, evaluations=4, maps_per_set=2, seed=7)
    argv = ["evolve", "--config", str(first.path / "config.json"), "--out", str(tmp_path / "again"), "--workers", "2"]
    assert main(argv) == 0
    for name in ("config.json", "individuals.csv", "runs.csv", "best_map_set.json", "best_results.json"):
        assert (tmp_path / "again" / name).read_bytes() == (first.path / name).read_bytes(), name


def test_other_versions_of_a_run_are_named_before_it_is_repeated(tmp_path, caplog):
    config = {"format": "mapbench-run", "format_version": 1, "version": "0.0.1", "libraries": {}, "search": {}}
    (tmp_path / "config.json").write_text(json.dumps(config))
    read_document(tmp_path / "config.json")
    assert "written by mapbench 0.0.1" in caplog.text
    (tmp_path / "config.json").write_text(json.dumps({**config, "libraries": 3}))
    with pytest.raises(RunError, match="libraries"):
        read_document(tmp_path / "config.json")


@pytest.mark.parametrize(
    ("document", "message"),
    [
        ({"serch": {}}, "experiment: unknown section 'serch'; did you mean 'search'"),
        ({"search": 3}, "experiment: search: expected a mapping of options, got int"),
        ({"search": None}, "experiment: search: expected a mapping of options, got nothing"),
        ({"version": "1"}, "experiment: unknown section 'version'"),
    ],
)
def test_a_mapping_is_checked_like_a_file(document, message):
    with pytest.raises(ConfigError, match=message):
        evolve(document)


@pytest.mark.usefixtures("fake_robot")
def test_the_maps_of_a_run_are_driven_in_its_world_and_judged_as_a_set(tmp_path, capsys):
    options = {"pop_size": 2, "evaluations": 4, "runs": 200, "seed": 4, "confirmation": {"candidates": 3}}
    document = {"controllers": ["rpp", "dwb"], "run": {"environment": {"noise": "rough"}}}
    run = evolve(document, out=tmp_path / "run", workers=1, **options)
    again = bench(tmp_path / "run", repeats=3, workers=1, out=tmp_path / "bench")
    assert {row["controller"] for row in again.rows} == {"rpp", "dwb"}
    seeds = {result["seed"] for entry in run.best_results["maps"] for runs in entry["runs"].values() for result in runs}
    assert not seeds & {row["seed"] for row in again.rows}  # new seeds, unless the search's own is asked for
    assert len(again.reevaluation.trials) == 3
    assert len(again.reevaluation.results) == 3
    written = json.loads((tmp_path / "bench" / "bench.json").read_text())
    assert written["map_set"]["fitness"] == [one.fitness for one in again.reevaluation.trials]
    assert bench(tmp_path / "run", "rpp", workers=1).reevaluation is None
    assert world_of(run) == world_of(load(tmp_path / "run"))
    assert world_of(run).environment.noise == read_noise("rough", "noise")
    assert main(["bench", str(tmp_path / "run"), "--repeats", "2", "--workers", "1"]) == 0
    assert "As a map set: median fitness" in capsys.readouterr().out


def test_studies_are_tables(study_path):
    results = load(study_path)
    assert isinstance(results, StudyResults)
    assert isinstance(results.table("generations"), Table)
    assert "<table>" in results._repr_html_()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda folder: bench(OFFICE, "mpi"), "did you mean 'mppi'"),
        (lambda folder: bench(OFFICE, "rpp", nois="nominal"), "nois"),
        (lambda folder: bench([OFFICE, "barn:there"], "rpp"), "expected no other map beside it"),
        (lambda folder: bench("barn:there", "rpp", robot="jackal"), "robot: expected none beside barn:DIR"),
        (lambda folder: bench(OFFICE, "rpp", resume=True), "resume: expected the directory of a benchmark"),
        (
            lambda folder: bench(OFFICE, "rpp", resume=True, out=folder),
            r"not a benchmark directory \(no benchmark.json",
        ),
        (lambda folder: evolve("quikc", out=folder / "a"), "quikc"),
        (lambda folder: evolve("quick", pop_sise=2, out=folder / "a"), "pop_size"),
        (lambda folder: evolve({"controllers": ["rpp"]}, out=folder / "a"), "two or more"),
        (lambda folder: evolve(resume=folder, seed=3), "expected no other option, got seed"),
        (lambda folder: study("thesos", out=folder / "a"), "did you mean 'thesis'"),
        (load, "expected the directory of a run"),
        (lambda folder: bench(OFFICE, "rpp", workers=0), "workers: expected greater than or equal to 1, got 0"),
        (lambda folder: study("quick", worker=2, out=folder / "a"), "did you mean 'workers'"),
        (lambda folder: bench([], "rpp"), "maps: expected at least one map, got none"),
        (lambda folder: bench([OFFICE, 3], "rpp"), "maps: expected files, scenarios, map sets or runs, got 3"),
        (lambda folder: minimize(None, "rpp fails", out=folder / "a"), "maps: expected files, .* got None"),
        (lambda folder: minimize([OFFICE], 3, out=folder / "a"), "keep: expected an instance of str, got 3"),
        (
            lambda folder: minimize(OFFICE, "rpp won", out=folder / "a"),
            "^keep: expected 'CONTROLLER fails', .* 'rpp w",
        ),
        (lambda folder: minimize(OFFICE, "order", out=folder / "a", map_name="of"), "^map_name: unknown map 'of'"),
        (
            lambda folder: minimize(OFFICE, "order", out=folder / "a", tolerance="x"),
            "^tolerance: expected a finite number above 0, got 'x'$",
        ),
        (
            lambda folder: tune("rpp", OFFICE, OFFICE, out=folder / "a"),
            "^test: expected maps that are not among",
        ),
        (lambda folder: bench(OFFICE, "rpp", seed="0"), "seed: expected a whole number, 0 or greater, got '0'"),
        (lambda folder: bench(OFFICE, "rpp", seed=-1), "seed: expected a whole number, 0 or greater, got -1"),
        (lambda folder: bench(OFFICE, "rpp", repeats=2.0), "repeats: expected a whole number, 1 to 10000, got 2.0"),
        (
            lambda folder: bench(OFFICE, [Path]),
            r"controllers: expected names, module:attribute or mappings of options, got <class 'pathlib.Path'>",
        ),
        (
            lambda folder: bench(OFFICE, "__main__:Mine"),
            "controller '__main__:Mine': is defined in this script or notebook alone",
        ),
        (lambda folder: bench(OFFICE, "rpp", metrics=3), "metrics: expected a name or a list of names, got 3"),
        (lambda folder: bench(OFFICE, "rpp", out=3), "out: expected a path, got 3"),
        (lambda folder: bench(OFFICE, "rpp", params=3), "expected a file name, got 3"),
        (lambda folder: bench(OFFICE, "rpp", settings={}), "settings: expected an instance of DriveSettings, got {}"),
        (lambda folder: bench(OFFICE, "rpp", resources=None), "resources: expected an instance of Resources, got None"),
        (lambda folder: compare(OFFICE, []), "configurations: expected at least one, got none"),
        (lambda folder: compare(OFFICE, ["fair"]), "configurations: expected an instance of Configuration, got 'fair'"),
        (lambda folder: compare(OFFICE, [configuration_of(" ", "fair", "rpp")]), "label: expected a name, got ' '"),
        (
            lambda folder: compare(OFFICE, [configuration_of("a", "fair", "rpp")], metrics="jerks"),
            "unknown metric 'jerks'; did you mean 'jerk'",
        ),
        (lambda folder: evolve("thesis", resume=folder), "expected no other option, got experiment"),
        (lambda folder: evolve(3, out=folder / "a"), "expected a file name, got 3"),
        (lambda folder: study({}, out=folder / "a"), "settings: expected a study, its name, or a file, got {}"),
        (lambda folder: study("quick", runs=0, out=folder / "a"), "runs: expected a whole number, 1 or greater, got 0"),
        (lambda folder: study("quick", only="gini", out=folder / "a"), "unknown configuration 'gini'"),
        (lambda folder: tune("rpp", OFFICE, OFFICE, params=folder / "a", out=folder / "b"), "a: cannot be read"),
        (lambda folder: load(3), "path: expected a path, got 3"),
    ],
)
def test_mistakes_are_one_line(call, message, tmp_path):
    with pytest.raises((ConfigError, RunError), match=message) as caught:
        call(tmp_path)
    assert "\n" not in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_the_costmaps_have_the_shape_of_a_robot_that_replaces_that_of_the_file():
    file = "examples/nav2_params.yaml"
    world = world_from(file, read_parameters(file), {"robot": "jackal"}, None)
    for costmap in (world.navigation.local_costmap, world.navigation.global_costmap):
        assert (costmap.robot_radius, costmap.footprint) == (None, None)
    assert world_from(file, read_parameters(file), {}, None).navigation.local_costmap.robot_radius == 0.18


def test_a_file_whose_own_controller_is_not_built_here_may_be_read_for_others(tmp_path):
    """As the commands do, for which the controllers are named."""
    file = tmp_path / "nav2_params.yaml"
    own = {"controller_plugins": ["FollowPath"], "FollowPath": {"plugin": "teb_local_planner::TebLocalPlannerROS"}}
    file.write_text(json.dumps({"controller_server": {"ros__parameters": own}}))
    with pytest.raises(ConfigError, match="TebLocalPlannerROS"):
        bench(OFFICE, params=file, workers=1, time_limit=1.0)
    assert configuration_of("mine", file, "rpp").plan.names == ("rpp",)
    assert len(bench(OFFICE, "rpp", params=file, workers=1, time_limit=1.0).rows) == 1


def test_a_tuning_has_the_world_of_the_whole_file():
    """As the command has it, so that either can continue the tuning of the other."""
    file, hall = "examples/nav2_params.yaml", OFFICE.with_name("hall.yaml")
    plan, _ = tuning_of("Pursuit", OFFICE, hall, Path(file), None, None, {}, TuneSettings())
    assert plan.world == world_from(file, read_parameters(file), {}, None)


def test_the_package_names_its_functions():
    assert all(callable(getattr(evolution, name)) for name in evolution.__all__)
    with pytest.raises(AttributeError, match="no attribute 'brench'"):
        _ = evolution.brench


def test_a_script_needs_no_guard(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from evolution import bench\n"
        "print('began')\n"
        f"result = bench({str(OFFICE)!r}, 'rpp', workers=2, repeats=2, time_limit=1.0)\n"
        "print(result.table())\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=False, timeout=PATIENCE)
    assert done.returncode == 0, done.stderr
    assert done.stdout.count("began") == 1
    assert "2 timeout" in done.stdout


@pytest.mark.usefixtures("fake_robot")
def test_maps_of_one_name_stay_apart(tmp_path):
    """By their names alone the pairs of two maps would be those of one."""
    maps = [replace(load_scenarios(OFFICE)[0], start=Pose(0.8, y)) for y in (2.0, 2.1, 2.2)]
    result = bench(maps, ["rpp", "far=rpp"], workers=1)
    assert [row["map"] for row in result.rows if row["controller"] == "far"] == ["office", "office_2", "office_3"]
    assert [row["pairs"] for row in result.table("pairs")] == [3]


def test_tasks_and_people_that_a_shell_finds_beside_maps_are_no_maps(tmp_path):
    for file in OFFICE.parent.glob("office*.*"):
        shutil.copy(file, tmp_path)
    walk = "{waypoints: [[4, 1], [4, 6]], speed: 0.8}"
    (tmp_path / "office_people.yaml").write_text(f"- motion: {{name: scripted, options: {walk}}}\n")
    found = [str(path) for path in sorted(tmp_path.glob("*.yaml"))]
    assert len(found) == 3
    (one,) = listed(found)
    assert (one.name, len(one.bodies)) == ("office", 1)
    with pytest.raises(MapFormatError, match="expected the keys of a map_server file"):
        listed(str(tmp_path / "office_poses.yaml"))


@pytest.mark.usefixtures("fake_robot")
def test_a_map_that_is_given_twice_runs_and_counts_once(tmp_path, caplog):
    for file in OFFICE.parent.glob("office*.*"):
        shutil.copy(file, tmp_path)
    maps = [OFFICE, OFFICE.with_name("hall.yaml"), OFFICE, tmp_path / "office.yaml"]
    result = bench(maps, ["rpp", "far=rpp"], workers=1)
    assert [row["map"] for row in result.rows if row["controller"] == "far"] == ["office", "hall"]
    warning = "left out, as the same map and task is given before: office_2 (office) and 1 more"
    assert [record.getMessage() for record in caplog.records] == [warning]
    sides = [configuration_of(name, "fair", ["rpp"]) for name in ("a", "b")]
    assert len(compare(maps, sides, workers=1).rows) == 4
    assert [one.name for one in listed(maps)] == ["office", "hall"]  # else a copy could be held out of a training
    slow = OFFICE.with_name("slow.mapset.json")
    plan, _ = tuning_of("rpp", maps, [slow, slow], None, None, None, {}, TuneSettings())
    assert (len(plan.train), len(plan.test)) == (2, 3)


@given(names=st.lists(st.sampled_from(["a", "a_2", "a_3", "b"]), max_size=8))
def test_different_names_are_kept_and_the_same_are_numbered(names):
    empty = GridMap(np.zeros((3, 3), np.bool_))
    scenarios = [Scenario(empty, Pose(0.01, 0.01), Pose(0.02, 0.02), name) for name in names]
    found = [one.name for one in numbered(scenarios)]
    assert len(set(found)) == len(names)
    assert [name for name in found if name in names] == list(dict.fromkeys(names))
    assert all(new == name or new.startswith(f"{name}_") for new, name in zip(found, names, strict=True))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"robot": "jackal"}, "robot: expected nothing beside settings, which hold it, got 'jackal'"),
        ({"params": "fair"}, "params: expected nothing beside settings, which hold it, got 'fair'"),
        ({"nonsense": 3}, "nonsense: expected nothing beside settings, which hold it, got 3"),
    ],
)
def test_a_world_in_one_value_stands_alone(options, message):
    with pytest.raises(ConfigError, match=message):
        bench(OFFICE, ["rpp"], settings=world_of(None), **options)


def test_other_functions_refuse_a_second_world_too(tmp_path):
    world = world_of(None)
    with pytest.raises(ConfigError, match="noise: expected nothing beside settings"):
        minimize(OFFICE, "order", ["rpp", "dwb"], out=tmp_path / "m", settings=world, noise="rough")
    with pytest.raises(ConfigError, match="robot: expected nothing beside settings"):
        tune("rpp", OFFICE, OFFICE, out=tmp_path / "t", settings=world, robot="jackal")


@pytest.mark.parametrize("maps", ["barn:nowhere", load_scenarios(OFFICE)[0]])
def test_maps_with_a_task_of_their_own_take_no_other(maps):
    with pytest.raises(ConfigError, match=r"goal: expected none for .* which have their own"):
        bench(maps, ["rpp"], goal=(1.0, 1.0, 0.0))


def test_a_benchmark_is_not_continued_with_another_model_in_the_same_file(tmp_path):
    model, scenarios = tmp_path / "model.zip", load_scenarios(OFFICE)

    def begin(resume):
        plan = JobPlan((ControllerSpec(name="learned", kind=str(model)),), world_of(None))
        begin_benchmark(tmp_path / "bench", benchmark_document(scenarios, plan), resume=resume)

    model.write_bytes(b"first")
    begin(resume=False)
    with allow_code():
        begin(resume=True)
        model.write_bytes(b"second")
        with pytest.raises(ConfigError, match=r"controllers\.learned\.model was \w+ when the benchmark began"):
            begin(resume=True)
