"""Reads a run back, with the results of all its maps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, partial
from pathlib import Path
from statistics import median
from typing import Any

from evolution.driving import RESULT_FIELDS, RUN_COLUMNS, RunResult
from evolution.files import Row, Table, Tabled, read_json, read_npz
from evolution.runs.directory import BODIES, CONFIG, MAPS, RunDir, controllers_in
from evolution.runs.front import front_sentence, objectives_in
from evolution.runs.results import GOOD_SET
from evolution.search import Experiment, MapResults, experiment_of
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.generator import ShapeSettings, default_task
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Scenario

MOST_MAP_BYTES = 2_000_000_000
"""All maps of a run together, unpacked; a search of 100 000 maps of 100 x 100 cells takes half of it."""


@dataclass(frozen=True)
class LoadedRun(Tabled):
    """A run read back, finished or not; tables are lists of rows in which numbers are numbers.

    Args:
        path: Its directory.
        config: ``config.json``.
        checkpoint: ``checkpoint.json``.
        generations: ``generations.csv``.
        individuals: ``individuals.csv``.
        runs: ``runs.csv``.
        best: The best map set.
        best_results: ``best_results.json``.
        timing: ``timing.jsonl``; a half-written last line is left out.
        front: ``front.csv``; empty for a search of one objective.
        figures: Directory of its figures, if it is not the one in ``path``.
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
    figures: Path | None = None
    front: list[Row] = field(default_factory=list)

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``best``, and the files ``generations``, ``individuals``, ``runs`` and ``front``.

        ``best`` is the best map set: one row per map, with the controllers' median times, s, and its score.
        """
        files = ("generations", "individuals", "runs", "front")
        return {
            "best": lambda: Table(self._best_rows(), self._best_title()),
            **{name: partial(Table, getattr(self, name)) for name in files},
        }

    def _best_title(self) -> str:
        fitness = self.best_results["fitness"]
        found = f", fitness {fitness:.2f}" if fitness <= 0 else f"; the search found no set {GOOD_SET}"
        return f"Best map set{found}"

    def _best_rows(self) -> list[Row]:
        return [
            {
                "map": entry["name"],
                **{f"{name}, s": _time_or_outcome(entry["runs"][name]) for name in self.controllers},
                "score": entry["score"],
            }
            for entry in self.best_results["maps"]
        ]

    @property
    def finished(self) -> bool:
        """Whether the search is finished."""
        return bool(self.checkpoint["finished"])

    @property
    def controllers(self) -> tuple[str, ...]:
        """Names of the compared controllers, in order."""
        return controllers_in(self.config)

    @cached_property
    def maps(self) -> Mapping[str, GridMap]:
        """All maps of the runs, by digest; read at first use.

        Raises:
            RunError: If a file is damaged, or a map is missing.
        """
        resolution = float(self.config["search"]["shapes"]["resolution"])
        found: dict[str, GridMap] = {}
        for path in sorted((self.path / MAPS).glob("*.npz")):
            left = MOST_MAP_BYTES - sum(grid.occupancy.nbytes for grid in found.values())
            found |= read_npz(path, resolution, left)
        if missing := {row["map"] for row in self.runs} - set(found):
            raise RunError(f"{self.path / MAPS}: {len(missing)} of the driven maps are missing")
        return found

    @cached_property
    def bodies(self) -> Mapping[str, tuple[Body, ...]]:
        """Moving bodies of those maps that have some, by digest; read at first use.

        Raises:
            RunError: If a file is damaged.
        """
        found: dict[str, tuple[Body, ...]] = {}
        for path in sorted((self.path / MAPS).glob(f"*{BODIES}")):
            found |= read_bodies(read_json(path), str(path))
        return found


def read_bodies(document: Mapping[str, Any], where: str) -> dict[str, tuple[Body, ...]]:
    """Return the moving bodies in a document, by the digest of their map.

    Args:
        document: The document.
        where: Beginning of every error message.

    Raises:
        RunError: If it is anything else.
        UntrustedError: If it names code.
    """
    refuse_code(document, where)
    try:
        return {digest: tuple(Body.from_mapping(one, where) for one in of_map) for digest, of_map in document.items()}
    except (ConfigError, TypeError) as error:
        raise RunError(f"{where}: expected moving bodies by digest ({error})") from None


def load_run(path: str | Path) -> LoadedRun:
    """Read the directory of a run; an unfinished one as far as it has come.

    Raises:
        RunError: If it is not a run directory, has no finished generation, or a file of it is missing or damaged.
    """
    rundir = RunDir.open(path)
    checkpoint = rundir.checkpoint
    if checkpoint is None:
        raise RunError(f"{path}: no generation was finished; continue it with --resume")
    individuals = rundir.read_individuals()
    best_results = rundir.read_best_results()
    return LoadedRun(
        rundir.path,
        rundir.config,
        checkpoint,
        rundir.read_generations(),
        individuals,
        rundir.read_runs(individuals),
        rundir.read_best(best_results["map_set"]),
        best_results,
        rundir.read_timing(),
        front=rundir.read_front(),
    )


def front_lines(run: LoadedRun) -> list[str]:
    """Return in words what held-out seeds leave of the Pareto front of a run; nothing for a search of one objective."""
    return front_sentence(run.front, run.individuals, objectives_in(run.front)) if run.front else []


def experiment_in(run: LoadedRun | RunDir) -> Experiment:
    """Return the experiment that a run was begun with, ready to be driven.

    Raises:
        ConfigError: If it cannot be used.
        UntrustedError: If it names code.
    """
    refuse_code(run.config, run.path / CONFIG)
    return experiment_of(run.config, str(run.path / CONFIG))


def driven_maps(run: LoadedRun, until: int | None = None) -> dict[str, MapResults]:
    """Return the results of every driven map by its digest, in order of first use.

    Wall-clock values are not among them: they are not recorded in a run directory.

    Args:
        run: A recorded search.
        until: The last generation to look at; None for all.
    """
    found: dict[str, dict[str, list[RunResult]]] = {}
    for row in run.runs:
        if until is None or row["generation"] <= until:
            found.setdefault(row["map"], {}).setdefault(row["controller"], []).append(_result(row))
    return {digest: tuple(tuple(of_map.get(name, ())) for name in run.controllers) for digest, of_map in found.items()}


def reached_maps(run: LoadedRun) -> list[Scenario]:
    """Return the maps of a recorded search on which a controller reached the goal, with their task, in order of use."""
    shapes = ShapeSettings.from_mapping(run.config["search"]["shapes"], "search.shapes")
    reached = dict.fromkeys(row["map"] for row in run.runs if row["outcome"] == "goal")
    margin = shapes.border + shapes.task_distance
    return [
        Scenario(run.maps[digest], *default_task(run.maps[digest], margin), digest, run.bodies.get(digest, ()))
        for digest in reached
    ]


def _result(row: Mapping[str, Any]) -> RunResult:
    metrics = {name: float(value) for name, value in row.items() if name not in RUN_COLUMNS and value is not None}
    return RunResult(**{name: row[name] for name in RESULT_FIELDS}, metrics=metrics, seed=row["seed"])


def _time_or_outcome(runs: Sequence[Mapping[str, Any]]) -> float | str:
    """Return the median time of one controller's runs to the goal, s, and how many failed; or how they all failed."""
    if not runs:
        return "no run"
    times = [run["time_s"] for run in runs if run["outcome"] == "goal"]
    if not times:
        return str(runs[0]["outcome"])
    failed = len(runs) - len(times)
    return f"{median(times):.2f} ({failed} of {len(runs)} failed)" if failed else median(times)
