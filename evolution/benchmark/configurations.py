"""Comparison of parameter sets: every configuration runs on every map with the same seeds and noise."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

from evolution.arguments import instance_of
from evolution.benchmark.directory import benchmark_document
from evolution.benchmark.paired import compare_rows, corrected
from evolution.benchmark.runs import BenchResult, bench_row, named_metrics
from evolution.benchmark.scores import score_rows
from evolution.driving import Evaluator, JobPlan
from evolution.files import Row, Table
from gym_mapbench.errors import ArgumentError, ConfigError
from gym_mapbench.world.scenario import Scenario


@dataclass(frozen=True)
class Configuration:
    """A parameter set under comparison.

    Args:
        label: Name in every table; unique.
        plan: Controllers, world, seed and repeats.
        values: In a sweep, the swept values by name.
    """

    label: str
    plan: JobPlan
    values: Mapping[str, float] | None = None


@dataclass(frozen=True)
class ParameterComparison(BenchResult):
    """The runs of several configurations on the same maps.

    Args:
        rows: One row per run, as in a benchmark, with the column ``configuration`` in front.
        parameters: One row per key in which the configurations differ: ``key``, and a value for each label.
        against_first: Whether each configuration is compared with the first only; else all pairs are compared.
        configurations: The configurations; empty if the comparison was read from a file.
        scenarios: The maps; empty if the comparison was read from a file.
        metrics: Further metrics, which the scores of each side have, too.
    """

    rows: tuple[Row, ...]
    parameters: tuple[Row, ...]
    against_first: bool = False
    configurations: tuple[Configuration, ...] = ()
    scenarios: tuple[Scenario, ...] = ()
    metrics: tuple[str, ...] = ()

    @cached_property
    def sides(self) -> dict[str, list[Row]]:
        """The runs of each side, whose name is the column ``controller``.

        A side is a configuration with one controller, or one controller of a configuration (``LABEL.CONTROLLER``).
        """
        found: dict[str, list[Row]] = {}
        for row in self.rows:
            side = self._side(row["configuration"], row["controller"])
            found.setdefault(side, []).append({**row, "controller": side})
        return found

    @cached_property
    def _names(self) -> dict[str, list[str]]:
        """The controllers of each configuration."""
        return {label: _unique(row["controller"] for row in rows) for label, rows in self.by_label.items()}

    def _side(self, label: str, controller: str) -> str:
        """Return the side of a controller: a configuration with a single controller is one side."""
        return label if len(self._names[label]) == 1 else f"{label}.{controller}"

    @cached_property
    def by_label(self) -> dict[str, list[Row]]:
        """The runs of each configuration by its label."""
        return {
            label: [row for row in self.rows if row["configuration"] == label]
            for label in _unique(row["configuration"] for row in self.rows)
        }

    @cached_property
    def pairs(self) -> list[Row]:
        """A row for each two compared sides: the fields of ``PairedComparison`` and p-values corrected by Holm.

        ``p_success_holm`` is corrected over all tests of success, ``p_time_holm`` over all tests of time.
        """
        names = list(self._compared())
        found = [_plain(asdict(compare_rows(self.sides[a], self.sides[b]))) for a, b in names]
        success, time = (corrected([row[key] for row in found]) for key in ("p_success", "p_time"))
        return [
            {"first": a, "second": b, **row, "p_success_holm": of_success, "p_time_holm": of_time}
            for (a, b), row, of_success, of_time in zip(names, found, success, time, strict=True)
        ]

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``configurations`` (scores of each side), ``pairs`` (two sides each), ``maps``, ``parameters`` and ``runs``.

        ``maps`` has goals and mean times of each side, largest differences of two compared sides first; ``parameters``
        has the keys that differ.
        """
        return {
            "configurations": lambda: Table(self._scores()),
            "pairs": lambda: Table(self.pairs),
            "maps": lambda: Table(_map_rows(self.sides, list(self._compared()))),
            "parameters": lambda: Table(self.parameters),
            "runs": lambda: Table(self.rows),
        }

    def to_json(self) -> str:
        """Return one JSON object as text: ``runs``, ``pairs``, ``parameters``, ``against_first``, any ``metrics``."""
        document = {
            "runs": list(self.rows),
            "pairs": self.pairs,
            "parameters": list(self.parameters),
            "against_first": self.against_first,
            **named_metrics(self.metrics),
        }
        return json.dumps(document, indent=1, allow_nan=False) + "\n"

    def _scores(self) -> list[Row]:
        scores = [score_rows(rows, [side], self.metrics)[0] for side, rows in self.sides.items()]
        return [{"configuration": row["controller"], **row} for row in scores]

    def _compared(self) -> Iterable[tuple[str, str]]:
        """Yield the names of two sides each: single controllers with each other, several by their names."""
        labels = list(self.by_label)
        for a, b in combinations(labels, 2):
            if self.against_first and a != labels[0]:
                continue
            ours, theirs = self._names[a], self._names[b]
            if len(ours) == len(theirs) == 1:
                yield a, b
            else:
                yield from ((self._side(a, one), self._side(b, one)) for one in ours if one in theirs)


def run_configurations(
    scenarios: Sequence[Scenario], configurations: Sequence[Configuration], evaluator: Evaluator
) -> tuple[Row, ...]:
    """Return a row for each run, in the order of configurations, maps and controllers."""
    jobs = [(one.label, job) for one in configurations for scenario in scenarios for job in one.plan.jobs(scenario)]
    results = evaluator.run([job for _, job in jobs])
    return tuple(
        {"configuration": label, **bench_row(job, result)} for (label, job), result in zip(jobs, results, strict=True)
    )


def configurations_document(scenarios: Sequence[Scenario], configurations: Sequence[Configuration]) -> dict[str, Any]:
    """Return everything that the results of a comparison depend on."""
    documents = {one.label: benchmark_document(scenarios, one.plan) for one in configurations}
    first = documents[configurations[0].label]
    own = ("controllers", "settings")
    shared = {key: value for key, value in first.items() if key not in own}
    return {**shared, "configurations": {label: {key: one[key] for key in own} for label, one in documents.items()}}


def check_configurations(configurations: Iterable[Configuration]) -> tuple[Configuration, ...]:
    """Return configurations that can be compared.

    Raises:
        ConfigError: If there is none, something else is among them, a label is empty, labels or sides have one name, or
            two have no controller in common.
    """
    if not isinstance(configurations, Iterable):
        raise ConfigError(f"configurations: expected a list of them, got {configurations!r:.80}")
    found = tuple(instance_of(Configuration, "configurations", one) for one in configurations)
    if not found:
        raise ConfigError("configurations: expected at least one, got none")
    _check_labels(found)
    for a, b in combinations(found, 2):
        if max(len(a.plan.names), len(b.plan.names)) > 1 and not {*a.plan.names} & {*b.plan.names}:
            got = f"{a.label} has {', '.join(a.plan.names)}, {b.label} has {', '.join(b.plan.names)}"
            raise ArgumentError("configurations", f"expected a controller in common, or one in each; {got}", "params")
    return found


def _check_labels(configurations: Sequence[Configuration]) -> None:
    """Refuse labels that are none, and labels or sides of one name."""
    labels = [one.label for one in configurations]
    for label in labels:
        if not instance_of(str, "label", label).strip():
            raise ConfigError(f"label: expected a name, got {label!r}")
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        expected = f"expected different labels, got {twice[0]!r} twice; the command takes LABEL=FILE"
        raise ArgumentError("configurations", expected, "params")
    several = {f"{one.label}.{name}" for one in configurations if len(one.plan.names) > 1 for name in one.plan.names}
    for label in labels:
        if label in several:
            got = f"{label!r}, a controller of another file; the command takes LABEL=FILE"
            raise ArgumentError("configurations", f"expected another label than {got}", "params")


def _map_rows(sides: Mapping[str, Sequence[Row]], compared: Sequence[tuple[str, str]]) -> list[Row]:
    """Return goals and mean time of each side on each map, the maps with the largest differences first."""
    names = _unique(row["map"] for rows in sides.values() for row in rows)
    runs = {name: {side: [row for row in rows if row["map"] == name] for side, rows in sides.items()} for name in names}
    differences = {
        name: max((_difference([of_map[a], of_map[b]]) for a, b in compared), default=(0.0, 1.0))
        for name, of_map in runs.items()
    }
    ordered = sorted(names, key=lambda name: differences[name], reverse=True)
    return [{"map": name, **_cells(runs[name])} for name in ordered]


def _cells(runs: Mapping[str, Sequence[Row]]) -> Row:
    cells: Row = {}
    for side, rows in runs.items():
        times = _times(rows)
        cells |= {f"{side} goals": f"{len(times)}/{len(rows)}", f"{side} s": _mean(times)}
    return cells


def _difference(sides: Sequence[Sequence[Row]]) -> tuple[float, float]:
    """Return the largest difference in the share of goals, then the largest ratio of mean times."""
    shares = [len(_times(rows)) / max(len(rows), 1) for rows in sides]
    means = [mean for rows in sides if (mean := _mean(_times(rows)))]
    return max(shares) - min(shares), max(means) / min(means) if means else 1.0


def _times(rows: Sequence[Row]) -> list[float]:
    return [row["time_s"] for row in rows if row["outcome"] == "goal"]


def _mean(values: Sequence[float]) -> float | None:
    return sum(values) / len(values) if values else None


def _plain(row: Row) -> Row:
    return {key: value if math.isfinite(value) else None for key, value in row.items()}


def _unique(names: Iterable[str]) -> list[str]:
    return list(dict.fromkeys(names))
