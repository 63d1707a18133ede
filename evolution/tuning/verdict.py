"""The result of a tuning in sentences: what it brings on the test maps, how certain that is, and what was changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from statistics import fmean, median

import numpy as np

from controllers.nav2_params.values import Value
from evolution.benchmark import pair_rows
from evolution.files import Row
from evolution.statistics import FEWEST_FOR_INTERVAL, bootstrap_interval
from evolution.tuning.plan import TuningPlan
from evolution.tuning.search import Trial
from evolution.tuning.validation import OWN, TUNED, Finalist

BOOTSTRAP_SEED = 0


@dataclass(frozen=True)
class CostDifference:
    """Cost of the tuned values minus cost of the user's own on the test maps, paired by map.

    Args:
        mean: Mean over the maps; negative if the tuned values are better.
        low: Lower end of the 95 % bootstrap interval; None for too few maps.
        high: Upper end.
    """

    mean: float
    low: float | None
    high: float | None

    @property
    def in_words(self) -> str:
        """Whether the tuned values are better, in words."""
        if self.low is None or self.high is None:
            return f"fewer than {FEWEST_FOR_INTERVAL} test maps are too few to say whether the tuned values are better"
        if self.high < 0:
            return "the tuned values are better"
        return "the tuned values are worse" if self.low > 0 else "the tuned values are not shown to be better"


def cost_difference(test: Sequence[Row]) -> CostDifference:
    """Return the paired difference of the first cost over the test maps."""
    costs: dict[str, dict[str, list[float]]] = {OWN: {}, TUNED: {}}
    for row in test:
        costs[row["controller"]].setdefault(row["map"], []).append(row["cost"])
    differences = [fmean(costs[TUNED][name]) - fmean(costs[OWN][name]) for name in costs[OWN]]
    if len(differences) < FEWEST_FOR_INTERVAL:
        return CostDifference(fmean(differences), None, None)
    return CostDifference(fmean(differences), *bootstrap_interval(differences, np.random.default_rng(BOOTSTRAP_SEED)))


def verdict_of(plan: TuningPlan, trials: Sequence[Trial], winner: Finalist, test: Sequence[Row]) -> list[str]:
    """Return the result in sentences."""
    if winner.number == 0:
        first = "No trial beats the own values on held-out seeds, so the parameter file is unchanged."
        return [first, _reached(test, OWN), _searched(plan, trials)]
    found = cost_difference(test)
    interval = "" if found.low is None else f" (95 % interval {found.low:.2f} to {found.high:.2f})"
    first = (
        f"On {len(plan.test)} test maps that the search has not seen, {found.in_words}: the cost "
        f"{plan.settings.objectives[0]} changes by {found.mean:.2f}{interval}."
    )
    return [first, _reached(test, OWN), _reached(test, TUNED), *_paired(test), *_met(winner), _searched(plan, trials)]


def _reached(test: Sequence[Row], name: str) -> str:
    """Return success and median time in words."""
    rows = [row for row in test if row["controller"] == name]
    good = [row["time_s"] for row in rows if row["outcome"] == "goal"]
    times = f", in {median(good):.1f} s in the median" if good else ""
    whose = "The own values reach" if name == OWN else "The tuned values reach"
    return f"{whose} the goal in {len(good)} of {len(rows)} runs ({100 * len(good) / len(rows):.0f} %){times}."


def _paired(test: Sequence[Row]) -> list[str]:
    """Return the paired differences in success and time in words."""
    (pair,) = pair_rows(test, [OWN, TUNED])
    lines = [f"Success changes by {100 * pair['gained']:+.0f} points{_interval(pair, 'gained', 100, 0)}."]
    if pair["both"]:
        side = "faster" if pair["faster s"] >= 0 else "slower"
        lines.append(
            f"In the {pair['both']} pairs in which both reach the goal, the tuned values are "
            f"{abs(pair['faster s']):.1f} s {side} in the mean{_interval(pair, 'faster s', 1, 1)}."
        )
    return lines


def _interval(pair: Row, name: str, factor: float, decimals: int) -> str:
    low, high = pair[f"{name} from"], pair[f"{name} to"]
    if low is None:
        return ""
    ends = f"{factor * low:+.{decimals}f} to {factor * high:+.{decimals}f}"
    return f" (95 % interval {ends}; positive is better)"


def _met(winner: Finalist) -> list[str]:
    """Say so if the winner misses a requirement."""
    return [] if winner.feasible else ["No finalist meets all requirements on held-out seeds."]


def _searched(plan: TuningPlan, trials: Sequence[Trial]) -> str:
    runs, stopped = sum(len(one.rows) for one in trials), sum(one.state == "stopped" for one in trials)
    return (
        f"The search made {len(trials)} trials with {runs} runs on {len(plan.train)} training maps; it stopped "
        f"{stopped} trials early."
    )


def change_sentences(before: Mapping[str, Value], after: Mapping[str, Value]) -> list[str]:
    """Return a sentence for each parameter that differs, numbers with their ratio."""
    return [_change(name, before[name], after[name]) for name in after if after[name] != before[name]]


def _change(name: str, before: Value, after: Value) -> str:
    numbers = [one for one in (before, after) if isinstance(one, int | float) and not isinstance(one, bool)]
    if len(numbers) < 2 or min(numbers) <= 0:
        return f"{name}: {_text(before)} becomes {_text(after)}"
    verb, ratio = ("rises", after / before) if after > before else ("falls", before / after)  # type: ignore[operator]
    return f"{name} {verb} from {before:g} to {after:g}, by a factor of {ratio:.2g}"


def _text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
