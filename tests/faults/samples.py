"""Small results of every kind, to be damaged: a run, a study, a sweep and a benchmark, driven with real controllers."""

from __future__ import annotations

from pathlib import Path

from evolution import bench, evolve, study
from evolution.api import compose
from evolution.search import experiment_of
from evolution.studies import StudySettings, SweepSettings

QUICK = {
    "pop_size": 2,
    "evaluations": 4,
    "maps_per_set": 2,
    "shapes": {"size": 60, "task_distance": 8, "cleared_distance": 5, "n_obstacles": [2, 4]},
}
WORLD = {"environment": {"time_limit": 20.0}}
NAMES = ["dwb", "rpp"]


def write_samples(folder: Path, workers: int = 2) -> Path:
    """Drive and write ``run``, ``study``, ``sweep`` and ``bench.json``; returns the folder."""
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
