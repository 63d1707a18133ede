"""Benchmark: every controller runs on every scenario; the runs are rows."""

from __future__ import annotations

import json
import math
from abc import abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from evolution.benchmark.paired import WALLS
from evolution.benchmark.scores import pair_rows, score_rows, value_of
from evolution.driving import Evaluator, Job, JobPlan, RunResult
from evolution.files import Row, Table, Tabled, write_text
from evolution.runs import Reevaluation
from gym_mapbench.metrics import OF_BODIES, OF_EVERY_RUN
from gym_mapbench.world.scenario import Scenario

BENCH, BENCH_TABLE = "bench.json", "bench.csv"


class BenchResult(Tabled):
    """The runs of a benchmark or of a comparison, and the files that hold them."""

    @abstractmethod
    def to_json(self) -> str:
        """Return all results as one JSON object as text."""

    @property
    def files(self) -> dict[str, str]:
        """The content of ``bench.json`` and ``bench.csv``, by name."""
        return {BENCH: self.to_json(), BENCH_TABLE: self.table("runs").to_csv()}

    def save(self, directory: Path) -> None:
        """Write ``bench.json`` and ``bench.csv``.

        Raises:
            RunError: If they cannot be written.
        """
        for name, content in self.files.items():
            write_text(directory / name, content)


@dataclass(frozen=True)
class Benchmark(BenchResult):
    """The runs of a benchmark.

    Args:
        rows: One row per run, JSON-able: map, controller, repeat, seed, outcome, time (s), length (m), reason, and
            every measure by name.
        metrics: Further metrics; the summary and the scores of the controllers have them, too.
        reevaluation: The runs as those of one map set, if the maps are the best set of a run and the controllers those
            of that run; else None.
        scenarios: The scenarios; empty if the benchmark was read from a file.
        plan: Controllers, world, seed and repeats; None if the benchmark was read from a file.
        digests: Digests of the maps with start and goal, by name; empty if the file has none.
    """

    rows: tuple[Row, ...]
    metrics: tuple[str, ...] = ()
    reevaluation: Reevaluation | None = None
    scenarios: tuple[Scenario, ...] = ()
    plan: JobPlan | None = None
    digests: Mapping[str, str] = field(default_factory=dict)

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``summary`` (one row per map and controller), ``runs``, ``controllers`` and ``pairs``.

        In ``summary`` measures are means over the runs that reached the goal. ``controllers`` has a row per controller,
        over all maps, and ``pairs`` a row per two controllers, on the same maps; both have intervals.
        """
        names = list(dict.fromkeys(row["controller"] for row in self.rows))
        return {
            "summary": lambda: Table(_summary(rows, self.metrics) for rows in self._groups()),
            "runs": lambda: Table(self.rows),
            "controllers": lambda: Table(score_rows(self.rows, names, self.metrics)),
            "pairs": lambda: Table(pair_rows(self.rows, names)),
        }

    @property
    def failures(self) -> list[str]:
        """Reasons of the runs that did not reach the goal: the first for each map, controller and outcome."""
        found: dict[tuple[str, str, str], str] = {}
        for row in self.rows:
            if row["outcome"] != "goal":
                found.setdefault((row["map"], row["controller"], row["outcome"]), row.get("reason", ""))
        return [f"{name}/{controller}: {reason or outcome}" for (name, controller, outcome), reason in found.items()]

    def to_json(self) -> str:
        """Return one JSON object as text: ``maps``, ``runs``, ``metrics`` and ``map_set`` if there are any."""
        document: Row = {"maps": dict(self.digests), "runs": list(self.rows), **named_metrics(self.metrics)}
        if self.reevaluation is not None:
            fitness = [one.fitness for one in self.reevaluation.trials]
            orders = list(self.reevaluation.ranks_kept)
            document["map_set"] = {"fitness": fitness, "order_kept": orders}
        return json.dumps(document, indent=1, allow_nan=False) + "\n"

    def _groups(self) -> list[list[Row]]:
        """Runs by map and controller."""
        groups: dict[tuple[str, str], list[Row]] = {}
        for row in self.rows:
            groups.setdefault((row["map"], row["controller"]), []).append(row)
        return list(groups.values())


def bench(scenarios: Sequence[Scenario], plan: JobPlan, evaluator: Evaluator) -> Benchmark:
    """Return the runs of every controller on every scenario, in the order of scenarios and controllers."""
    jobs = [job for scenario in scenarios for job in plan.jobs(scenario)]
    return Benchmark(
        tuple(bench_row(job, result) for job, result in zip(jobs, evaluator.run(jobs), strict=True)),
        plan.metrics,
        scenarios=tuple(scenarios),
        plan=plan,
        digests={scenario.name: scenario.digest for scenario in scenarios},
    )


def bench_row(job: Job, result: RunResult) -> Row:
    """Return all fields of a run, JSON-able; a measure that is not a number, or measures nothing here, is None."""
    measures = {**result.metrics, **result.timings}
    nothing = frozenset[str]() if job.scenario.bodies else OF_BODIES
    return {
        "map": job.scenario.name,
        "controller": job.controller.name,
        "repeat": job.repeat,
        "seed": result.seed,
        "outcome": result.outcome,
        "time_s": result.time_s,
        "path_length_m": result.path_length_m,
        "reason": result.reason,
        WALLS: job.scenario.map.digest,
        **{
            name: value if math.isfinite(value) and name not in nothing else None
            for name, value in measures.items()
            if name != "time"
        },
    }


def named_metrics(names: Sequence[str]) -> Row:
    """Return the key ``metrics`` of ``bench.json``, the metrics that tables show; nothing without any."""
    return {"metrics": list(names)} if names else {}


def _summary(rows: Sequence[Row], metrics: Sequence[str]) -> Row:
    """Return goals, times and measures of one controller on one map, and the outcomes of the other runs."""
    good = [row for row in rows if row["outcome"] == "goal"]
    times = [row["time_s"] for row in good]
    others = Counter(row["outcome"] for row in rows if row["outcome"] != "goal")
    return {
        "map": rows[0]["map"],
        "controller": rows[0]["controller"],
        "goals": f"{len(good)}/{len(rows)}",
        "mean s": _mean(times),
        "min s": min(times, default=None),
        "max s": max(times, default=None),
        "length m": _mean([row.get("path_length_m") for row in good]),
        "clearance m": _mean([row.get("min_clearance") for row in good]),
        "recoveries": _mean([value_of(row, "n_recoveries") for row in rows]),
        **{name: _mean([value_of(row, name) for row in (rows if name in OF_EVERY_RUN else good)]) for name in metrics},
        "otherwise": ", ".join(f"{count} {outcome}" for outcome, count in others.items()),
    }


def _mean(values: Sequence[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return float(np.mean(known)) if known else None
