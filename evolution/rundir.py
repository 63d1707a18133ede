"""The directory of one run: plain files that can be read without this package.

Every file is written beside its place and then renamed, so that it is whole at any moment.
Wall-clock values are only in ``timing.jsonl`` and in the result store; all other files are the
same, byte by byte, whenever the same experiment is run.
"""

from __future__ import annotations

import csv
import io
import json
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from evolution.jobs import PACKAGE_VERSION
from evolution.problem import Evaluation
from evolution.records import Record, Row, named, results_document
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
LIBRARIES = ("numpy", "scipy", "numba", "Box2D", "gymnasium", "pymoo")

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
        config = {
            "format": FORMAT,
            "format_version": FORMAT_VERSION,
            "version": PACKAGE_VERSION,
            "libraries": {name: version(name) for name in LIBRARIES},
            **experiment.document(),
        }
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
        config = read_json(path / CONFIG)
        if config.get("format") != FORMAT or config.get("format_version") != FORMAT_VERSION:
            found = f"{config.get('format')} {config.get('format_version')}"
            raise RunError(f"{path / CONFIG}: expected {FORMAT} {FORMAT_VERSION}, got {found}")
        return cls(path, config)

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
        if self.config.get("version") != PACKAGE_VERSION:
            came = self.config.get("version")
            raise RunError(f"{self.path}: written by version {came}; version {PACKAGE_VERSION} cannot continue it")
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


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file in one step: it is either as before or complete.

    Raises:
        RunError: If it cannot be written.
    """
    partial = path.with_name(f".{path.name}.partial")
    try:
        partial.write_bytes(content)
        os.replace(partial, path)
    except OSError as error:
        raise RunError(f"{path}: cannot be written ({error.strerror})") from None


def write_text(path: Path, text: str) -> None:
    """Write a text file in one step."""
    write_bytes(path, text.encode())


def write_json(path: Path, document: Mapping[str, Any]) -> None:
    """Write a JSON file in one step."""
    write_text(path, json.dumps(document, indent=1) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON object.

    Raises:
        RunError: If it is missing or something else.
    """
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise RunError(f"{path}: cannot be read ({' '.join(str(error).split())[:120]})") from None
    if not isinstance(document, dict):
        raise RunError(f"{path}: expected a JSON object, got {type(document).__name__}")
    return document


def csv_of(rows: Sequence[Row]) -> str:
    """Return a table as CSV text; columns in order of their first use, empty where a row has none."""
    columns = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, restval="", lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


TEXT_COLUMN = re.compile(r"map(_\d+|_set)?|best_map_set|controller|outcome|reason")


def read_csv(path: Path) -> list[Row]:
    """Read what :func:`csv_of` wrote: numbers as numbers, None where empty.

    Raises:
        RunError: If the file is missing or holds something else.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            return [{name: _parse(name, text) for name, text in row.items()} for row in csv.DictReader(file)]
    except (OSError, ValueError, TypeError, csv.Error) as error:
        raise RunError(f"{path}: cannot be read ({' '.join(str(error).split())[:120]})") from None


def npz_of(maps: Mapping[str, GridMap]) -> bytes:
    """Return maps as the bytes of a compressed ``.npz`` file; equal maps give equal bytes."""
    content = io.BytesIO()
    np.savez_compressed(content, allow_pickle=False, **{digest: grid.occupancy for digest, grid in maps.items()})
    return content.getvalue()


def _parse(column: str, text: str) -> Any:
    if TEXT_COLUMN.fullmatch(column):
        return text
    if text == "":
        return None
    return int(text) if re.fullmatch(r"-?\d+", text) else float(text)


def read_json_lines(path: Path) -> list[Row]:
    """Read a JSON lines file up to a line that was not written to its end; nothing if there is no file."""
    rows: list[Row] = []
    for line in path.read_text(encoding="utf-8").splitlines() if path.is_file() else []:
        try:
            rows.append(json.loads(line))
        except ValueError:
            break
    return rows


def make_directory(path: Path) -> None:
    """Make a directory and those above it.

    Raises:
        RunError: If it cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RunError(f"{path}: cannot be made ({error.strerror})") from None


def refuse_used(path: Path, mark: str, what: str) -> None:
    """Refuse a path that holds something; hidden files (half-written ones among them) do not count.

    Args:
        path: Where something new is to begin.
        mark: The file by which one that was begun there before is known.
        what: What that is.

    Raises:
        ConfigError: If there is anything.
    """
    if path.exists() and not path.is_dir():
        raise ConfigError(f"{path}: expected a new directory, got a file")
    if (path / mark).exists():
        raise ConfigError(f"{path}: already holds a {what}; continue it with --resume, or choose another directory")
    if path.is_dir() and any(not entry.name.startswith(".") for entry in path.iterdir()):
        raise ConfigError(f"{path}: expected a new or empty directory, got one that holds other files")


def differences(was: Any, now: Any, name: str = "") -> Iterable[tuple[str, Any, Any]]:
    """Name every leaf in which two JSON documents differ, with its two values."""
    if isinstance(was, dict) and isinstance(now, dict):
        for key in {**was, **now}:
            yield from differences(was.get(key), now.get(key), f"{name}.{key}" if name else key)
    elif was != now:
        yield name, was, now
