"""The verdict of a study in words: which configuration is best, by how much, and how certain that is."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from evolution.files import Row
from evolution.statistics import Summary, TestResult, median_interval
from evolution.studies.analysis.comparisons import BOOTSTRAP_SEED, QUANTITIES, Comparison, StudyAnalysis, analyse
from evolution.studies.analysis.held_out import conditions, fresh_rows, order_kept, selected_sets
from evolution.studies.analysis.judges import Judge
from evolution.studies.analysis.reported_fitness import promise_rows
from evolution.studies.analysis.results import StudyResults, StudyRun

ALPHA = 0.05
NO_PATTERN_LEAD = 1000.0
"""A lead that only the -1000 of Alg. 2 explains: the worse set has no pattern."""


def verdict_of(results: StudyResults, analysis: StudyAnalysis | None = None) -> list[str]:
    """Return the paragraphs of the verdict; lower fitness is better throughout.

    Args:
        results: The study.
        analysis: Its comparisons, if they are there already.
    """
    if not results.runs:
        return ["No run of this study is finished, so there is nothing to say yet."]
    analysis = analysis or analyse(results)
    rows = fresh_rows(results)
    sentences = [sentence for judge in analysis.judges for sentence in _of_judge(judge, analysis, rows)]
    return _promises(analysis) + sentences + _repeats(rows)


def _promises(analysis: StudyAnalysis) -> list[str]:
    """Say which configurations are worth more or less on fresh seeds than one that judges sets in another way."""
    rows = {row["configuration"]: row for row in promise_rows(analysis.results)}
    return [
        f"On fresh seeds, lower is better, the sets of {_promised(row)}, those of {_promised(rows[row['against']])}: "
        f"{name} is better in {100 * row['a12']:.0f} % of pairs of runs (A12; {_p(row['p_holm'])})."
        for name, row in rows.items()
        if row["against"]
        and row["p_holm"] < ALPHA
        and not any({name, row["against"]} <= set(judge.groups) for judge in analysis.judges)
    ]


def _promised(row: Row) -> str:
    """Say what the sets of a configuration claimed and are worth."""
    low, high = row["fresh_low"], row["fresh_high"]
    interval = "" if math.isnan(low) else f"95 % interval {low:.2f} to {high:.2f}; "
    return (
        f"{row['configuration']} are worth {row['fresh']:.2f} in the median ({interval}{row['claimed']:.2f} claimed; "
        f"in order in {_percent(row['order'])} of the drives; n = {row['n']})"
    )


def _of_judge(judge: Judge, analysis: StudyAnalysis, rows: Sequence[Row]) -> list[str]:
    """Say everything about the configurations that were judged alike."""
    seen, *fresh = analysis.of(judge)
    again = [run for run in judge.runs if run.fresh is not None]
    compared = fresh[0] if fresh and 2 * len(again) >= len(judge.runs) else seen
    if not judge.comparable:
        return [_other_scales(judge), judge.meaning]
    sentences = _winner(compared) + (_left_out(judge, compared) if again else [])
    sentences += [_population(test, compared) for test in compared.populations]
    sentences += [judge.meaning, *_success([row for row in rows if row["configuration"] in judge.groups])]
    return sentences + _fresh_minus_seen(judge, analysis.results)


def _other_scales(judge: Judge) -> str:
    """Say why nothing is compared."""
    low, high = judge.scales[0], judge.scales[-1]
    return (
        f"{_capital(judge.name)}: not compared. Every run calibrated a cluster scale of its own ({low:.3g} to "
        f"{high:.3g}), so the values of different runs are on different scales ({_list(list(judge.groups))})."
    )


def _winner(comparison: Comparison) -> list[str]:
    """Say which configuration is best, and from which others the difference is significant."""
    best, *others = comparison.order
    title, figures = _capital(comparison.title), _median(comparison.summaries[best])
    if not others:
        return [f"{title}: {best} has a median of {figures}. There is nothing to compare it with."]
    pairs = [pair for pair in comparison.pairs if pair.groups[0] == best]
    beaten = [pair for pair in pairs if pair.p_value < ALPHA]
    equal = [pair for pair in pairs if pair.p_value >= ALPHA]
    hopeless = [pair.groups[1] for pair in equal if _too_few(pair, comparison)]
    nested = [parent for name, parent in comparison.by_construction if name == best]
    sentences = [f"{title}: {best} has the best median, {figures}."]
    if beaten:
        sentences.append(f"{best} beats {_list([_behind(pair, comparison) for pair in beaten])}.")
    if equal:
        shown = _list([_behind(pair, comparison) for pair in equal])
        sentences.append(f"No difference could be shown between {best} and {shown}.")
    if hopeless:
        sentences.append(f"With so few runs no difference from {_list(hopeless)} could have been shown.")
    if nested:
        sentences.append(
            f"{best} chose afterwards among all maps that {_list(nested)} had driven: it cannot be worse as the "
            "search saw it, so the two are not tested against each other."
        )
    return sentences


def _left_out(judge: Judge, compared: Comparison) -> list[str]:
    """Say which runs are not in the comparison on fresh seeds, and what follows from that."""
    absent = {name: sum(run.fresh is None for run in runs) for name, runs in judge.groups.items()}
    named = [f"{name} ({count} of {len(judge.groups[name])} runs)" for name, count in absent.items() if count]
    if not named:
        return []
    if compared.quantity == "fitness":
        return [
            "Fewer than half of the runs were driven on fresh seeds, so this compares what the searches saw. "
            f"Not driven again: {_list(named)}."
        ]
    return [f"Left out, because not driven on fresh seeds yet: {_list(named)}."]


def _median(one: Summary) -> str:
    """Return a median with its interval, mean and number of runs."""
    interval = "" if math.isnan(one.ci_low) else f"95 % interval {one.ci_low:.2f} to {one.ci_high:.2f}, "
    return f"{one.median:.2f} ({interval}mean {one.mean:.2f}, n = {one.n}; lower is better)"


def _too_few(pair: TestResult, comparison: Comparison) -> bool:
    """Whether even completely separated samples give no significant p: 2 / C(n + m, n) times the pairs (Holm)."""
    n, m = pair.n
    return 2 / math.comb(n + m, n) * len(comparison.pairs) >= ALPHA


def _behind(pair: TestResult, comparison: Comparison) -> str:
    """Say how far the second of a pair is behind the first, with effect size, p and n."""
    first, second = pair.groups
    lead = comparison.summaries[second].median - comparison.summaries[first].median
    behind = "no pattern in the median" if lead >= NO_PATTERN_LEAD else f"median {lead:.2f} behind"
    better = f"{first} better in {100 * pair.effect:.0f} % of pairs of runs, A12"
    return f"{second} ({behind}; {better}; {_p(pair.p_value)}; n = {pair.n[0]} and {pair.n[1]})"


def _population(test: TestResult, comparison: Comparison) -> str:
    """Say whether the population size made a difference (thesis: H = 0.44, p = 0.80)."""
    difference = "made a difference" if test.p_value < ALPHA else "made no difference that could be shown"
    return (
        f"The population size {difference} {QUANTITIES[comparison.quantity]} ({_list(test.groups)}: Kruskal-Wallis "
        f"H = {test.statistic:.2f}, {_p(test.p_value)}, {test.effect_name} = {test.effect:.2f}, "
        f"n = {', '.join(map(str, test.n))})."
    )


def _success(rows: Sequence[Row]) -> list[str]:
    """Say how many of the runs on fresh seeds reached the goal."""
    shares = [f"{row['configuration']} {_percent(row['fresh_success_rate'])}" for row in rows]
    return [f"Runs of the best sets that reached the goal on fresh seeds: {_list(shares)}."] if shares else []


def _fresh_minus_seen(judge: Judge, results: StudyResults) -> list[str]:
    """Say how far the fitness on fresh seeds is from the one the searches saw."""
    sets = selected_sets(judge.runs)
    if not sets:
        return []
    differences = np.array([run.winners_curse for run in sets])
    low, high = median_interval(differences, np.random.default_rng(BOOTSTRAP_SEED))
    interval = "" if math.isnan(low) else f"95 % interval {low:+.2f} to {high:+.2f}, "
    seen = float(np.median([run.fitness for run in sets]))
    new = conditions(sets[0], results)
    held = (
        "This holds the luck of the selection (the winner's curse) and the other noise, and does not tell them apart."
        if "noise" in new
        else "This is the luck of the selection (the winner's curse)."
    )
    return [
        f"Fresh minus seen, {judge.name}: the searches saw a median of {seen:.2f} on the sets they selected by driven "
        f"runs; with {new} the difference is {np.median(differences):+.2f} in the median ({interval}"
        f"n = {len(sets)} different sets). {held}{_order(sets)}"
    ]


def _order(sets: Sequence[StudyRun]) -> str:
    """Say how often the maps kept their order."""
    kept, solved = order_kept(sets)
    if math.isnan(solved):
        return ""
    if math.isnan(kept):
        return " On no fresh seed were all maps of a set solved by all controllers, so its order has no second reading."
    return (
        f" All maps of a set were solved by all controllers on {_percent(solved)} of the fresh seeds; on "
        f"{_percent(kept)} of these they kept the order the search saw."
    )


def _repeats(rows: Sequence[Row]) -> list[str]:
    """Say what repeats in the search changed, where configurations differ in their number."""
    if len({row["repeats"] for row in rows}) < 2:
        return []
    parts = [
        f"{row['configuration']} with {row['repeats']}: fresh minus seen {row['winners_curse']:+.2f}, "
        f"order kept on {_percent(row['order_kept'])}"
        for row in rows
    ]
    return [f"Repeats of every run in the search ({'; '.join(parts)})."]


def _percent(share: float) -> str:
    return "no seed" if math.isnan(share) else f"{100 * share:.0f} %"


def _p(value: float) -> str:
    return "p < 0.001" if value < 0.001 else f"p = {value:.2g}"


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
