"""The answer of a study in words: what beat what, by how much, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from evolution.statistics import TestResult, bootstrap_interval
from evolution.study.comparisons import BOOTSTRAP_SEED, QUANTITIES, Comparison, by_judge, compare
from evolution.study.results import StudyResults, StudyRun
from evolution.study.tables import repeat_rows

ALPHA = 0.05
NO_PATTERN_LEAD = 1000.0
"""Fitness that only Alg. 2's -1000 explains: fewer than two maps of a set have a value, or two have the same."""


def verdict_of(results: StudyResults) -> list[str]:
    """Return the verdict, a paragraph each; lower fitness is better throughout."""
    if not results.runs:
        return ["No run of this study is finished, so there is nothing to say yet."]
    comparisons = compare(results)
    sentences = []
    for judge, groups in by_judge(results).items():
        mine = [one for one in comparisons if one.judge == judge]
        sentences += _winner(mine[-1])
        sentences += [_population(test, one) for one in mine for test in one.populations]
        again = [run for runs in groups.values() for run in runs if run.fresh is not None]
        if again:
            sentences.append(_curse(judge, again, results.settings.reevaluation.noise))
    return sentences + _repeats(results)


def _winner(comparison: Comparison) -> list[str]:
    """Which configuration is best, against which others that shows, and against which it does not."""
    best, *others = comparison.order
    one, title = comparison.summaries[best], _capital(comparison.title)
    interval = f", 95 % interval {one.ci_low:.2f} to {one.ci_high:.2f}" if one.n > 1 else ""
    figures = f"{one.median:.2f} (mean {one.mean:.2f}{interval}, n = {one.n}; lower is better)"
    if not others:
        return [f"{title}: {best} has a median of {figures}. There is nothing to compare it with."]
    pairs = {name: _pair(comparison, best, name) for name in others}
    shown = {name: _against(comparison, best, name, pairs[name]) for name in others}
    beaten = [text for name, text in shown.items() if pairs[name].p_value < ALPHA]
    equal = [text for name, text in shown.items() if pairs[name].p_value >= ALPHA]
    sentences = [f"{title}: {best} has the best median, {figures}."]
    sentences += [f"{best} beats {_list(beaten)}."] if beaten else []
    sentences += (
        [f"No difference could be shown between {best} and {_list(equal)}.{_too_few(comparison)}"] if equal else []
    )
    return sentences


def _too_few(comparison: Comparison) -> str:
    """Say so where even complete separation would not be significant: 2 in C(n + m, n), times the pairs (Holm)."""
    n, m = max(pair.n for pair in comparison.pairs)
    smallest = 2 / math.comb(n + m, n) * len(comparison.pairs)
    return " With so few runs none could have been shown." if smallest >= ALPHA else ""


def _pair(comparison: Comparison, first: str, second: str) -> TestResult:
    return next(pair for pair in comparison.pairs if set(pair.groups) == {first, second})


def _against(comparison: Comparison, best: str, other: str, pair: TestResult) -> str:
    """How far another is behind the best, with p, effect size and n."""
    better = 1.0 - pair.effect if pair.groups[0] == best else pair.effect
    lead = comparison.summaries[other].median - comparison.summaries[best].median
    behind = "without a pattern in the median" if lead >= NO_PATTERN_LEAD else f"{lead:.2f} behind"
    sizes = f"n = {comparison.summaries[best].n} and {comparison.summaries[other].n}"
    return f"{other} ({behind}, {_p(pair.p_value)}, A12 = {better:.2f}, {sizes})"


def _population(test: TestResult, comparison: Comparison) -> str:
    """Whether the population made a difference (thesis: H = 0.44, p = 0.80)."""
    difference = "made a difference" if test.p_value < ALPHA else "made no difference that could be shown"
    return (
        f"The population size {difference} {QUANTITIES[comparison.quantity]} ({_list(test.groups)}: Kruskal-Wallis "
        f"H = {test.statistic:.2f}, {_p(test.p_value)}, {test.effect_name} = {test.effect:.2f}, "
        f"n = {', '.join(map(str, test.n))})."
    )


def _curse(judge: str, runs: Sequence[StudyRun], noise: object) -> str:
    """How much of what the searches saw was luck."""
    curses = np.array([run.winners_curse for run in runs])
    low, high = bootstrap_interval(curses, np.random.default_rng(BOOTSTRAP_SEED), np.median)
    interval = f"95 % interval {low:.2f} to {high:.2f}, " if len(runs) > 1 else ""
    added = "" if noise is None else f" and {noise if isinstance(noise, str) else 'other'} noise"
    seen = float(np.median([run.fitness for run in runs]))
    kept = [run.fresh.order_kept for run in runs if run.fresh is not None and not np.isnan(run.fresh.order_kept)]
    order = f" The maps of a set kept their order on {100 * np.mean(kept):.0f} % of the fresh seeds." if kept else ""
    return (
        f"Winner's curse ({judge}): the searches saw a median of {seen:.2f}; driven again with fresh seeds{added} "
        f"the same sets are worse by {np.median(curses):.2f} in the median ({interval}n = {len(runs)}).{order}"
    )


def _repeats(results: StudyResults) -> list[str]:
    """What repeated runs bought, where configurations differ in it."""
    rows = [row for row in repeat_rows(results) if row["n"]]
    if len({row["repeats"] for row in rows}) < 2:
        return []
    parts = [
        f"{row['configuration']} with {row['repeats']}: winner's curse {row['winners_curse']:.2f}, "
        f"order kept on {100 * row['order_kept']:.0f} %"
        for row in rows
    ]
    return [f"Repeats of every run in the search ({'; '.join(parts)})."]


def _p(value: float) -> str:
    return "p < 0.001" if value < 0.001 else f"p = {value:.2g}"


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
