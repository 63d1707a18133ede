"""The result of a tuning in sentences: what was changed, what it brings on the test maps, and how certain that is."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import median

from controllers.nav2_params.values import Value
from evolution.files import Row
from evolution.tuning.plan import TuningPlan
from evolution.tuning.search import Trial
from evolution.tuning.validation import OWN, TUNED, Finalist


def verdict_of(
    plan: TuningPlan, trials: Sequence[Trial], finalists: Sequence[Finalist], winner: Finalist, test: Sequence[Row]
) -> list[str]:
    """Return the result in sentences."""
    return [_search_sentence(plan, trials), *_test_sentences(plan, winner, test), *_change_sentences(plan, winner)]


def _search_sentence(plan: TuningPlan, trials: Sequence[Trial]) -> str:
    runs, stopped = sum(len(one.rows) for one in trials), sum(one.state == "stopped" for one in trials)
    return (
        f"The search made {len(trials)} trials with {runs} runs on {len(plan.train)} training maps; "
        f"{stopped} trials were stopped early."
    )


def _test_sentences(plan: TuningPlan, winner: Finalist, test: Sequence[Row]) -> list[str]:
    return [f"{name}: {_success(test, name)}" for name in (OWN, TUNED) if winner.number or name == OWN]


def _success(test: Sequence[Row], name: str) -> str:
    rows = [row for row in test if row["controller"] == name]
    good = [row["time_s"] for row in rows if row["outcome"] == "goal"]
    times = f", median {median(good):.1f} s" if good else ""
    return f"{len(good)} of {len(rows)} runs reach the goal{times}."


def _change_sentences(plan: TuningPlan, winner: Finalist) -> list[str]:
    changed = [(name, plan.own[name], value) for name, value in winner.values.items() if value != plan.own[name]]
    return [_change(*one) for one in changed]


def _change(name: str, before: Value, after: Value) -> str:
    return f"{name}: {before} becomes {after}."
