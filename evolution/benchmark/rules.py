"""Rules for a benchmark, such as ``success<0.95`` or ``b.success<a.success``: if a rule holds, the benchmark fails.

The left side is ``MEASURE`` or ``OWNER.MEASURE``, the right side a number or ``OWNER.MEASURE``. An owner is a
controller, or in a comparison of parameter sets the label of a configuration.
"""

from __future__ import annotations

import math
import operator
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean

from evolution.benchmark.scores import value_of
from evolution.files import Row
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.metrics import METRICS, OF_EVERY_RUN

COMPARISONS: dict[str, Callable[[float, float], bool]] = {
    "<=": operator.le,
    ">=": operator.ge,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    ">": operator.gt,
}
RULE = re.compile(r"\s*(?P<left>[^<>!]+?)\s*(?P<sign><=|>=|==|!=|<|>)\s*(?P<limit>\S.*?)\s*")

Measure = Callable[[Sequence[Row]], float | None]


def _share_of_goals(rows: Sequence[Row]) -> float:
    return len(_solved(rows)) / len(rows)


def _mean_of_goals(column: str) -> Measure:
    return lambda rows: _mean(value_of(row, column) for row in _solved(rows))


def _mean_of_all(column: str) -> Measure:
    return lambda rows: _mean(value_of(row, column) for row in rows)


def _count_of(outcome: str) -> Measure:
    return lambda rows: float(sum(row["outcome"] == outcome for row in rows))


MEASURES: dict[str, Measure] = {
    "success": _share_of_goals,
    "time": _mean_of_goals("time_s"),
    "length": _mean_of_goals("path_length_m"),
    "clearance": _mean_of_goals("min_clearance"),
    "recoveries": _mean_of_all("n_recoveries"),
    "collisions": _count_of("collision"),
    "timeouts": _count_of("timeout"),
    "planner_failures": _count_of("planner_failure"),
    "controller_failures": _count_of("controller_failure"),
    "errors": _count_of("error"),
}
"""Measures of a controller over all maps: the share of runs at the goal; means over the runs that reached it, in s and
m; recoveries of a run without an error; and numbers of runs that ended otherwise. Metrics are measures, too: means over
all runs if they are in :data:`~gym_mapbench.metrics.OF_EVERY_RUN`, else like ``time``."""


Owners = Mapping[str, Sequence[Row]]
"""The runs of each controller or configuration by its name."""


@dataclass(frozen=True)
class Rule:
    """A comparison that must hold for no owner.

    Args:
        text: As the user wrote it.
        owners: The controllers or configurations that it is checked for.
        measure: Key of :data:`MEASURES`, or name of a metric.
        sign: Key of :data:`COMPARISONS`.
        limit: The limit of the measure, or the owner and the measure whose value is the limit.
    """

    text: str
    owners: tuple[str, ...]
    measure: str
    sign: str
    limit: float | tuple[str, str]

    def broken_by(self, runs: Owners) -> list[str]:
        """Return a line that names the owners for which it holds, or that have no such value; empty if none."""
        limit = self.limit if isinstance(self.limit, float) else _value(runs[self.limit[0]], self.limit[1])
        if limit is None:
            return [f"{self.text}: {self.text.split(self.sign)[-1].strip()} has no value"]
        values = {name: _value(runs[name], self.measure) for name in self.owners}
        beside = "" if isinstance(self.limit, float) else f", {self.limit[0]} {limit:.4g}"
        bad = [
            f"{name} has no value" if value is None else f"{name} {value:.4g}"
            for name, value in values.items()
            if value is None or COMPARISONS[self.sign](value, limit)
        ]
        return [f"{self.text}: {', '.join(bad)}{beside}"] if bad else []


def _value(rows: Sequence[Row], measure: str) -> float | None:
    mean = _mean_of_all if measure in OF_EVERY_RUN else _mean_of_goals
    return MEASURES.get(measure, mean(measure))(rows)


def read_rule(text: str, owners: Sequence[str], metrics: Sequence[str] = ()) -> Rule:
    """Read ``MEASURE<NUMBER``, ``OWNER.MEASURE<NUMBER`` or ``OWNER.MEASURE<OWNER.MEASURE``.

    Args:
        text: The rule.
        owners: Names of the controllers or configurations.
        metrics: Further metrics, besides the project's own.

    Raises:
        ConfigError: If it is no rule, or there is no such measure or owner.
    """
    found = RULE.fullmatch(text)
    measures = tuple(dict.fromkeys([*MEASURES, *METRICS.built_in, *metrics]))
    limit = None if found is None else _limit(found["limit"], owners, measures)
    if found is None or limit is None:
        raise ConfigError(f"--fail-if: expected a rule like success<0.95 or mppi.time>30, got {text!r}")
    named, measure = _split(found["left"], owners, measures)
    return Rule(text.strip(), named, measure, found["sign"], limit)


def _limit(text: str, owners: Sequence[str], measures: Sequence[str]) -> float | tuple[str, str] | None:
    """Return the right side of a rule: a number, or an owner and a measure; None if it is neither."""
    number = _number(text)
    if number is not None or not any(text.endswith(f".{measure}") for measure in measures):
        return number
    (owner,), measure = _split(text, owners, measures)
    return owner, measure


def _split(left: str, owners: Sequence[str], measures: Sequence[str]) -> tuple[tuple[str, ...], str]:
    """Return the owners that are meant and the measure."""
    owner = max((name for name in owners if left.startswith(f"{name}.")), key=len, default=None)
    measure = left if owner is None else left.removeprefix(f"{owner}.")
    if measure in measures:
        return (tuple(owners) if owner is None else (owner,)), measure
    name, dot, rest = left.rpartition(".")
    if owner is None and dot and rest in measures:
        raise ConfigError(f"--fail-if: {unknown_name('controller or label', name, owners)}")
    raise ConfigError(f"--fail-if: {unknown_name('measure', measure, measures)}")


def _number(text: str) -> float | None:
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None


def broken(rules: Iterable[Rule], runs: Owners) -> list[str]:
    """Return a line for each rule that the runs of some owners break."""
    return [line for rule in rules for line in rule.broken_by(runs)]


def runs_by_controller(rows: Sequence[Row], controllers: Sequence[str]) -> dict[str, list[Row]]:
    """Return the runs of each controller of a benchmark."""
    return {name: [row for row in rows if row["controller"] == name] for name in controllers}


def _solved(rows: Sequence[Row]) -> list[Row]:
    return [row for row in rows if row["outcome"] == "goal"]


def _mean(values: Iterable[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return fmean(known) if known else None
