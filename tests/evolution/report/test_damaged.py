"""Damaged directories: whatever is wrong with a file, the rest is reported, with a line about it and what to do."""

from __future__ import annotations

import json
import shutil

import pytest

from evolution.cli import main
from evolution.report.writing import write_report
from evolution.runs.loading import load_run
from evolution.studies import load_results, run_study
from evolution.studies.analysis.comparisons import analyse
from evolution.studies.analysis.figures import drive_best_sets
from evolution.studies.analysis.tables import write_tables
from evolution.studies.directory import RESOLVED, STUDY
from gym_mapbench.errors import MapBenchError, RunError
from tests.evolution.fake_study import small_study
from tests.evolution.studies.test_study import lasting_files

pytestmark = pytest.mark.usefixtures("fake_driving")

RUN = "gini_6, seed 0"
AGAIN = " --resume"


def without(*path):
    """Remove a key, e.g. ``without("maps", 0, "runs")``."""

    def damage(document):
        inner = document
        for key in path[:-1]:
            inner = inner[key]
        del inner[path[-1]]
        return document

    return damage


def with_value(value, *path):
    """Set a key to something else."""

    def damage(document):
        inner = document
        for key in path[:-1]:
            inner = inner[key]
        inner[path[-1]] = value
        return document

    return damage


def spoil(path, damage):
    """Change a JSON document, or put a text in place of a file; None removes it."""
    if damage is None:
        path.unlink()
    elif callable(damage):
        path.write_text(json.dumps(damage(json.loads(path.read_text()))))
    else:
        path.write_text(damage)


def first_lines(path, number):
    return "".join(path.read_text().splitlines(keepends=True)[:number])


PAIR = small_study(configurations=small_study().model_dump(mode="json")["configurations"][:2])


@pytest.fixture(scope="module")
def pair_path(tmp_path_factory):
    """Directory of a finished study of two configurations; not to be changed."""
    path = tmp_path_factory.mktemp("pair") / "s"
    run_study(PAIR, path)
    return path


@pytest.fixture
def pair(pair_path, tmp_path):
    """A copy of the small study that a test may spoil."""
    return shutil.copytree(pair_path, tmp_path / "s")


@pytest.fixture
def study(study_path, tmp_path):
    """A copy of the whole study that a test may spoil."""
    return shutil.copytree(study_path, tmp_path / "s")


def about(results, who):
    return [line for line in results.missing if line.startswith(f"{who}: ")]


OF_A_RUN = [
    ("generations.csv", "", "expected 4 generations, got 0"),
    ("generations.csv", "generation,evaluations,best\n", "expected 4 generations, got 0"),
    ("generations.csv", "generation,evaluations\n1,6\n", "line 1: best: is missing"),
    ("generations.csv", None, "cannot be read"),
    ("best_results.json", "{}", "map_set: is missing"),
    ("best_results.json", without("map_set"), "map_set: is missing"),
    ("best_results.json", without("fitness"), "fitness: is missing"),
    ("best_results.json", with_value(None, "fitness"), "fitness: should be a valid number"),
    ("best_results.json", with_value([], "maps"), "expected results of 3 maps, got 0"),
    ("best_results.json", without("maps", 0, "runs", "rpp"), "map_1: runs: expected dwb, mppi, rpp, got dwb, mppi"),
    ("timing.jsonl", '{"generation": 1, "seconds": 2.0}\n', "line 1: driven: is missing"),
    ("timing.jsonl", "[]\n", "line 1: should be a valid dictionary"),
    ("config.json", without("search"), "search: is missing"),
    ("config.json", without("libraries"), "libraries: is missing"),
    ("config.json", without("search", "shapes", "resolution"), "search.shapes.resolution: is missing"),
    (
        "config.json",
        with_value("ginny", "search", "judging", "fitness"),
        "search.judging.fitness: unknown fitness 'ginny'; did you",
    ),
    ("checkpoint.json", "{}", "generation: is missing"),
    ("checkpoint.json", "[]", "expected a JSON object, got list"),
]
IDS = [f"{name}: {message}" for name, _, message in OF_A_RUN]


@pytest.mark.parametrize(("name", "damage", "message"), OF_A_RUN, ids=IDS)
def test_a_damaged_run_is_left_out_of_its_study(pair, name, damage, message):
    path = pair / "runs" / "gini_6" / "seed-0000"
    spoil(path / name, damage)
    results = load_results(pair)
    (line,) = about(results, RUN)
    assert line.startswith(f"{RUN}: {path / name}: ")
    assert message in line
    assert line.endswith(f"; to repeat the run: rm -r {path} and then mapbench study {pair}{AGAIN}")
    assert len(results.runs) == 4 - 1
    write_tables(analyse(results), results.path)


@pytest.mark.parametrize(("name", "damage", "message"), OF_A_RUN, ids=IDS)
def test_a_damaged_run_of_its_own_is_one_line(pair, name, damage, message):
    path = pair / "runs" / "gini_6" / "seed-0000"
    spoil(path / name, damage)
    with pytest.raises(RunError) as caught:
        load_run(path)
    assert str(caught.value).startswith(f"{path / name}: ")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "damage", "message"),
    [
        ("best_map_set.json", None, "cannot be read"),
        ("best_map_set.json", "{", ""),
        ("best_map_set.json", without("maps", 0), "expected the map set of best_results.json"),
        ("best_map_set.json", with_value([-9, 0, 0], "maps", 0, "tasks", 0, "start"), "expected a point on the map"),
        ("runs.csv", None, "cannot be read"),
        ("runs.csv", 40, "expected runs on map"),
        ("runs.csv", 1, "expected runs on map"),
        ("individuals.csv", None, "cannot be read"),
        ("individuals.csv", 3, "expected 4 generations, got 1"),
        ("individuals.csv", "generation,fitness,map_set\n4,1.0,a\n", "line 1: map_1: is missing"),
    ],
)
def test_what_only_some_readers_look_into_is_one_line(pair, name, damage, message):
    whole = load_results(pair)
    best, other = sorted(whole.of("gini_6"), key=lambda run: run.fitness)
    path = best.path
    spoil(path / name, first_lines(path / name, damage) if isinstance(damage, int) else damage)
    with pytest.raises(MapBenchError) as caught:
        load_run(path)
    assert str(caught.value).startswith(f"{path / name}: ")
    assert message in str(caught.value)
    results = load_results(pair)
    (line,) = about(results, f"gini_6, seed {best.seed}")
    assert f": {path / name}: " in line
    assert line.endswith(f"; to repeat the run: rm -r {path} and then mapbench study {pair}{AGAIN}")
    assert [run.seed for run in results.of("gini_6")] == [other.seed]
    assert drive_best_sets(results)[0].run.path == other.path


@pytest.mark.parametrize("damage", [None, b"", b"PK\x03\x04 no archive"])
def test_damaged_maps_are_one_line(pair, damage):
    path = pair / "runs" / "gini_6" / "seed-0000"
    for file in (path / "maps").iterdir():
        file.unlink() if damage is None else file.write_bytes(damage)
    with pytest.raises(RunError, match=r"maps.*: (cannot be read|\d+ of the driven maps are missing)"):
        _ = load_run(path).maps


OF_A_REEVALUATION = [
    (without("maps", 0), "expected results of 3 maps, got 2"),
    (with_value([], "maps"), "expected results of 3 maps, got 0"),
    (without("maps", 1, "runs", "mppi", 0), "map_2: expected 4 runs of mppi, got 3"),
    (without("maps", 0, "runs"), "maps.0.runs: is missing"),
    (with_value(None, "maps", 0, "runs", "dwb", 0, "time_s"), "maps.0.runs.dwb.0.time_s: should be a valid number"),
    (with_value("other", "map_set"), "belongs to another map set than the best one of the run"),
    ("{", "not a JSON file"),
]


@pytest.mark.parametrize(("damage", "message"), OF_A_REEVALUATION, ids=[message for _, message in OF_A_REEVALUATION])
def test_a_damaged_reevaluation_is_said_and_driven_again(pair, pair_path, damage, message):
    path = pair / "reevaluation" / "gini_6" / "seed-0000.json"
    spoil(path, damage)
    results = load_results(pair)
    (line,) = about(results, RUN)
    assert line.startswith(f"{RUN}: {path}: ")
    assert message in line
    assert line.endswith(f"; mapbench study {pair}{AGAIN} repeats it")
    assert results.runs[0].reevaluation is None
    write_tables(analyse(results), results.path)
    again = run_study(PAIR, pair, resume=True)
    assert again.missing == ()
    assert lasting_files(pair / "reevaluation") == lasting_files(pair_path / "reevaluation")


@pytest.mark.parametrize("libraries", [None, [], {"numpy": 2}])
def test_a_study_of_unknown_libraries_is_reported(pair, libraries):
    spoil(pair / STUDY.mark, with_value(libraries, "libraries"))
    results = load_results(pair)
    assert len(results.runs) == 4
    assert results.libraries == {}
    (line,) = results.missing
    assert line.startswith(f"{pair / STUDY.mark}: libraries")
    assert line.endswith("the versions it was run with are unknown")


@pytest.mark.parametrize("text", ["{", '{"cluster": {}}', '{"cluster": {"search": {"pop_size": "6"}, "seeds": [0]}}'])
def test_what_was_taken_can_be_taken_again(study, study_path, text):
    (study / RESOLVED).write_text(text)
    results = load_results(study)
    (line,) = results.missing
    assert line.startswith(str(study / RESOLVED))
    assert line.endswith("; delete it: --resume takes it from the earlier runs again")
    assert len(results.runs) == 14
    with pytest.raises(RunError, match="delete it: --resume takes it from the earlier runs again"):
        run_study(small_study(), study, resume=True)
    (study / RESOLVED).unlink()
    assert run_study(small_study(), study, resume=True).missing == ()
    assert (study / RESOLVED).read_bytes() == (study_path / RESOLVED).read_bytes()


def test_the_advice_about_a_run_repeats_it(study, study_path):
    (study / "runs" / "gini_6" / "seed-0000" / "best_results.json").write_text("{}")
    broken = run_study(small_study(), study, resume=True)
    assert broken.failed == 2 - 1
    assert len(about(broken, RUN)) == 1
    shutil.rmtree(study / "runs" / "gini_6" / "seed-0000")
    assert run_study(small_study(), study, resume=True).missing == ()
    assert lasting_files(study) == lasting_files(study_path)


def test_a_run_of_another_experiment_is_left_out(study):
    runs = study / "runs"
    for source, target in (("gini_12", "gini_6"), ("cellular", "random")):
        shutil.rmtree(runs / target / "seed-0000")
        shutil.copytree(runs / source / "seed-0000", runs / target / "seed-0000")
    shutil.rmtree(runs / "cluster" / "seed-0001")
    shutil.copytree(runs / "cluster" / "seed-0000", runs / "cluster" / "seed-0001")
    results = load_results(study)
    assert "config.json: belongs to another experiment: search.ga.pop_size is 12, expected 6" in about(results, RUN)[0]
    assert "belongs to another experiment: search.seed is 0, expected 1" in about(results, "cluster, seed 1")[0]
    assert len(results.runs) == 14 - 2


def test_who_wrote_it_is_said(pair, blank_figures):
    for path in (pair / STUDY.mark, *(pair / "runs").rglob("config.json")):
        spoil(path, with_value("0.0.1", "version"))
    (line,) = load_results(pair).missing
    assert line.startswith("written by mapbench 0.0.1; read and replayed by mapbench ")
    path = pair / "runs" / "gini_6" / "seed-0000"
    spoil(path / "config.json", with_value("1.0.0", "libraries", "numba"))
    spoil(path / "config.json", with_value("0.0.2", "version"))
    assert "written by mapbench 0.0.2, numba 1.0.0" in about(load_results(pair), RUN)[0]
    assert "written by mapbench 0.0.2, numba 1.0.0" in write_report(path).read_text()


def test_runs_that_ended_in_an_error_are_said(pair):
    def fail(document):
        for run in document["maps"][0]["runs"]["rpp"]:
            run |= {"outcome": "error", "reason": "ValueError: upside down"}
        return document

    spoil(pair / "runs" / "gini_6" / "seed-0000" / "best_results.json", fail)
    spoil(pair / "reevaluation" / "gini_12" / "seed-0001.json", fail)
    results = load_results(pair)
    assert results.missing == (
        f"{RUN}: 1 of 9 runs on the best set in the search ended in an error, the first of rpp: "
        "ValueError: upside down",
        "gini_12, seed 1: 4 of 36 runs on the best set on held-out seeds ended in an error, the first of rpp: "
        "ValueError: upside down",
    )


@pytest.mark.slow
def test_a_page_of_many_damages(study):
    runs = study / "runs"
    spoil(runs / "gini_6" / "seed-0000" / "generations.csv", "")
    spoil(runs / "gini_12" / "seed-0000" / "best_map_set.json", "{")
    spoil(runs / "gini_12" / "seed-0001" / "runs.csv", "")
    spoil(runs / "cluster" / "seed-0000" / "checkpoint.json", "{}")
    spoil(runs / "cluster" / "seed-0001" / "config.json", "{}")
    spoil(study / "reevaluation" / "random" / "seed-0000.json", without("maps", 0))
    spoil(study / STUDY.mark, with_value(None, "libraries"))
    steps = []
    text = write_report(study, study.parent / "page.html", on_step=steps.append).read_text()
    files = ("generations.csv", "best_map_set.json", "runs.csv", "checkpoint.json", "config.json", STUDY.mark)
    for name in (*files, "reevaluation/random/seed-0000.json"):
        assert f"{name}: " in text
    assert steps == ["re-running the best map set of 5 configurations for the replays"]


def test_a_damaged_run_cannot_be_reported_alone(pair, capsys):
    path = pair / "runs" / "gini_6" / "seed-0000"
    spoil(path / "checkpoint.json", "{}")
    assert main(["report", str(path)]) == 2
    error = capsys.readouterr().err
    assert error.startswith(f"mapbench report: {path / 'checkpoint.json'}: generation: is missing; delete it: --resume")
    assert error.count("\n") == 1
