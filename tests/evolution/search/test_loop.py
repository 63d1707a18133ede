from __future__ import annotations

import json
import sqlite3
import subprocess
import sys
import textwrap
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

from evolution.driving.evaluator import Evaluator
from evolution.driving.jobs import ControllerSpec, RunResult
from evolution.driving.store import ResultStore
from evolution.files.plain import write_text
from evolution.report.sections import tables_section
from evolution.runs.directory import CHECKPOINT, CONFIG, STORE, TIMING, RunDir
from evolution.runs.loading import load_run
from evolution.search.experiment import Experiment
from evolution.search.loop import evolve
from evolution.search.settings import EvolveSettings
from gym_mapbench.errors import ConfigError, PluginError, RunError
from gym_mapbench.generator import build_genome, interior, is_drivable, sample_map
from gym_mapbench.mapio.map_set_file import read_map_set
from tests.evolution.fake_runs import CONTROLLERS, IN_PROCESS, SMALL, WORLD, drive, never
from tests.evolution.processes import PATIENCE

SEARCH = EvolveSettings(pop_size=8, evaluations=44, shapes=SMALL, seed=5)
EXPERIMENT = Experiment(SEARCH, CONTROLLERS, WORLD)


def with_search(**options):
    return Experiment(SEARCH.replace(**options), CONTROLLERS, WORLD)


def run(path, experiment=EXPERIMENT, workers=1, run_job=drive, store=None, executor=None, **options):
    rundir = RunDir.create(path, experiment)
    return go_on(rundir, experiment, workers, run_job, store, executor, **options)


def go_on(rundir, experiment=EXPERIMENT, workers=1, run_job=drive, store=None, executor=None, on_run=None, **options):
    """Continue a search, with one worker in this process, unless the executor is given."""
    executor = executor or (IN_PROCESS if workers == 1 else "processes")
    with (
        ResultStore(store or rundir.path / STORE) as results,
        Evaluator(run_job, results, workers=workers, executor=executor, on_run=on_run) as evaluator,
    ):
        return evolve(experiment, evaluator, rundir, **options)


def reproducible_files(path):
    volatile = (TIMING, STORE, f"{STORE}-wal", f"{STORE}-shm")
    files = [file for file in Path(path).rglob("*") if file.is_file() and file.name not in volatile]
    return {str(file.relative_to(path)): file.read_bytes() for file in files}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The files of an uninterrupted run."""
    path = tmp_path_factory.mktemp("whole") / "run"
    run(path)
    return reproducible_files(path)


def test_the_same_seed_gives_the_same_files_whatever_the_workers_and_the_store(tmp_path, whole):
    run(tmp_path / "two", workers=2)
    shared = tmp_path / "shared.sqlite"
    run(tmp_path / "other_seed", with_search(seed=6), store=shared)
    run(tmp_path / "shared", store=shared)
    assert len(whole) == 8 + 6
    assert reproducible_files(tmp_path / "two") == whole
    assert reproducible_files(tmp_path / "shared") == whole
    assert reproducible_files(tmp_path / "other_seed") != whole


def test_a_search_improves_and_its_records_agree(tmp_path):
    seen = []
    result = run(tmp_path / "run", on_generation=seen.append)
    loaded = load_run(tmp_path / "run")
    assert [row["evaluations"] for row in loaded.generations] == [8, 16, 24, 32, 40, 44]
    assert [progress.row for progress in seen] == loaded.generations == result.record.generations
    assert sum(progress.driven for progress in seen) == len(loaded.runs)
    best = [row["best"] for row in loaded.generations]
    assert best == sorted(best, reverse=True)
    assert best[-1] < best[0]
    assert best[-1] == min(row["fitness"] for row in loaded.individuals) == result.best.judgement.fitness
    assert loaded.finished
    assert loaded.controllers == ("dwb", "mppi", "rpp")
    assert loaded.best == type(loaded.best)(tuple(loaded.best))
    assert [s.map.digest for s in loaded.best] == [s.map.digest for s in result.best.map_set]
    assert loaded.best.digest == result.best.map_set.digest == loaded.best_results["map_set"]
    assert len({row["map_set"] for row in loaded.individuals}) == 44
    driven = {(row["map"], row["controller"]) for row in loaded.runs}
    used = {row[f"map_{i}"] for row in loaded.individuals for i in (1, 2, 3)}
    assert driven <= {(digest, name) for digest in used for name in loaded.controllers}
    assert {digest for digest, _ in driven} == used
    assert set(loaded.maps) == used
    assert all(grid.digest == digest for digest, grid in loaded.maps.items())


def test_the_directory_reads_without_this_package(tmp_path):
    result = run(tmp_path)
    results = json.loads((tmp_path / "best_results.json").read_text())
    for entry, values, score in zip(
        results["maps"], result.best.judgement.values, result.best.judgement.scores, strict=True
    ):
        times = [entry["runs"][name][0]["time_s"] for name in ("dwb", "mppi", "rpp")]
        assert entry["score"] == score
        assert values is None or tuple(times) == tuple(entry["values"].values()) == values
    rows = json.loads((tmp_path / "best_map_set.json").read_text())["maps"][0]["rows"]
    assert len(rows) == 30
    assert set("".join(rows)) == {"#", "."}
    assert [tasked.name for tasked in read_map_set(tmp_path / "best_map_set.json")] == ["map_1", "map_2", "map_3"]
    with np.load(tmp_path / "maps" / "0001.npz") as maps:
        assert {maps[name].shape for name in maps.files} == {(30, 30)}
        assert {str(maps[name].dtype) for name in maps.files} == {"bool"}
    header, *lines = (tmp_path / "runs.csv").read_text().splitlines()
    assert header.startswith("generation,map,controller,repeat,seed,noise_seed,outcome,time_s,path_length_m,reason")
    assert header.endswith("clearance")
    assert "wall" not in header
    assert len(lines) == len(result.record.runs)


def test_the_global_generator_is_left_alone(tmp_path):
    before = np.random.get_state()  # noqa: NPY002
    run(tmp_path)
    after = np.random.get_state()  # noqa: NPY002
    assert all(np.array_equal(was, now) for was, now in zip(before, after, strict=True))


KILLED = """
import os, signal
from tests.evolution.search.test_loop import EXPERIMENT, RunDir, run
from tests.evolution.fake_runs import drive_slowly

left = int({after!r})

def kill_at(job, result, _):
    global left
    left -= 1
    if left == 0:
        os.kill(os.getpid(), signal.SIGKILL)

if __name__ == "__main__":
    run({path!r}, run_job=drive_slowly, executor="processes", on_run=kill_at)
"""


@pytest.mark.slow
@pytest.mark.parametrize("after", [5, 90, 200])
def test_a_killed_run_resumes_to_the_same_bytes(tmp_path, whole, after):
    script = KILLED.format(path=str(tmp_path / "killed"), after=after)
    code = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], check=False, timeout=PATIENCE).returncode
    assert code == -9
    rundir = RunDir.open(tmp_path / "killed")
    if after == 5:
        assert rundir.checkpoint is None
        with pytest.raises(RunError, match="no generation was finished"):
            load_run(rundir.path)
    else:
        assert not load_run(rundir.path).finished
    seen = []
    go_on(rundir, workers=2, on_generation=seen.append)
    assert sum(p.driven for p in seen) == len(load_run(rundir.path).runs) - after
    assert reproducible_files(tmp_path / "killed") == whole


def test_a_finished_run_resumes_to_itself(tmp_path):
    result = run(tmp_path)
    files = reproducible_files(tmp_path)
    seen = []
    again = go_on(RunDir.open(tmp_path), on_generation=seen.append)
    assert again.best == result.best
    assert all(progress.replayed and progress.driven == 0 for progress in seen)
    assert reproducible_files(tmp_path) == files


def test_a_run_resumes_without_its_store(tmp_path):
    run(tmp_path)
    files = reproducible_files(tmp_path)
    for file in tmp_path.glob(f"{STORE}*"):
        file.unlink()
    go_on(RunDir.open(tmp_path))
    assert reproducible_files(tmp_path) == files


def test_a_replay_that_goes_astray_is_said(tmp_path):
    run(tmp_path)
    checkpoint = json.loads((tmp_path / CHECKPOINT).read_text())
    (tmp_path / CHECKPOINT).write_text(json.dumps({**checkpoint, "best_fitness": -99.0}))
    with pytest.raises(RunError, match=r"generation 6 cannot be repeated \(best_fitness differs\)"):
        go_on(RunDir.open(tmp_path))


def test_only_the_same_experiment_continues(tmp_path):
    rundir = RunDir.create(tmp_path, EXPERIMENT)
    changed = with_search(mutation=SEARCH.ga.mutation.replace(move_distance=3))
    with pytest.raises(ConfigError, match=r"search.ga.mutation.move_distance was 15 when the run began, got 3"):
        go_on(rundir, changed)
    other = Experiment(SEARCH, (*CONTROLLERS[:2], ControllerSpec(name="rl")), WORLD)
    with pytest.raises(ConfigError, match="controllers was"):
        go_on(rundir, other)
    config = json.loads((tmp_path / CONFIG).read_text())
    (tmp_path / CONFIG).write_text(json.dumps({**config, "version": "0.0.0"}))
    with pytest.raises(RunError, match=r"written by version 0.0.0; version \S+ cannot continue it"):
        go_on(RunDir.open(tmp_path))


def test_an_experiment_reads_back_from_its_directory(tmp_path):
    rundir = RunDir.create(tmp_path, EXPERIMENT)
    again = Experiment.from_document(RunDir.open(tmp_path).config, "config.json")
    assert again == EXPERIMENT
    rundir.check_experiment(again)
    with pytest.raises(ConfigError, match=r"config.json: search: unknown key 'pop_sise'; did you mean 'pop_size'\?"):
        Experiment.from_document({**EXPERIMENT.document(), "search": {"pop_sise": 3}}, "config.json")
    with pytest.raises(ConfigError, match=r"config.json: expected the keys search, controllers and run"):
        Experiment.from_document({"search": {}}, "config.json")


def test_cluster_scale_is_calibrated_once_and_written_down(tmp_path):
    result = run(tmp_path, with_search(fitness="cluster"))
    scale = json.loads((tmp_path / CHECKPOINT).read_text())["cluster_scale"]
    assert scale == result.fitness.cluster_scale == load_run(tmp_path).best_results["cluster_scale"]
    first = [row for row in load_run(tmp_path).runs if row["generation"] == 1]
    gaps = []
    for digest in dict.fromkeys(row["map"] for row in first):
        of_map = [row for row in first if row["map"] == digest]
        assert len(of_map) == 3
        times = [row["time_s"] for row in of_map]
        if all(row["outcome"] == "goal" for row in of_map):
            gaps += [abs(a - b) for i, a in enumerate(times) for b in times[i + 1 :]]
    assert scale == pytest.approx(np.median(gaps))


def test_random_search_samples_anew():
    with Evaluator(drive, executor=IN_PROCESS) as evaluator:
        result = evolve(with_search(algorithm="random", repeats=2, staged=False), evaluator)
    maps = [row[f"map_{i}"] for row in result.record.individuals for i in (1, 2, 3)]
    assert len(set(maps)) == len(maps) == 3 * 44
    assert len(result.record.runs) == 3 * 44 * 3 * 2
    assert result.best.judgement.fitness == min(row["fitness"] for row in result.record.individuals)


def test_workers_start_before_the_first_maps_are_drawn(monkeypatch):
    started = []
    monkeypatch.setattr(Evaluator, "get_ready", lambda _: started.append(True))

    def drawn(rng, shapes):
        assert started == [True]
        return sample_map(rng, shapes)

    monkeypatch.setattr("evolution.search.experiment.sample_map", drawn)
    with Evaluator(drive, executor=IN_PROCESS) as evaluator:
        evolve(with_search(evaluations=8), evaluator)


def test_a_search_draws_of_its_families(tmp_path):
    families = ["doors", {"name": "sparse", "options": {"blocks": [1, 3]}}]
    search = with_search(families=families, algorithm="random", evaluations=16)
    result = run(tmp_path / "run", search)
    maps = [one.map.occupancy for best in result.population for one in best.map_set]
    assert all(is_drivable(cells, SMALL, search.run.robot) for cells in maps)
    walls = [max(interior(cells, 1).mean(axis=0).max(), interior(cells, 1).mean(axis=1).max()) for cells in maps]
    assert 0 < sum(wall > 0.6 for wall in walls) < len(maps)
    assert RunDir.open(tmp_path / "run").config["search"]["families"][1] == families[1]
    documented = Experiment.from_document(json.loads(json.dumps(search.document())), "again")
    assert documented == search


def test_a_search_over_families_repeats_itself(tmp_path):
    search = with_search(families=["doors", "u_traps"])
    run(tmp_path / "first", search)
    run(tmp_path / "again", search, workers=2)
    assert reproducible_files(tmp_path / "first") == reproducible_files(tmp_path / "again")
    with pytest.raises(ConfigError, match="families"):
        go_on(RunDir.open(tmp_path / "first"))


MOTIFS = [
    {"name": "gates", "options": {"count": [1, 2], "pitch": [0.2, 0.4], "gap": [0.2, 0.4], "shift": [-0.1, 0.1]}},
    {"name": "dead_ends", "options": {"count": [1, 1], "width": [0.3, 0.5], "depth": [0.2, 0.3]}},
]


def test_a_search_keeps_the_genomes_of_its_maps_and_repeats_itself(tmp_path):
    mutation = {"probability": 1.0, "maps": "one", "adaptive": True, "drivable": True}
    search = with_search(families=MOTIFS, mutation=mutation, elite=True, drive_last=["mppi"])
    result = run(tmp_path / "first", search)
    run(tmp_path / "again", search, workers=2)
    assert reproducible_files(tmp_path / "first") == reproducible_files(tmp_path / "again")
    for one in result.population:
        for scenario in one.map_set:
            assert np.array_equal(build_genome(scenario.genome, SMALL), scenario.map.occupancy)
    loaded = load_run(tmp_path / "first")
    assert [one.genome for one in loaded.best] == [one.genome for one in result.best.map_set]
    written = [json.loads(path.read_text()) for path in sorted((tmp_path / "first" / "maps").glob("*.json"))]
    assert {digest for maps in written for digest in maps} == set(loaded.maps)
    (genes,) = [table for table in tables_section(loaded).tables if table.caption == "The genes of the best maps"]
    assert {row[1] for row in genes.rows} <= {"gates", "dead_ends"}
    assert len(genes.rows) == 3


def test_a_used_directory_is_refused_and_left_alone(tmp_path):
    RunDir.create(tmp_path / "run", EXPERIMENT)
    with pytest.raises(ConfigError, match="already holds a run; continue it with --resume"):
        RunDir.create(tmp_path / "run", EXPERIMENT)
    with pytest.raises(ConfigError, match="expected a new or empty directory, got one that holds other files"):
        RunDir.create(tmp_path, EXPERIMENT)
    (tmp_path / "file").write_text("mine")
    with pytest.raises(ConfigError, match="expected a new directory, got a file"):
        RunDir.create(tmp_path / "file", EXPERIMENT)
    assert (tmp_path / "file").read_text() == "mine"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "run"]
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / ".hidden").touch()
    assert RunDir.create(tmp_path / "empty", EXPERIMENT).checkpoint is None
    with pytest.raises(RunError, match=r"file/run: cannot be made \(Not a directory\)"):
        RunDir.create(tmp_path / "file" / "run", EXPERIMENT)


def test_a_damaged_checkpoint_is_made_again_as_the_error_says(tmp_path):
    run(tmp_path)
    before = (tmp_path / CHECKPOINT).read_bytes()
    (tmp_path / CHECKPOINT).write_text("{")
    with pytest.raises(RunError, match=r"checkpoint.json: not .*; delete it: --resume makes it again from the stored"):
        load_run(tmp_path)
    (tmp_path / CHECKPOINT).unlink()
    go_on(RunDir.open(tmp_path))
    assert (tmp_path / CHECKPOINT).read_bytes() == before


def test_damaged_runs_are_one_clear_line(tmp_path):
    with pytest.raises(RunError, match=r"not a run directory \(no config.json\)"):
        load_run(tmp_path)
    (tmp_path / CONFIG).write_text('{"format": "mapbench-run", "format_version": 9}')
    with pytest.raises(RunError, match="expected mapbench-run 1, got mapbench-run 9"):
        load_run(tmp_path)
    for text in ("{", "[]", "\xff"):
        (tmp_path / CONFIG).write_text(text)
        with pytest.raises(RunError, match=r"config\.json"):
            load_run(tmp_path)
    run(tmp_path / "run")
    with (tmp_path / "run" / TIMING).open("a") as file:
        file.write('{"generation": 7, "sec')
    assert len(load_run(tmp_path / "run").timing) == 6
    (tmp_path / "run" / "generations.csv").unlink()
    with pytest.raises(RunError, match=r"generations.csv: cannot be read"):
        load_run(tmp_path / "run")
    table = tmp_path / "run" / "individuals.csv"
    table.write_text(table.read_text().replace("map_2", "map_9", 1))
    with pytest.raises(RunError, match=r"individuals.csv: line 1: map_2: is missing"):
        load_run(tmp_path / "run")


def test_stores_of_another_kind_are_refused(tmp_path):
    (tmp_path / "text").write_text("this is not a database, but long enough to look like a file with content" * 20)
    with pytest.raises(RunError, match="not a result store"):
        ResultStore(tmp_path / "text")
    with pytest.raises(RunError, match="cannot be opened"):
        ResultStore(tmp_path / "missing" / "store")


@pytest.mark.parametrize("text", ['{"outcome": "goal", "tim', "[1, 2]", '{"outcome": "goal"}', None, "[" * 100_000])
def test_a_store_with_a_broken_row_says_what_to_do(tmp_path, text):
    with ResultStore(tmp_path / "store") as store:
        store._database.execute("INSERT INTO results VALUES ('key', ?)", (text,))
        with pytest.raises(RunError, match=r"store: row 'key': .*; delete the file to repeat all runs$"):
            store.get("key")


def test_what_cannot_be_written_is_one_clear_line(tmp_path):
    with pytest.raises(RunError, match=r"missing/file: cannot be written \(No such file or directory\)"):
        write_text(tmp_path / "missing" / "file", "text")
    with ResultStore(tmp_path / "store") as store:
        store._database.execute("DROP TABLE results")
        with pytest.raises(RunError, match="cannot be written"):
            store.put("key", RunResult("goal", 1.0, 1.0))
        with pytest.raises(RunError, match="cannot be read"):
            store.get("key")
    other = tmp_path / "newer"
    with closing(sqlite3.connect(other)) as database:
        database.execute("PRAGMA user_version = 9")
    with pytest.raises(RunError, match="expected a result store of version 1, got 9"):
        ResultStore(other)


def test_bad_search_options_are_refused():
    for options, message in (
        ({"evaluations": 10}, "evaluations: expected at least pop_size"),
        ({"fitnes": "gini"}, "unknown key 'fitnes'; did you mean 'fitness'"),
        ({"shapes": {"sise": 3}}, r"shapes: unknown key 'sise'; did you mean 'size'"),
        ({"crossover": "two-point"}, "ga.crossover: expected 'pool' or 'position'"),
    ):
        with pytest.raises(ConfigError, match=message):
            EvolveSettings(**options)
    with pytest.raises(ConfigError, match="controllers: expected different names, got 'dwb' twice"):
        Experiment(SEARCH, (CONTROLLERS[0], CONTROLLERS[0]), WORLD)
    with pytest.raises(ConfigError, match="controllers: expected at least one"):
        Experiment(SEARCH, (), WORLD)


ROBUST = {
    "elite": True,
    "elite_seeds": 1,
    "caution": 1.0,
    "runs": 300,
    "evaluations": 10_000,
    "pop_size": 6,
    "validation": {"seeds": 2, "candidates": 6, "held_out_seeds": 3},
    "mutation": {"probability": 1.0, "maps": "one", "adaptive": True},
}


@pytest.fixture(scope="module")
def validated(tmp_path_factory):
    """An uninterrupted run of a search with a validation stage."""
    path = tmp_path_factory.mktemp("validated") / "run"
    return path, run(path, with_search(**ROBUST))


def test_a_search_with_validation_keeps_to_its_runs_and_reports_held_out_fitness(validated):
    path, result = validated
    loaded = load_run(path)
    assert 200 < len(loaded.runs) <= 300
    said = loaded.best_results["validation"]
    assert said["seeds"] == 3
    assert said["runs"] == 3 * 3 * 3
    assert loaded.best_results["fitness"] == said["fitness"] == result.validation.fitness
    assert loaded.best_results["map_set"] == result.best.map_set.digest
    counts = {len(runs) for entry in loaded.best_results["maps"] for runs in entry["runs"].values()}
    assert min(counts) >= 1 + 1 + 2 + 3
    scores = [entry["score"] for entry in loaded.best_results["maps"] if entry["score"] is not None]
    assert scores == sorted(scores)
    of_best = [row for row in loaded.runs if row["map"] == loaded.best_results["maps"][0]["map"]]
    assert {row["repeat"] for row in of_best} == set(range(len(of_best) // 3))


def test_a_search_with_validation_gives_the_same_files_whatever_the_workers_and_the_store(tmp_path, validated):
    path, _ = validated
    run(tmp_path / "two", with_search(**ROBUST), workers=2, store=path / STORE)
    run(tmp_path / "fresh", with_search(**ROBUST), workers=2)
    assert reproducible_files(tmp_path / "two") == reproducible_files(tmp_path / "fresh") == reproducible_files(path)


@pytest.mark.parametrize("runs", [60, 150, 220])
def test_a_search_with_validation_resumes_to_the_same_bytes(tmp_path, validated, runs):
    class StopError(Exception):
        """Somebody pulled the plug."""

    driven = []

    def stop(*run):
        driven.append(run)
        if len(driven) == runs:
            raise StopError

    experiment = with_search(**ROBUST)
    with pytest.raises(StopError):
        run(tmp_path / "run", experiment, on_run=stop)
    for _ in range(2):  # the second time it is finished already
        go_on(RunDir.open(tmp_path / "run"), experiment)
        assert reproducible_files(tmp_path / "run") == reproducible_files(validated[0])


@pytest.mark.slow
def test_every_part_of_the_search_can_be_left_out(tmp_path):
    parts = {"archive": {"elite": False, "elite_seeds": 0}, "elite": {"elite_seeds": 0}}
    parts |= {"stage": {"validation": None}, "stages": {"staged": False}}
    parts |= {"one": {"mutation": {}}, "random": {"algorithm": "random"}}
    digests = set()
    for name, options in parts.items():
        result = run(tmp_path / name, with_search(**{**ROBUST, **options}))
        assert (result.validation is None) == (name == "stage")
        digests.add(result.best.map_set.digest)
    assert len(digests) > 3


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"runs": 100}, r"runs: expected at least 153 \(54 for the first population and 99 for the validation stage\)"),
        ({"elite": False}, "archive.elite_seeds: expected 0 without elite, got 1"),
        ({"validation": {"candidates": 2}}, r"validation.candidates: expected at least maps_per_set \(3\), got 2"),
    ],
)
def test_options_that_cannot_go_together_are_one_line(options, message):
    with pytest.raises(ConfigError, match=message):
        with_search(**{**ROBUST, **options})


def test_a_search_without_solved_maps_has_no_held_out_fitness(tmp_path):
    result = run(tmp_path / "run", with_search(**ROBUST), run_job=never)
    assert result.validation is None
    assert "validation" not in load_run(tmp_path / "run").best_results


def test_a_random_search_ends_where_there_is_nothing_new_to_draw(tmp_path):
    empty = SMALL.model_copy(update={"n_obstacles": (0, 0)})
    result = run(tmp_path, with_search(algorithm="random", shapes=empty, pop_size=4, evaluations=12))
    assert [row["evaluations"] for row in result.record.generations] == [1]
    assert load_run(tmp_path).finished


def test_the_runs_of_the_validation_stage_are_in_the_timing(tmp_path):
    options = {"validation": {"seeds": 2, "candidates": 3, "held_out_seeds": 2}, "evaluations": 8}
    result = run(tmp_path, with_search(**options))
    timing = load_run(tmp_path).timing
    assert [row["generation"] for row in timing] == [1, 1]
    assert sum(row["driven"] for row in timing) == len(result.record.runs)
    go_on(RunDir.open(tmp_path), with_search(**options))
    assert load_run(tmp_path).timing == timing


def test_what_is_no_algorithm_is_told_so(tmp_path):
    name = "tests.evolution.search.faulty_algorithms:nothing"
    experiment = Experiment(EvolveSettings(pop_size=2, evaluations=2, shapes=SMALL, algorithm=name), CONTROLLERS, WORLD)
    with pytest.raises(PluginError, match=f"search algorithm '{name}': expected a GeneticAlgorithm of pymoo, got None"):
        run(tmp_path / "run", experiment)


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("Raises", r"ZeroDivisionError: no parents, faulty_algorithms.py line \d+"),
        ("Exits", r"SystemExit: 0, faulty_algorithms.py line \d+"),
        ("Lists", r"expected a Population of map sets, got \[1.0, 2.0\]"),
        ("Vectors", r"expected a Population of map sets, got Population\("),
        ("Stumbles", r"LookupError: no survivor, faulty_algorithms.py line \d+"),
        ("Forgets", "expected a population of evaluated map sets, got 0 of 0"),
    ],
)
def test_an_algorithm_that_fails_says_so_and_loses_nothing(tmp_path, fault, message):
    name = f"tests.evolution.search.faulty_algorithms:{fault}"
    experiment = Experiment(EvolveSettings(pop_size=2, evaluations=6, shapes=SMALL, algorithm=name), CONTROLLERS, WORLD)
    with pytest.raises(PluginError, match=f"search algorithm '{name}': {message}"):
        run(tmp_path / "run", experiment)
    assert len(load_run(tmp_path / "run").individuals) == 2
