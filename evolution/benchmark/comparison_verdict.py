"""The result of a comparison of parameter sets in sentences: who is better at what, by how much, how certain."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import groupby

from evolution.benchmark.configurations import ParameterComparison
from evolution.benchmark.paired import (
    copies_in_words,
    few_maps_in_words,
    measures_of,
    on_few_maps,
    place_of,
    too_few_in_words,
    unit_of,
    units_in_words,
)
from evolution.files import Row, counted
from evolution.statistics import LEVEL, p_in_words

MOST_MAPS, MOST_KEYS, MOST_LINES = 3, 8, 20
NO_VALUE = "-"


def verdict_of_comparison(comparison: ParameterComparison) -> list[str]:
    """Return the answer for each pair of sides, the maps with the largest differences, and the keys that differ."""
    found = _of_sweep(comparison) if comparison.against_first else [*verdict_of_pairs(comparison), *_maps(comparison)]
    compared = [(comparison.sides[pair["first"]], comparison.sides[pair["second"]]) for pair in comparison.pairs]
    about = [*few_maps_in_words(comparison.rows), *too_few_in_words(compared)]
    return [
        *found,
        *about,
        *copies_in_words(comparison.rows),
        *_keys(comparison.parameters),
        *_without_effect(comparison),
    ]


def verdict_of_pairs(comparison: ParameterComparison) -> list[str]:
    """Return the answer for each pair of sides: who is better, goals, and ratio of times."""
    return [text for pair in comparison.pairs for text in _of_pair(comparison, pair)]


def _of_sweep(comparison: ParameterComparison) -> list[str]:
    """Return the sides with the most goals and the shortest times, and each side that is shown to differ.

    Times are compared with the first side where both reach the goal: a mean over all goals would be the shorter, the
    more slow maps a side fails.
    """
    rows = comparison.table()
    timed = [pair for pair in comparison.pairs if pair["time_ratio"] is not None]
    found = [_most_goals(rows)]
    if timed:
        least = min(pair["time_ratio"] for pair in timed)
        fastest = [pair["second"] for pair in timed if pair["time_ratio"] == least]
        found.append(_fastest(timed[0]["first"], fastest, least))
    shown = [pair for pair in comparison.pairs if _differ(pair)]
    if not shown:
        found.append(f"No value is shown to differ from {rows[0]['configuration']}.")
    where = on_few_maps(comparison.rows)
    return [*found, *(_headline(pair["first"], pair["second"], pair, where) for pair in shown)]


def _most_goals(rows: Sequence[Row]) -> str:
    """Say which of the values of a sweep reach the goal most often."""
    most = max(row["success"] for row in rows)
    best = [row for row in rows if row["success"] == most]
    often = f"in {best[0]['goals']} of {counted(best[0]['runs'], 'run')}"
    if len(best) == 1:
        return f"{best[0]['configuration']} reaches the goal most often, {often}."
    if len(best) == len(rows):
        return f"All values reach the goal equally often, {often}."
    return f"{_listed([row['configuration'] for row in best])} reach the goal most often, each {often}."


def _listed(names: Sequence[str]) -> str:
    """Name some values of a sweep, or count them if they are many."""
    return " and ".join(names) if len(names) <= MOST_MAPS else f"{len(names)} values"


def _fastest(own: str, others: Sequence[str], ratio: float) -> str:
    """Say which of the values of a sweep have the shortest times, given those with the least ratio to the own."""
    if ratio >= 1.0:
        return f"Where both reach the goal, no value takes less time than {own}."
    takes = f"{others[0]} takes" if len(others) == 1 else f"{_listed(others)} each take"
    return f"Where both reach the goal, {takes} {ratio:.3f} times as long as {own}, the least of all values."


def _differ(pair: Row) -> bool:
    return any(_winners("a", "b", pair))


def differences_in_words(rows: Sequence[Row]) -> list[str]:
    """Return a line for each of the first keys that differ, with the value of each configuration; count the others."""
    more = len(rows) - MOST_LINES
    left = [f"{counted(more, 'more key differs', 'more keys differ')}; the page of --html FILE has all."]
    return [*map(_difference_in_words, rows[:MOST_LINES]), *(left if more > 0 else [])]


def _difference_in_words(row: Row) -> str:
    values = [f"{name} {value or NO_VALUE}" for name, value in row.items() if name != "key"]
    return f"{row['key']}: {', '.join(values)}"


def _of_pair(comparison: ParameterComparison, pair: Row) -> list[str]:
    a, b = pair["first"], pair["second"]
    goals = {name: sum(row["outcome"] == "goal" for row in comparison.sides[name]) for name in (a, b)}
    runs = {name: len(comparison.sides[name]) for name in (a, b)}
    units = units_in_words(pair["n"], unit_of(map(place_of, comparison.sides[a])))
    success = (
        f"{b} reaches the goal in {goals[b]} of {counted(runs[b], 'run')}, {a} in {goals[a]} of {runs[a]}. {b} is "
        f"better on {pair['wins']} of {units}, {a} on {pair['losses']} ({p_in_words(pair['p_success_holm'])})."
    )
    return [_headline(a, b, pair, on_few_maps(comparison.sides[a])), success, *_time(a, b, pair)]


def _headline(a: str, b: str, pair: Row, where: str) -> str:
    """Return the answer for one pair, and where it holds."""
    often, fast = _winners(a, b, pair)
    if often is None and fast is None:
        return f"{b} against {a}: no difference is shown, neither in success nor in time."
    if often is None or fast is None or often == fast:
        found = [text for text, who in (("reaches the goal more often", often), ("is faster", fast)) if who]
        winner = often or fast
        return f"{winner} is better than {b if winner == a else a}{where}: {winner} {' and '.join(found)}."
    return f"{often} reaches the goal more often than {fast}{where}, but {fast} is faster."


def _winners(a: str, b: str, pair: Row) -> tuple[str | None, str | None]:
    """Return the side that is shown to reach the goal more often, and the side that is shown to be faster, if any.

    A side is faster if the test shows a difference and the interval of the ratio is on its side of 1: Wilcoxon's test
    compares ranks, so a side can have the better ranks and, for a few far better times of the other, the larger mean.
    """
    often = fast = None
    if pair["p_success_holm"] < LEVEL:
        often = b if pair["wins"] > pair["losses"] else a
    if pair["p_time_holm"] is not None and pair["p_time_holm"] < LEVEL and pair["ratio_low"] is not None:
        fast = b if pair["ratio_high"] < 1.0 else a if pair["ratio_low"] > 1.0 else None
    return often, fast


def _time(a: str, b: str, pair: Row) -> list[str]:
    if pair["time_ratio"] is None and pair["both"]:
        return [f"Where both {a} and {b} reach the goal, a run begins there, so times cannot be compared."]
    if pair["time_ratio"] is None:
        return [f"There is no pair of runs in which both {a} and {b} reach the goal, so times cannot be compared."]
    interval = (
        "" if pair["ratio_low"] is None else f"95 % interval {pair['ratio_low']:.3f} to {pair['ratio_high']:.3f}, "
    )
    pairs = "one pair" if pair["both"] == 1 else f"{pair['both']} pairs"
    return [
        f"In the {pairs} of runs in which both reach the goal, {b} takes {pair['time_ratio']:.3f} times "
        f"as long as {a} ({interval}{p_in_words(pair['p_time_holm'])})."
    ]


def _maps(comparison: ParameterComparison) -> list[str]:
    """Name the maps with the largest differences."""
    sides = list(comparison.sides)
    rows = [row for row in comparison.table("maps") if _differs(row, comparison.pairs)][:MOST_MAPS]
    if not rows:
        return []
    named = "; ".join(f"{row['map']} ({_cell(row, sides)})" for row in rows)
    return [f"The largest differences are on {named}."]


def _differs(row: Row, pairs: Sequence[Row]) -> bool:
    """Whether two compared sides have other goals or times on a map."""

    def on_map(side: str) -> tuple[object, object]:
        return row[f"{side} goals"], row[f"{side} s"]

    return any(on_map(pair["first"]) != on_map(pair["second"]) for pair in pairs)


def _cell(row: Row, sides: Sequence[str]) -> str:
    def time(side: str) -> str:
        return "" if row[f"{side} s"] is None else f" in {row[f'{side} s']:.1f} s"

    return ", ".join(f"{side} {row[f'{side} goals']}{time(side)}" for side in sides)


def _keys(rows: Sequence[Row]) -> list[str]:
    """Count the keys that differ and name the first."""
    if not rows:
        return ["The configurations differ in no key that MapBench reads."]
    more = f" and {len(rows) - MOST_KEYS} more" if len(rows) > MOST_KEYS else ""
    named = ", ".join(row["key"] for row in rows[:MOST_KEYS])
    return [f"The configurations differ in {counted(len(rows), 'key')}: {named}{more}."]


def _without_effect(comparison: ParameterComparison) -> list[str]:
    """Name the keys whose values change no run."""
    keys = [row["key"] for row in comparison.parameters]
    if not keys or all(row["outcome"] == "error" for row in comparison.rows):
        return []
    labels = list(comparison.by_label)
    idle = keys if _same_runs(comparison, labels) else [key for key in keys if _is_idle(comparison, key, labels)]
    if not idle:
        return []
    more = f" and {len(idle) - MOST_KEYS} more" if len(idle) > MOST_KEYS else ""
    return [
        f"Without effect in these runs: {', '.join(idle[:MOST_KEYS])}{more}. Configurations that differ in nothing "
        "else have the same runs; another parameter may switch a key off."
    ]


def _is_idle(comparison: ParameterComparison, key: str, labels: Iterable[str]) -> bool:
    """Whether there are configurations that differ in this key only, and they all have the same runs."""

    def others(label: str) -> tuple[str, ...]:
        return tuple(row[label] for row in comparison.parameters if row["key"] != key)

    groups = [list(group) for _, group in groupby(sorted(labels, key=others), others)]
    alike = [group for group in groups if len(group) > 1]
    return bool(alike) and all(_same_runs(comparison, group) for group in alike)


def _same_runs(comparison: ParameterComparison, labels: Sequence[str]) -> bool:
    """Whether configurations have the same runs, apart from computing times."""
    first, *others = ([measures_of(row) for row in comparison.by_label[label]] for label in labels)
    return all(runs == first for runs in others)
