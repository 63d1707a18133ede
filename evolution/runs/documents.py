"""Models of the files of a run, checked when a file is read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any

from pydantic import ConfigDict, Field, FiniteFloat

from evolution.files import Document, Row, Versions, check, counted
from evolution.search import FitnessName
from gym_mapbench.errors import RunError
from gym_mapbench.metrics.episode import Outcome
from gym_mapbench.quantities import Count

Bounds = Annotated[list[FiniteFloat], Field(min_length=2, max_length=2)]


class ShapeOptions(Document):
    """The option of the maps that is used: the side of a cell, m."""

    resolution: Annotated[FiniteFloat, Field(gt=0)]


class GaOptions(Document):
    """The options of the algorithm that are used."""

    pop_size: Count


class JudgingOptions(Document):
    """The option of judging that is used."""

    fitness: FitnessName


class SearchOptions(Document):
    """The options of a search that are needed to read its files."""

    ga: GaOptions
    judging: JudgingOptions
    evaluations: Count
    maps_per_set: Count
    repeats: Count
    seed: int
    shapes: ShapeOptions
    archive: dict[str, Any] = Field(default_factory=dict)


class Named(Document):
    """Anything with a name."""

    name: str


class RunConfig(Versions):
    """``config.json``."""

    search: SearchOptions
    controllers: Annotated[list[Named], Field(min_length=1)]
    run: dict[str, Any]


class Checkpoint(Document):
    """``checkpoint.json``."""

    generation: Count
    evaluations: Count
    finished: bool
    cluster_scale: FiniteFloat | None


class RecordedRun(Document):
    """One run among the results of a map set: the fields of a :class:`~evolution.driving.jobs.RunResult`."""

    model_config = ConfigDict(extra="forbid")

    seed: int
    outcome: Outcome
    time_s: FiniteFloat
    path_length_m: FiniteFloat
    reason: str
    attempts: int = 1  # earlier versions wrote it
    metrics: dict[str, float]


class MapEntry(Document):
    """One map among the results of a map set."""

    name: str
    map: str
    score: FiniteFloat | None
    values: dict[str, FiniteFloat] | None
    runs: dict[str, list[RecordedRun]]


class HeldOutResults(Document):
    """The held-out fitness of a set: the fields of :class:`~evolution.search.ValidationResult`."""

    seeds: Count
    fitness: FiniteFloat
    interval: Bounds
    fitness_par2: FiniteFloat | None
    order_kept: FiniteFloat
    goals: int
    runs: Count
    goals_interval: Bounds
    candidates: Count


class MapSetResults(Document):
    """``best_results.json``, and every re-evaluation."""

    map_set: str
    fitness: FiniteFloat
    success_rate: FiniteFloat
    cluster_scale: FiniteFloat | None
    maps: list[MapEntry]
    validation: HeldOutResults | None = None


class GenerationRow(Document):
    """A line of ``generations.csv``."""

    generation: int
    evaluations: int
    best: float
    mean: float
    std: float
    mean_success_rate: float


class IndividualRow(Document):
    """A line of ``individuals.csv``; it also has ``map_1``, ``map_2``..."""

    generation: int
    fitness: float
    map_set: str
    map_1: str


class FrontRow(Document):
    """A line of ``front.csv``; it also has the objectives in the search and on held-out seeds."""

    set: int
    map_set: str
    goals: int | None
    runs: int | None
    order_kept: float | None
    remains: int | None


class RunRow(Document):
    """A line of ``runs.csv``; it also has measures."""

    generation: int
    map: str
    controller: str
    seed: int
    outcome: Outcome
    time_s: float
    path_length_m: float
    reason: str


class TimingRow(Document):
    """A line of ``timing.jsonl``."""

    seconds: float
    driven: int


def check_driven(
    rows: Sequence[Row], maps: Collection[str], controllers: Collection[str], repeats: int | None, path: Path
) -> None:
    """Refuse a table of runs that is incomplete.

    Args:
        rows: Its lines.
        maps: Digests of maps that must have been driven; other maps in the table must be complete, too.
        controllers: Names of the controllers that drove.
        repeats: Runs of each controller on each map; None if each map was driven at least once by some controller.
        path: Its file.

    Raises:
        RunError: Naming the first map and controller with another number of runs.
    """
    if repeats is None:
        if missing := set(maps) - {row["map"] for row in rows}:
            raise RunError(f"{path}: expected runs on map {min(missing)}, got none")
        return
    driven = Counter((row["map"], row["controller"]) for row in rows)
    for digest in dict.fromkeys([*maps, *(row["map"] for row in rows)]):
        for name in controllers:
            if (came := driven[digest, name]) != repeats:
                raise RunError(f"{path}: expected {counted(repeats, 'run')} of {name} on map {digest}, got {came}")


def check_results(
    document: Mapping[str, Any], path: Path, controllers: Collection[str], maps: int, repeats: int | None
) -> None:
    """Refuse results of a map set that are incomplete.

    Args:
        document: Content of the file.
        path: The file it was read from.
        controllers: Names of the controllers that drove.
        maps: Number of maps.
        repeats: Runs of each controller on each map; None for any number.

    Raises:
        RunError: Naming the first thing that is missing or wrong.
    """
    check(MapSetResults, document, path)
    if len(document["maps"]) != maps:
        raise RunError(f"{path}: expected results of {counted(maps, 'map')}, got {len(document['maps'])}")
    for entry in document["maps"]:
        for what in ("runs", "values"):
            if entry[what] is not None and set(entry[what]) != set(controllers):
                came = ", ".join(entry[what]) or "none"
                raise RunError(f"{path}: {entry['name']}: {what}: expected {', '.join(controllers)}, got {came}")
        for name, runs in entry["runs"].items():
            if repeats is not None and len(runs) != repeats:
                raise RunError(
                    f"{path}: {entry['name']}: expected {counted(repeats, 'run')} of {name}, got {len(runs)}"
                )
