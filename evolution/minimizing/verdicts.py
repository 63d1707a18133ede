"""Verdicts about the runs on a map that a minimisation keeps."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from evolution.driving import RunResult
from gym_mapbench.errors import ArgumentError, unknown_name

Trial = Mapping[str, RunResult]
"""One run of each controller with the same noise, by the controller's name."""

TOLERANCE = 0.1
"""Default of the largest relative difference from a ratio."""
CLAUSE = re.compile(r"(?P<name>.+) (?P<what>fails|succeeds)")
AND = re.compile(r"(?:(?<=fails)|(?<=succeeds)) and ")
FORMS = "'CONTROLLER fails', 'CONTROLLER succeeds', several of these joined by 'and', 'order' or 'ratio'"


@dataclass(frozen=True)
class Verdict:
    """A statement about one trial; it holds on a map if it holds in every trial.

    Args:
        text: As the user wrote it.
        outcomes: Whether each named controller must reach the goal; for ``order`` and ``ratio`` empty.
        order: The controllers by time, one that fails last.
        ratio: Time of the slowest over that of the fastest controller.
        tolerance: Largest relative difference from ``ratio``.
    """

    text: str
    outcomes: Mapping[str, bool]
    order: tuple[str, ...] = ()
    ratio: float = math.nan
    tolerance: float = TOLERANCE

    def holds(self, trial: Trial) -> bool:
        """Whether it holds in a trial; a run that ended in an error is neither a success nor a failure."""
        if any(result.outcome == "error" for result in trial.values()):
            return False
        if self.text == "order":
            return order_of(trial) == self.order
        if self.text == "ratio":
            return abs(ratio_of(trial) / self.ratio - 1.0) <= self.tolerance
        return all(trial[name].success == wanted for name, wanted in self.outcomes.items())

    def measured_on(self, trials: Sequence[Trial]) -> Verdict:
        """Return the verdict with the order and the median ratio of some trials, those of the original map.

        Raises:
            ConfigError: If the ratio is to be kept and a run fails or takes no time, or the order is and two
                controllers fail or take the same time.
        """
        ratio, order = median(ratio_of(trial) for trial in trials), order_of(trials[0])
        if self.text == "ratio" and not math.isfinite(ratio):
            raise ArgumentError("keep", "ratio: expected a map on which all controllers reach the goal, none in 0 s")
        if self.text == "order" and not order:
            raise ArgumentError(
                "keep", "order: expected a map on which all times differ and at most one controller fails"
            )
        return Verdict(self.text, self.outcomes, order, ratio, self.tolerance)


def read_verdict(text: str, controllers: Sequence[str], tolerance: float = TOLERANCE) -> Verdict:
    """Read a verdict.

    Args:
        text: ``CONTROLLER fails`` or ``CONTROLLER succeeds``, several joined by ``and``; ``order`` or ``ratio``.
        controllers: Names of the controllers.
        tolerance: Largest relative difference from the ratio of the original map.

    Raises:
        ConfigError: If it is something else, or names no controller.
    """
    words = " ".join(text.split())
    if words in ("order", "ratio"):
        if len(controllers) < 2:
            raise ArgumentError("keep", f"{words}: expected at least two controllers, got {', '.join(controllers)}")
        return Verdict(words, {}, tolerance=tolerance)
    outcomes: dict[str, bool] = {}
    for clause in AND.split(words):
        found = CLAUSE.fullmatch(clause)
        if found is None or outcomes.get(found["name"], found["what"] == "succeeds") != (found["what"] == "succeeds"):
            raise ArgumentError("keep", f"expected {FORMS}, got {text!r}")
        if found["name"] not in controllers:
            raise ArgumentError("keep", str(unknown_name("controller", found["name"], controllers)))
        outcomes[found["name"]] = found["what"] == "succeeds"
    return Verdict(words, outcomes)


def order_of(trial: Trial) -> tuple[str, ...]:
    """Return the controllers by time, one that fails last; nothing if two fail or take the same time."""
    times = {name: _time(result) for name, result in trial.items()}
    return tuple(sorted(times, key=times.__getitem__)) if len(set(times.values())) == len(times) else ()


def ratio_of(trial: Trial) -> float:
    """Return the time of the slowest over that of the fastest controller; infinite if one fails or takes no time."""
    times = [_time(result) for result in trial.values()]
    return max(times) / min(times) if math.isfinite(max(times)) and min(times) > 0 else math.inf


def _time(result: RunResult) -> float:
    return result.time_s if result.success else math.inf
