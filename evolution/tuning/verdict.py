"""The result of a tuning in sentences: what it brings on the test maps, how certain that is, and what was changed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf, isfinite, isnan
from statistics import fmean, median

from controllers.nav2_params.values import Value
from evolution.benchmark import (
    compare_rows,
    few_maps_in_words,
    groups_of,
    maps_in_words,
    paired_rows,
    place_of,
    place_of_task,
    unit_of,
    units_in_words,
)
from evolution.files import Row, counted
from evolution.statistics import FEWEST_FOR_INTERVAL, mean_interval
from evolution.tuning.plan import TuningPlan
from evolution.tuning.search import Searched, Trial
from evolution.tuning.validation import OWN, TUNED, Finalist

MOST_CHANGES = 5
"""Largest number of changes in words; the table has all."""


@dataclass(frozen=True)
class CostDifference:
    """Cost of the tuned values minus cost of the user's own on the test maps, paired by map and noise.

    Args:
        mean: Mean over the runs; negative if the tuned values are better.
        low: Lower end of the 95 % bootstrap interval; None for too few maps and tasks.
        high: Upper end.
    """

    mean: float
    low: float | None
    high: float | None

    def in_words(self, cost: str) -> str:
        """Return whether the tuned values are better, and the change of the cost, in words."""
        change = f"the mean cost {cost} changes by {self.mean:+.2f}"
        if self.low is None or self.high is None:
            needed = f"it takes {FEWEST_FOR_INTERVAL} test maps or tasks, on which it does not always change alike,"
            return f"{change}; {needed} to tell whether the tuned values are better"
        not_better = "worse" if self.low > 0 else "not shown to be better"
        found = "better" if self.high < 0 else not_better
        return f"the tuned values are {found}: {change} (95 % interval {self.low:.2f} to {self.high:.2f})"


def cost_difference(test: Sequence[Row]) -> CostDifference:
    """Return the paired difference of the first cost over the test maps, or over tasks if the maps are few."""
    own, tuned = ([row for row in test if row["controller"] == name] for name in (OWN, TUNED))
    pairs = [(place_of(a), b["cost"] - a["cost"]) for a, b in paired_rows(own, tuned)]
    unit = unit_of(place for place, _ in pairs)
    mean, groups = fmean(more for _, more in pairs), groups_of(pairs, "task" if unit == "run" else unit)
    low, high = (None if isnan(end) else end for end in mean_interval(groups))
    return CostDifference(mean, low, high)


def verdict_of(plan: TuningPlan, searched: Searched, winner: Finalist, test: Sequence[Row]) -> list[str]:
    """Return the result in sentences."""
    search = _searched(plan, searched.trials)
    if winner.number == 0:
        which = f" in {plan.settings.objectives[0]}" if len(plan.settings.objectives) > 1 else ""
        first = f"No trial beats the own values{which} on held-out seeds, so the parameter file is unchanged."
        return [first, _reached(test, OWN), search]
    found = cost_difference(test).in_words(plan.settings.objectives[0])
    first = f"On {maps_in_words(map(place_of, test), 'test map')} that the search has not seen, {found}."
    changed = _changes(plan.own, winner.values, searched.importances[0])
    compared = [_reached(test, OWN), _reached(test, TUNED), *_paired(test), *few_maps_in_words(test)]
    return [first, *compared, *_met(winner), changed, search]


def _reached(test: Sequence[Row], name: str) -> str:
    """Return success and median time in words."""
    rows = [row for row in test if row["controller"] == name]
    good = [row["time_s"] for row in rows if row["outcome"] == "goal"]
    times = f", in {median(good):.1f} s in the median" if good else ""
    whose = "The own values reach" if name == OWN else "The tuned values reach"
    return (
        f"{whose} the goal in {len(good)} of {counted(len(rows), 'run')} ({100 * len(good) / len(rows):.0f} %){times}."
    )


def _paired(test: Sequence[Row]) -> list[str]:
    """Return the paired comparison of success and time in words."""
    own, tuned = ([row for row in test if row["controller"] == name] for name in (OWN, TUNED))
    found = compare_rows(own, tuned)
    units = units_in_words(found.n, unit_of(map(place_of, own)))
    lines = [
        f"The tuned values reach the goal more often on {found.wins} of {units} and less often on "
        f"{found.losses} (McNemar's exact test: p = {found.p_success:.2g})."
    ]
    if found.both:
        ends = f"95 % interval {found.ratio_low:.2f} to {found.ratio_high:.2f}, "
        interval = ends if isfinite(found.ratio_low) else ""
        pairs = "one pair" if found.both == 1 else f"{found.both} pairs"
        lines.append(
            f"In the {pairs} in which both reach the goal, the tuned values take "
            f"{found.time_ratio:.2f} times as long ({interval}Wilcoxon: p = {found.p_time:.2g})."
        )
    return lines


def _met(winner: Finalist) -> list[str]:
    """Say so if the winner misses a requirement."""
    return [] if winner.feasible else ["No finalist meets all requirements on held-out seeds."]


def _searched(plan: TuningPlan, trials: Sequence[Trial]) -> str:
    runs, stopped = sum(len(one.rows) for one in trials), sum(one.state == "stopped" for one in trials)
    maps = maps_in_words(map(place_of_task, plan.train), "training map")
    return (
        f"The search made {counted(len(trials), 'trial')} with {counted(runs, 'run')} on {maps}; it stopped "
        f"{counted(stopped, 'trial')} early."
    )


def _changes(before: Mapping[str, Value], after: Mapping[str, Value], importances: Mapping[str, float]) -> str:
    """Return the changes of the most important parameters in words; without importances, the largest changes."""
    changed = [name for name in after if after[name] != before[name]]
    factors = {name: _factor(before[name], after[name]) for name in changed}
    shown = sorted(changed, key=lambda name: (-importances.get(name, 0.0), -factors[name]))[:MOST_CHANGES]
    which = f"the {len(shown)} most important" if importances else f"the {len(shown)} largest changes"
    head = counted(len(changed), "parameter changes", "parameters change")
    head += f"; {which}" if len(shown) < len(changed) else ""
    return f"{head}: {'; '.join(_change(name, before[name], after[name]) for name in shown)}."


def _factor(before: Value, after: Value) -> float:
    """Return by which factor a value changes, 1 or more; infinity if it is no positive number."""
    numbers = [float(one) for one in (before, after) if isinstance(one, int | float) and not isinstance(one, bool)]
    return max(numbers) / min(numbers) if len(numbers) == 2 and min(numbers) > 0 else inf


def _change(name: str, before: Value, after: Value) -> str:
    if (factor := _factor(before, after)) == inf:
        return f"{name}: {_text(before)} becomes {_text(after)}"
    verb = "rises" if after > before else "falls"  # type: ignore[operator]
    return f"{name} {verb} from {before:g} to {after:g}, by a factor of {factor:.3g}"


def _text(value: Value) -> str:
    return str(value).lower() if isinstance(value, bool) else str(value)
