"""The results of a study: its finished runs, their tables, and words for what is missing."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.files import Row, Table, Tabled
from evolution.runs import DrivenAgain
from evolution.search import Experiment
from evolution.studies.settings import Configuration, StudySettings
from gym_mapbench.errors import unknown_name


@dataclass(frozen=True)
class StudyRun:
    """One finished run of a study.

    Args:
        configuration: What was run.
        seed: Its seed.
        path: Its run directory.
        experiment: What it was run with.
        generations: ``generations.csv``.
        seen: ``best_results.json``: the best set as the search saw it.
        timing: ``timing.jsonl``.
        fresh: The best set on fresh seeds; None if it was not re-evaluated.
    """

    configuration: Configuration
    seed: int
    path: Path
    experiment: Experiment
    generations: Sequence[Row]
    seen: Mapping[str, Any]
    timing: Sequence[Row]
    fresh: DrivenAgain | None = None

    @property
    def fitness(self) -> float:
        """Fitness of the best set as the search saw it."""
        return float(self.seen["fitness"])

    @property
    def winners_curse(self) -> float:
        """By how much the fitness on fresh seeds is worse than that the search saw; NaN without re-evaluation."""
        return math.nan if self.fresh is None else self.fresh.fitness_as_searched - self.fitness

    def row(self) -> Row:
        """One line of the study's table of runs."""
        search = self.experiment.search
        fresh = self.fresh
        return {
            "configuration": self.configuration.name,
            "method": self.configuration.method,
            "seed": self.seed,
            "fitness_kind": search.judging.fitness,
            "cluster_scale": self.seen["cluster_scale"],
            "pop_size": search.ga.pop_size,
            "evaluations": self.generations[-1]["evaluations"],
            "repeats": search.repeats,
            "fitness": self.fitness,
            "fresh_fitness": math.nan if fresh is None else fresh.fitness,
            "fresh_fitness_as_searched": math.nan if fresh is None else fresh.fitness_as_searched,
            "winners_curse": self.winners_curse,
            "order_kept": math.nan if fresh is None else fresh.order_kept,
            "success_rate": self.seen["success_rate"],
            "fresh_success_rate": math.nan if fresh is None else fresh.success_rate,
            "driven": sum(row["driven"] for row in self.timing),
            "seconds": sum(row["seconds"] for row in self.timing),
            "map_set": self.seen["map_set"],
        }


@dataclass(frozen=True)
class StudyResults(Tabled):
    """A study as far as it has come.

    Args:
        path: Its directory.
        settings: The study.
        version: Version of this package that wrote it.
        libraries: Versions of the libraries it was run with.
        resolved: By configuration, what it took from earlier ones.
        runs: The finished runs, in order of configurations and seeds.
        missing: What is missing or wrong, one line each.
        failed: Number of runs that failed just now.
    """

    path: Path
    settings: StudySettings
    version: str
    libraries: Mapping[str, str]
    resolved: Mapping[str, Any]
    runs: tuple[StudyRun, ...]
    missing: tuple[str, ...]
    failed: int = 0

    def of(self, configuration: str) -> list[StudyRun]:
        """The finished runs of one configuration, by seed."""
        return [run for run in self.runs if run.configuration.name == configuration]

    @property
    def by_configuration(self) -> dict[str, list[StudyRun]]:
        """The finished runs of every configuration that has any."""
        found = {name: self.of(name) for name in self.settings.names}
        return {name: runs for name, runs in found.items() if runs}

    def rows(self, table: str = "runs") -> list[Row]:
        """Return a tidy table, one observation per row.

        Args:
            table: ``runs``: one row per run; ``reevaluation``: one per run that was driven again; ``generations``: one
                per generation.

        Raises:
            ConfigError: If there is no such table.
        """
        tables = {"runs": _run_rows, "reevaluation": _reevaluation_rows, "generations": _generation_rows}
        if table not in tables:
            raise unknown_name("table", table, tables)
        return [row for run in self.runs for row in tables[table](run)]

    def table(self, name: str = "runs") -> Table:
        """Return a tidy table; see :meth:`rows`."""
        return Table(self.rows(name or "runs"))


def _run_rows(run: StudyRun) -> list[Row]:
    return [run.row()]


def _reevaluation_rows(run: StudyRun) -> list[Row]:
    """One row for every run of the best set on fresh seeds."""
    if run.fresh is None:
        return []
    names = run.experiment.plan.names
    return [
        {
            "configuration": run.configuration.name,
            "seed": run.seed,
            "map": entry["name"],
            "map_digest": entry["map"],
            "controller": name,
            "repeat": repeat,
            "outcome": one.outcome,
            "time_s": one.time_s,
            "path_length_m": one.path_length_m,
            **one.metrics,
        }
        for entry, of_map in zip(run.seen["maps"], run.fresh.results, strict=True)
        for name, results in zip(names, of_map, strict=True)
        for repeat, one in enumerate(results)
    ]


def _generation_rows(run: StudyRun) -> list[Row]:
    return [{"configuration": run.configuration.name, "seed": run.seed, **row} for row in run.generations]
