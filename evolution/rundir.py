"""The directory of one run: plain files that can be read without this package.

Every file is written beside its place and then renamed, so that it is whole at any moment.
Wall-clock values are only in ``timing.jsonl`` and in the result store; all other files are the
same, byte by byte, whenever the same experiment is run.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from evolution.files import (
    Row,
    csv_of,
    differences,
    make_directory,
    npz_of,
    read_csv,
    read_json,
    read_json_lines,
    refuse_used,
    write_bytes,
    write_json,
    write_text,
)
from evolution.header import header, read_header, refuse_version
from evolution.problem import Evaluation
from evolution.records import Record, named, results_document
from evolution.settings import Experiment
from gym_mapbench.errors import ConfigError, MapFormatError, RunError
from gym_mapbench.gridmap import GridMap
from gym_mapbench.mapio.bundle import BEST_MAP_SET, bundle_document, read_bundle
from gym_mapbench.mapio.tasked_map import group_scenarios
from gym_mapbench.scenario import MapSet

FORMAT = "mapbench-run"
FORMAT_VERSION = 1
CONFIG, CHECKPOINT, README = "config.json", "checkpoint.json", "README.txt"
GENERATIONS, INDIVIDUALS, RUNS = "generations.csv", "individuals.csv", "runs.csv"
BEST_RESULTS, MAPS, TIMING, STORE = "best_results.json", "maps", "timing.jsonl", "results.sqlite"

README_TEXT = """One run of mapbench. All lengths are m, times s, angles rad; smaller fitness is better.

config.json         all options as used, and the versions they were used with
generations.csv     one line a generation: fitness in the population after selection
individuals.csv     one line an evaluated map set: fitness, its parts, its maps by digest
runs.csv            one line a driven run, at its first use: map, controller, seed, outcome, measures
maps/NNNN.npz       maps first seen in generation NNNN, by digest: boolean arrays [row, col],
                    True where there is a wall, row 0 at the bottom (numpy.load)
best_map_set.json   the best map set so far, as text
best_results.json   its fitness, and every run on it
checkpoint.json     where the search stands
timing.jsonl        wall-clock seconds of each generation
results.sqlite      every result by the key of its run (SQLite, table "results")

All but the last two are the same whenever the same experiment is run.
"""


@dataclass(frozen=True)
class RunDir:
    """The directory of one run; made by :meth:`create` or :meth:`open`.

    Args:
        path: The directory.
        config: What ``config.json`` says.
    """

    path: Path
    config: Mapping[str, Any]

    @classmethod
    def create(cls, path: str | Path, experiment: Experiment) -> RunDir:
        """Make the directory of a new run.

        Raises:
            ConfigError: If there is anything there already; nothing is changed.
            RunError: If it cannot be made.
        """
        path = Path(path)
        refuse_used(path, CONFIG, "run")
        config = {**header(FORMAT, FORMAT_VERSION), **experiment.document()}
        make_directory(path)
        write_json(path / CONFIG, config)
        return cls(path, config)

    @classmethod
    def open(cls, path: str | Path) -> RunDir:
        """Open the directory of a run, finished or not.

        Raises:
            RunError: If it is not a run directory, or of another format.
        """
        path = Path(path)
        if not (path / CONFIG).is_file():
            raise RunError(f"{path}: not a run directory (no {CONFIG})")
        return cls(path, read_header(path / CONFIG, FORMAT, FORMAT_VERSION))

    @property
    def store_path(self) -> Path:
        """Where this run keeps its results, unless it shares a store."""
        return self.path / STORE

    @property
    def checkpoint(self) -> Mapping[str, Any] | None:
        """What ``checkpoint.json`` says, None before the end of the first generation."""
        return read_json(self.path / CHECKPOINT) if (self.path / CHECKPOINT).is_file() else None

    def check_experiment(self, experiment: Experiment) -> None:
        """Refuse to go on with anything but the experiment this directory was made for.

        Raises:
            ConfigError: If an option differs, naming it.
            RunError: If another version of this package wrote the directory.
        """
        refuse_version(self.config, self.path)
        wanted = json.loads(json.dumps(experiment.document()))
        for name, was, now in differences({key: self.config.get(key) for key in wanted}, wanted):
            raise ConfigError(f"{self.path}: {name} was {was!r} when the run began, got {now!r}")

    def write_generation(self, record: Record, best: Evaluation, checkpoint: Mapping[str, Any]) -> None:
        """Write everything known after a generation; the checkpoint last."""
        generation = int(checkpoint["generation"])
        make_directory(self.path / MAPS)
        write_text(self.path / README, README_TEXT)
        write_bytes(self.path / MAPS / f"{generation:04d}.npz", npz_of(record.maps))
        write_text(self.path / GENERATIONS, csv_of(record.generations))
        write_text(self.path / INDIVIDUALS, csv_of(record.individuals))
        write_text(self.path / RUNS, csv_of(list(record.runs.values())))
        write_json(self.path / BEST_MAP_SET, bundle_document(group_scenarios(named(best.map_set))))
        write_json(self.path / BEST_RESULTS, results_document(best, record.plan.names, checkpoint["cluster_scale"]))
        self.write_checkpoint(checkpoint)

    def write_checkpoint(self, checkpoint: Mapping[str, Any]) -> None:
        """Replace the checkpoint."""
        write_json(self.path / CHECKPOINT, checkpoint)

    def append_timing(self, row: Mapping[str, Any]) -> None:
        """Add a line to ``timing.jsonl``."""
        with (self.path / TIMING).open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


@dataclass(frozen=True)
class LoadedRun:
    """A run read back, as far as it has come; tables are lists of rows with numbers as numbers.

    Args:
        path: Its directory.
        config: ``config.json``.
        checkpoint: ``checkpoint.json``.
        generations: ``generations.csv``.
        individuals: ``individuals.csv``.
        runs: ``runs.csv``.
        best: The best map set.
        best_results: ``best_results.json``.
        timing: ``timing.jsonl``; a torn last line is left out.
    """

    path: Path
    config: Mapping[str, Any]
    checkpoint: Mapping[str, Any]
    generations: list[Row]
    individuals: list[Row]
    runs: list[Row]
    best: MapSet
    best_results: Mapping[str, Any]
    timing: list[Row]

    @property
    def finished(self) -> bool:
        """Whether the search came to its end."""
        return bool(self.checkpoint["finished"])

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the compared controllers, in order."""
        return tuple(spec["name"] for spec in self.config["controllers"])

    @cached_property
    def maps(self) -> Mapping[str, GridMap]:
        """All maps that were driven, by digest; read when first asked for."""
        resolution = float(self.config["search"]["shapes"]["resolution"])
        found: dict[str, GridMap] = {}
        for path in sorted((self.path / MAPS).glob("*.npz")):
            with np.load(path) as arrays:
                found.update((digest, GridMap(arrays[digest], resolution)) for digest in arrays.files)
        return found


def load_run(path: str | Path) -> LoadedRun:
    """Read the directory of a run; an unfinished one as far as it has come.

    Raises:
        RunError: If it is not a run directory, has no finished generation, or a file of it is missing or damaged.
    """
    rundir = RunDir.open(path)
    checkpoint = rundir.checkpoint
    if checkpoint is None:
        raise RunError(f"{path}: no generation was finished; continue it with --resume")
    try:
        scenarios = [scenario for tasked in read_bundle(rundir.path / BEST_MAP_SET) for scenario in tasked.scenarios()]
    except MapFormatError as error:
        raise RunError(str(error)) from None
    return LoadedRun(
        rundir.path,
        rundir.config,
        checkpoint,
        read_csv(rundir.path / GENERATIONS),
        read_csv(rundir.path / INDIVIDUALS),
        read_csv(rundir.path / RUNS),
        MapSet(tuple(scenarios)),
        read_json(rundir.path / BEST_RESULTS),
        read_json_lines(rundir.path / TIMING),
    )
