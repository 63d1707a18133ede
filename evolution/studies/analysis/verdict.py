"""The verdict of a study in words: the best configuration, its lead, and the uncertainty of the lead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from evolution.files import Row, counted
from evolution.statistics import Summary, TestResult, median_interval, p_in_words
from evolution.studies.analysis.comparisons import QUANTITIES, Comparison, StudyAnalysis
from evolution.studies.analysis.held_out import conditions, held_out_rows, rank_agreement, selected_sets
from evolution.studies.analysis.judges import Judge
from evolution.studies.analysis.reported_fitness import reported_fitness_rows
from evolution.studies.analysis.results import StudyResults, StudyRun, reevaluated

ALPHA = 0.05
NO_PATTERN_LEAD = 1000.0
"""Smallest lead that only the -1000 of Alg. 2 explains: the worse set has no pattern."""


def verdict_of(analysis: StudyAnalysis) -> list[str]:
    """Return the paragraphs of the verdict; lower fitness is better throughout."""
    if not analysis.results.runs:
        return ["No search of this study is finished."]
    rows = held_out_rows(analysis.results)
    sentences = [sentence for judge in analysis.judges for sentence in _of_judge(judge, analysis, rows)]
    return _held_out_against(analysis) + sentences + _repeats(rows)


def _held_out_against(analysis: StudyAnalysis) -> list[str]:
    """Compare the held-out fitness of configurations whose searches have different fitnesses."""
    rows = {row["configuration"]: row for row in reported_fitness_rows(analysis.results)}
    return [
        f"Median held-out fitness: {_held_out(row)}; {_held_out(rows[row['against']])}. Lower is better: {name} is "
        f"better in {100 * row['a12']:.0f} % of pairs of searches (A12; {p_in_words(row['p_holm'])})."
        for name, row in rows.items()
        if row["against"]
        and row["p_holm"] < ALPHA
        and not any({name, row["against"]} <= set(judge.groups) for judge in analysis.judges)
    ]


def _held_out(row: Row) -> str:
    """Return the reported and the held-out fitness of a configuration in words."""
    low, high = row["held_out_low"], row["held_out_high"]
    interval = "" if math.isnan(low) else f"95 % interval {low:.2f} to {high:.2f}; "
    return (
        f"{row['configuration']} {row['held_out_fitness']:.2f} ({interval}reported {row['reported_fitness']:.2f}; rank "
        f"agreement in {_percent(row['rank_agreement'])} of trials; n = {row['n']})"
    )


def _of_judge(judge: Judge, analysis: StudyAnalysis, rows: Sequence[Row]) -> list[str]:
    """Return the sentences about the configurations of one judge."""
    reported, *held_out = analysis.of(judge)
    again = reevaluated(judge.runs)
    compared = held_out[0] if held_out and 2 * len(again) >= len(judge.runs) else reported
    if not judge.comparable:
        return [_other_scales(judge), judge.meaning]
    sentences = _winner(compared) + (_left_out(judge, compared) if again else [])
    sentences += [_population(test, compared) for test in compared.populations]
    sentences += [judge.meaning, *_success([row for row in rows if row["configuration"] in judge.groups])]
    return sentences + _selection_bias(judge, analysis.results)


def _other_scales(judge: Judge) -> str:
    """Return why nothing is compared."""
    low, high = judge.scales[0], judge.scales[-1]
    return (
        f"{_capital(judge.name)}: not compared. Every search calibrated its own cluster scale ({low:.3g} to "
        f"{high:.3g}), so the values of different searches are on different scales ({_list(list(judge.groups))})."
    )


def _winner(comparison: Comparison) -> list[str]:
    """Return the best configuration, and the others from which the difference is significant."""
    best, *others = comparison.order
    title, figures = _capital(comparison.title), _median(comparison.summaries[best])
    if not others:
        return [f"{title}: {best} has the median {figures}. It is the only configuration."]
    pairs = [pair for pair in comparison.pairs if pair.groups[0] == best]
    beaten = [pair for pair in pairs if pair.p_value < ALPHA and pair.effect > 0.5]
    worse_than = [pair for pair in pairs if pair.p_value < ALPHA and pair.effect <= 0.5]
    equal = [pair for pair in pairs if pair.p_value >= ALPHA]
    hopeless = [pair.groups[1] for pair in equal if _too_few(pair, comparison)]
    nested = [parent for name, parent in comparison.by_construction if name == best]
    medians = {name: comparison.summaries[name].median for name in comparison.order}
    same = [name for name in others if medians[name] == medians[best]]
    shared = f"; {_list(same)} {'has' if len(same) == 1 else 'have'} the same" if same else ""
    sentences = [f"{title}: {best} has the best median, {figures}{shared}."]
    if beaten:
        sentences.append(f"{best} beats {_list([_behind(pair, comparison) for pair in beaten])}.")
    if worse_than:
        shown = _list([_behind(pair, comparison) for pair in worse_than])
        sentences.append(f"In most pairs of searches {best} is worse than {shown}.")
    if equal:
        shown = _list([_behind(pair, comparison) for pair in equal])
        sentences.append(f"No significant difference between {best} and {shown}.")
    if hopeless:
        sentences.append(f"The searches are too few for a significant difference from {_list(hopeless)}.")
    if nested:
        sentences.append(
            f"{best} selects among all maps of {_list(nested)} afterwards. Its reported fitness cannot be worse, so "
            "the two are not tested against each other."
        )
    return sentences


def _left_out(judge: Judge, compared: Comparison) -> list[str]:
    """Return the runs that the comparison of held-out fitness leaves out."""
    absent = {name: sum(run.reevaluation is None for run in runs) for name, runs in judge.groups.items()}
    named = [
        f"{name} ({count} of {counted(len(judge.groups[name]), 'search', 'searches')})"
        for name, count in absent.items()
        if count
    ]
    if not named:
        return []
    if compared.quantity == "fitness":
        return [
            "Fewer than half of the searches are re-evaluated, so this compares the reported fitness. "
            f"Not re-evaluated: {_list(named)}."
        ]
    return [f"Left out, because not re-evaluated yet: {_list(named)}."]


def _median(one: Summary) -> str:
    """Return a median with its interval, mean and number of runs."""
    interval = "" if math.isnan(one.ci_low) else f"95 % interval {one.ci_low:.2f} to {one.ci_high:.2f}, "
    return f"{one.median:.2f} ({interval}mean {one.mean:.2f}, n = {one.n}; lower is better)"


def _too_few(pair: TestResult, comparison: Comparison) -> bool:
    """Whether even completely separated samples give no significant p: 2 / C(n + m, n) times the pairs (Holm)."""
    n, m = pair.n
    return 2 / math.comb(n + m, n) * len(comparison.pairs) >= ALPHA


def _behind(pair: TestResult, comparison: Comparison) -> str:
    """Return how far the second of a pair is behind the first, with effect size, p and n."""
    first, second = pair.groups
    lead = comparison.summaries[second].median - comparison.summaries[first].median
    behind = "no pattern in the median" if lead >= NO_PATTERN_LEAD else f"median {lead:.2f} behind"
    better = f"{first} better in {100 * pair.effect:.0f} % of pairs of searches, A12"
    return f"{second} ({behind}; {better}; {p_in_words(pair.p_value)}; n = {pair.n[0]} and {pair.n[1]})"


def _population(test: TestResult, comparison: Comparison) -> str:
    """Return whether the population size has a significant effect (thesis: H = 0.44, p = 0.80)."""
    effect = "a significant effect" if test.p_value < ALPHA else "no significant effect"
    return (
        f"The population size has {effect} on the {QUANTITIES[comparison.quantity]} fitness ({_list(test.groups)}: "
        f"Kruskal-Wallis H = {test.statistic:.2f}, {p_in_words(test.p_value)}, {test.effect_name} = {test.effect:.2f}, "
        f"n = {', '.join(map(str, test.n))})."
    )


def _success(rows: Sequence[Row]) -> list[str]:
    """Return the success rates on held-out seeds."""
    shares = [f"{row['configuration']} {_percent(row['held_out_success_rate'])}" for row in rows]
    return [f"Success rate of the best sets on held-out seeds: {_list(shares)}."] if shares else []


def _selection_bias(judge: Judge, results: StudyResults) -> list[str]:
    """Return the difference between held-out and reported fitness in words."""
    sets = selected_sets(judge.runs)
    if not sets:
        return []
    differences = np.array([run.selection_bias for run in sets])
    low, high = median_interval(differences)
    interval = "" if math.isnan(low) else f"95 % interval {low:+.2f} to {high:+.2f}, "
    reported = float(np.median([run.fitness for run in sets]))
    new = conditions(sets[0], results)
    causes = (
        "It is the selection bias (winner's curse) and the effect of the other noise together."
        if "noise" in new
        else "It is the selection bias (winner's curse)."
    )
    return [
        f"Held-out minus reported fitness, {judge.name}: the searches report a median of {reported:.2f}. With {new} "
        f"the median difference is {np.median(differences):+.2f} ({interval}n = "
        f"{counted(len(sets), 'different set')}). {causes}{_ranks(sets)}"
    ]


def _ranks(sets: Sequence[StudyRun]) -> str:
    """Return the rank agreement in words."""
    kept, solved = rank_agreement(sets)
    if math.isnan(solved):
        return ""
    if math.isnan(kept):
        return " In no trial did all controllers solve all maps of a set, so there is no rank agreement."
    return (
        f" All controllers solved all maps of a set in {_percent(solved)} of trials. In {_percent(kept)} of these the "
        "maps keep their rank."
    )


def _repeats(rows: Sequence[Row]) -> list[str]:
    """Return the effect of repeats in the search, where configurations differ in them."""
    if len({row["repeats"] for row in rows}) < 2:
        return []
    parts = [
        f"{row['configuration']} with {row['repeats']}: held-out minus reported fitness {row['selection_bias']:+.2f}, "
        f"rank agreement {_percent(row['rank_agreement'])}"
        for row in rows
    ]
    return [f"Repeats of every run in the search ({'; '.join(parts)})."]


def _percent(share: float) -> str:
    return "no trial" if math.isnan(share) else f"{100 * share:.0f} %"


def _list(words: Sequence[str]) -> str:
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


def _capital(text: str) -> str:
    return text[0].upper() + text[1:]
