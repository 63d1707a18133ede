"""The results of a study: its finished runs, their tables, and what is missing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from evolution.files import Row, Table, Tabled
from evolution.runs import RecordedExperiment, Reevaluation
from evolution.studies.former_names import StudyRow
from evolution.studies.settings import Configuration, StudySettings


@dataclass(frozen=True)
class StudyRun:
    """One finished run of a study.

    Args:
        configuration: Its configuration.
        seed: Its seed.
        path: Its run directory.
        experiment: The experiment of the run.
        generations: ``generations.csv``.
        best_results: ``best_results.json``: the best set and its fitness in the search.
        timing: ``timing.jsonl``.
        reevaluation: The best set on held-out seeds; None if it was not re-evaluated.
    """

    configuration: Configuration
    seed: int
    path: Path
    experiment: RecordedExperiment
    generations: Sequence[Row]
    best_results: Mapping[str, Any]
    timing: Sequence[Row]
    reevaluation: Reevaluation | None = None

    @property
    def held_out(self) -> Reevaluation:
        """The re-evaluation of a run that has one.

        Raises:
            ValueError: If it was not re-evaluated.
        """
        if self.reevaluation is None:
            raise ValueError(f"{self.path}: not re-evaluated")
        return self.reevaluation

    @property
    def fitness(self) -> float:
        """Reported fitness: of the best set, on the seeds of the search."""
        return float(self.best_results["fitness"])

    @property
    def selection_bias(self) -> float:
        """Held-out fitness minus reported fitness (winner's curse); NaN without re-evaluation."""
        return math.nan if self.reevaluation is None else self.reevaluation.fitness_as_searched - self.fitness

    def row(self) -> Row:
        """One line of the study's table of runs."""
        search = self.experiment.search
        held_out = self.reevaluation
        return StudyRow(
            {
                "configuration": self.configuration.name,
                "method": self.configuration.method,
                "seed": self.seed,
                "fitness_kind": search.judging.fitness,
                "cluster_scale": self.best_results["cluster_scale"],
                "pop_size": search.ga.pop_size,
                "evaluations": self.generations[-1]["evaluations"],
                "repeats": search.repeats,
                "fitness": self.fitness,
                "held_out_fitness": math.nan if held_out is None else held_out.fitness,
                "held_out_fitness_as_searched": math.nan if held_out is None else held_out.fitness_as_searched,
                "selection_bias": self.selection_bias,
                "rank_agreement": math.nan if held_out is None else held_out.rank_agreement,
                "success_rate": self.best_results["success_rate"],
                "held_out_success_rate": math.nan if held_out is None else held_out.success_rate,
                "driven": sum(row["driven"] for row in self.timing),
                "seconds": sum(row["seconds"] for row in self.timing),
                "map_set": self.best_results["map_set"],
            }
        )


def reevaluated(runs: Iterable[StudyRun]) -> list[StudyRun]:
    """Return the runs that are re-evaluated."""
    return [run for run in runs if run.reevaluation is not None]


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

    @property
    def reevaluated(self) -> dict[str, list[StudyRun]]:
        """The re-evaluated runs of every configuration that has any."""
        found = {name: reevaluated(runs) for name, runs in self.by_configuration.items()}
        return {name: runs for name, runs in found.items() if runs}

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """Tidy tables: ``runs``, ``reevaluation`` with a row per run of a re-evaluation, and ``generations``."""
        return {
            "runs": lambda: Table(run.row() for run in self.runs),
            "reevaluation": lambda: Table(row for run in self.runs for row in _reevaluation_rows(run)),
            "generations": lambda: Table(row for run in self.runs for row in _generation_rows(run)),
        }

    def rows(self, table: str = "") -> list[Row]:
        """Return a table as a list; argument and errors as for :meth:`table`."""
        return list(self.table(table))


def _reevaluation_rows(run: StudyRun) -> list[Row]:
    """One row for every run of the best set on held-out seeds."""
    if run.reevaluation is None:
        return []
    names = run.experiment.names
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
        for entry, of_map in zip(run.best_results["maps"], run.reevaluation.results, strict=True)
        for name, results in zip(names, of_map, strict=True)
        for repeat, one in enumerate(results)
    ]


def _generation_rows(run: StudyRun) -> list[Row]:
    return [{"configuration": run.configuration.name, "seed": run.seed, **row} for row in run.generations]
