from __future__ import annotations

import pytest

from evolution.driving.evaluator import Evaluator
from evolution.driving.store import ResultStore
from evolution.runs import load_run, reached_maps
from evolution.runs.directory import STORE, RunDir
from evolution.runs.loading import read_bodies
from evolution.search import EvolveSettings, Experiment
from evolution.search.loop import evolve
from gym_mapbench.errors import RunError, UntrustedError
from gym_mapbench.world.scenario import Scenario
from tests.evolution.fake_runs import CONTROLLERS, SMALL, WORLD, drive

ROOMY = SMALL.replace(size=120)
SEARCH = EvolveSettings(pop_size=6, evaluations=24, shapes=ROOMY, seed=5, people={"count": 2})


def search(path, workers=1):
    experiment = Experiment(SEARCH, CONTROLLERS, WORLD)
    rundir = RunDir.create(path, experiment)
    with ResultStore(rundir.path / STORE) as results, Evaluator(drive, results, workers=workers) as evaluator:
        return evolve(experiment, evaluator, rundir)


def files_of(path):
    names = ("individuals.csv", "runs.csv", "best_map_set.json", "checkpoint.json", "config.json")
    return {name: (path / name).read_bytes() for name in names} | {
        file.name: file.read_bytes() for file in (path / "maps").iterdir()
    }


def test_the_people_of_a_search_come_back_with_their_maps(tmp_path):
    found = search(tmp_path / "run")
    run = load_run(tmp_path / "run")
    assert run.best.digest == found.best.map_set.digest
    assert [one.bodies for one in run.best] == [one.bodies for one in found.best.map_set]
    assert all(scenario.bodies for scenario in run.best)
    for digest, grid in run.maps.items():
        scenario = run.best[0]
        assert Scenario(grid, scenario.start, scenario.goal, bodies=run.bodies[digest]).world_digest == digest
    assert all(scenario.bodies and scenario.world_digest == scenario.name for scenario in reached_maps(run))


def test_the_same_seed_is_the_same_run_whatever_the_workers(tmp_path):
    search(tmp_path / "one")
    search(tmp_path / "two", workers=2)
    assert files_of(tmp_path / "one") == files_of(tmp_path / "two")


@pytest.mark.parametrize("document", [{"a": 3}, {"a": [3]}, {"a": [{"motion": {"name": "lin"}}]}])
def test_damaged_documents_are_one_clear_line(document):
    with pytest.raises(RunError, match=r"file: expected moving bodies by digest") as caught:
        read_bodies(document, "file")
    assert "\n" not in str(caught.value)


def test_a_document_that_names_code_is_refused():
    with pytest.raises(UntrustedError):
        read_bodies({"a": [{"motion": {"name": "my_module:Motion"}}]}, "file")
