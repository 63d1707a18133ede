"""Rules for a benchmark, such as ``success<0.95``: if a rule holds for a controller, the benchmark fails."""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from statistics import fmean

from evolution.files import Row
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.metrics import METRICS

COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
}
RULE = re.compile(r"\s*(?P<left>[^<>=!\s]+)\s*(?P<sign><=|>=|==|!=|<|>)\s*(?P<limit>\S+)\s*")

Measure = Callable[[Sequence[Row]], float | None]


def _share_of_goals(rows: Sequence[Row]) -> float:
    return len(_solved(rows)) / len(rows)


def _mean_of_goals(column: str) -> Measure:
    return lambda rows: _mean(row.get(column) for row in _solved(rows))


def _mean_recoveries(rows: Sequence[Row]) -> float | None:
    return _mean(row.get("n_recoveries") for row in rows if row["outcome"] != "error")


def _count_of(outcome: str) -> Measure:
    return lambda rows: float(sum(row["outcome"] == outcome for row in rows))


MEASURES: dict[str, Measure] = {
    "success": _share_of_goals,
    "time": _mean_of_goals("time_s"),
    "length": _mean_of_goals("path_length_m"),
    "clearance": _mean_of_goals("min_clearance"),
    "recoveries": _mean_recoveries,
    "collisions": _count_of("collision"),
    "timeouts": _count_of("timeout"),
    "planner_failures": _count_of("planner_failure"),
    "controller_failures": _count_of("controller_failure"),
    "errors": _count_of("error"),
}
"""Measures of a controller over all maps: the share of runs at the goal; means over the runs that reached it, in s and
m; recoveries a run; and numbers of runs that ended otherwise. Metrics are measures, too: means like ``time``."""


@dataclass(frozen=True)
class Rule:
    """A comparison that must hold for no controller.

    Args:
        text: As the user wrote it.
        controllers: The controllers that it is checked for.
        measure: Key of :data:`MEASURES`, or name of a metric.
        sign: Key of :data:`COMPARISONS`.
        limit: The limit of the measure.
    """

    text: str
    controllers: tuple[str, ...]
    measure: str
    sign: str
    limit: float

    def broken_by(self, rows: Sequence[Row]) -> list[str]:
        """Return a line that names the controllers for which it holds, or that have no such value; empty if none."""
        values = {name: self._value([row for row in rows if row["controller"] == name]) for name in self.controllers}
        bad = [
            f"{name} has no value" if value is None else f"{name} {value:.4g}"
            for name, value in values.items()
            if value is None or COMPARISONS[self.sign](value, self.limit)
        ]
        return [f"{self.text}: {', '.join(bad)}"] if bad else []

    def _value(self, rows: Sequence[Row]) -> float | None:
        return MEASURES.get(self.measure, _mean_of_goals(self.measure))(rows)


def read_rule(text: str, controllers: Sequence[str], metrics: Sequence[str] = ()) -> Rule:
    """Read ``MEASURE<NUMBER`` or ``CONTROLLER.MEASURE<NUMBER``.

    Args:
        text: The rule.
        controllers: Names of the controllers.
        metrics: Further metrics, besides the project's own.

    Raises:
        ConfigError: If it is no rule, or there is no such measure or controller.
    """
    found = RULE.fullmatch(text)
    limit = None if found is None else _number(found["limit"])
    if found is None or limit is None:
        raise ConfigError(f"--fail-if: expected a rule like success<0.95 or mppi.time>30, got {text!r}")
    measures = (*MEASURES, *METRICS.built_in, *metrics)
    named, measure = _split(found["left"], controllers, measures)
    return Rule(text.strip(), named, measure, found["sign"], limit)


def _split(left: str, controllers: Sequence[str], measures: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Return the controllers that are meant and the measure."""
    owner = next((name for name in controllers if left.startswith(f"{name}.")), None)
    measure = left if owner is None else left.removeprefix(f"{owner}.")
    if measure in measures:
        return (tuple(controllers) if owner is None else (owner,)), measure
    name, dot, rest = left.partition(".")
    if owner is None and dot and rest in measures:
        raise ConfigError(f"--fail-if: {unknown_name('controller', name, controllers)}")
    raise ConfigError(f"--fail-if: {unknown_name('measure', measure, measures)}")


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def broken(rules: Iterable[Rule], rows: Sequence[Row]) -> list[str]:
    """Return a line for each rule that a benchmark breaks."""
    return [line for rule in rules for line in rule.broken_by(rows)]


def _solved(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["outcome"] == "goal"]


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return fmean(known) if known else None
