"""Small results of every kind, to be damaged: a run, a study, a sweep and a benchmark with real controllers."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from evolution import bench, evolve, study
from evolution.api import compose
from evolution.search import experiment_of
from evolution.studies import StudySettings, SweepSettings
from evolution.training import TrainingDir, train_settings
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from tests.mapio import fuzz

QUICK = {
    "pop_size": 2,
    "evaluations": 4,
    "maps_per_set": 2,
    "shapes": {"size": 60, "task_distance": 8, "cleared_distance": 5, "n_obstacles": [2, 4]},
}
WORLD = {"environment": {"time_limit": 20.0}}
NAMES = ["dwb", "rpp"]


def write_samples(folder: Path, workers: int = 2) -> Path:
    """Write ``maps`` and ``training``, drive and write ``run``, ``study``, ``sweep`` and ``bench.json``.

    Returns:
        The folder.
    """
    if not (folder / "maps").is_dir():
        (folder / "maps").mkdir(parents=True)
        fuzz.write_samples(folder / "maps")
    if not (folder / "training").is_dir():
        write_training(folder / "training")
    if not (folder / "run").is_dir():
        document = compose("thesis", {"search": QUICK, "controllers": NAMES, "run": WORLD})
        evolve(experiment_of(document), out=folder / "run", workers=workers)
    if not (folder / "study").is_dir():
        study(small_study(), out=folder / "study", workers=workers)
    if not (folder / "sweep").is_dir():
        study(small_sweep(), out=folder / "sweep", workers=workers)
    if not (folder / "bench.json").is_file():
        bench(folder / "run", NAMES, workers=workers).save(folder)
    return folder


def write_training(path: Path) -> None:
    """Write the directory of a training that has learned nothing yet."""
    maps = [draw_scenario(EnvConfig(shapes={"n_obstacles": (0, 3)}), np.random.default_rng(5)) for _ in range(2)]
    directory = TrainingDir.create(path, train_settings("ppo"), maps, maps)
    directory.write_state({"steps": 64, "seconds": 1.5, "best": 0.5, "finished": False})
    directory.write_curve([{"steps": 64, "seconds": 1.5, "success": 0.5, "success_in_training": None}])


def small_study() -> StudySettings:
    """A search and a baseline with one seed."""
    search = {name: value for name, value in QUICK.items() if name != "evaluations"}
    return StudySettings(
        name="small",
        runs=1,
        budget=2,
        experiment={"search": search, "controllers": NAMES, "run": WORLD},
        configurations=({"name": "ga"}, {"name": "best", "method": "best_triple", "of": "ga"}),
        reevaluation={"seeds": 1, "noise": "nominal"},
    )


def small_sweep() -> SweepSettings:
    """One map in two worlds."""
    worlds = {"quiet": {}, "noisy": {"environment": {"noise": "nominal"}}}
    return SweepSettings(name="small", maps=1, controllers=NAMES, run=WORLD, worlds=worlds)
