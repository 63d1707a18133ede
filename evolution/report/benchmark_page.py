"""The page of a benchmark: success and times of every controller with intervals, replays and every run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import yaml

from evolution.benchmark import (
    Benchmark,
    benchmark_document,
    copies_in_words,
    few_maps_in_words,
    maps_in_words,
    pair_rows,
    place_of_task,
    score_rows,
    table_of_pairs,
    table_of_scores,
    too_few_runs,
)
from evolution.driving import JobPlan, drive
from evolution.files import Row, Table, counted, write_text
from evolution.report.page import Report, Section, command_of, download, page_tables, render_page
from evolution.report.page import Table as PageTable
from evolution.report.replays import ReplayedMap
from evolution.runs import summary_of_map
from evolution.statistics import FEWEST_FOR_INTERVAL, LEVEL, p_in_words
from gym_mapbench.errors import RunError
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.scenario import Scenario

MOST_REPLAYS = 24
"""Largest number of maps with replays on one page; more would make the page too large to open."""

INTERVALS = (
    "Intervals are 95 % intervals: Wilson intervals for shares of runs, Newcombe intervals for differences of shares, "
    "bootstrap intervals for means, and for differences and ratios of times. P-values are corrected by Holm over all "
    "compared pairs: those of times are Wilcoxon's (signed-rank test), those of success, which only a comparison of "
    "parameter sets has, are McNemar's (exact test). The units are maps if the benchmark has "
    f"{FEWEST_FOR_INTERVAL} or more, else tasks if it has as many of them, else runs; fewer than {FEWEST_FOR_INTERVAL} "
    "units and equal values give no bootstrap interval. An interval of a share is the wider, the more the runs of one "
    "unit are alike. Runs that are equal in every measure count once, except in the mean of a map or task."
)
REASONS = ("map", "controller", "repeat", "outcome", "reason")
"""Columns of the table of failed runs."""


def write_benchmark_report(
    result: Benchmark, page: Path, arguments: Sequence[str] = (), notes: Sequence[str] = ()
) -> None:
    """Write the page of a benchmark; one run of each controller on each map is re-run for its replay.

    Args:
        result: The benchmark, as :func:`evolution.bench` returned it.
        page: The file; see :func:`evolution.report.writing.new_page`.
        arguments: The command line after ``mapbench``; empty if the benchmark was started from Python.
        notes: Further paragraphs below the verdict.

    Raises:
        RunError: If the benchmark was read from a file, which does not hold its maps, or the page cannot be written.
    """
    if result.plan is None:
        raise RunError(f"{page}: expected a benchmark that was just run; a file of results does not hold its maps")
    write_text(page, render_page(report_of_benchmark(result, result.plan, arguments, notes)))


def report_of_benchmark(result: Benchmark, plan: JobPlan, arguments: Sequence[str], notes: Sequence[str]) -> Report:
    """Return the page of a benchmark; the arguments are those of :func:`write_benchmark_report`."""
    driven = [_driven(result, plan, scenario) for scenario in result.scenarios[:MOST_REPLAYS]]
    count = maps_and_runs(result.scenarios, plan.repeats)
    return Report(
        title="Benchmark",
        subtitle=f"{count}: {', '.join(plan.names)}; seed {plan.root_seed}",
        verdict=[*verdict_of_benchmark(result.rows, plan.names), *notes],
        command=command_of(arguments, "bench"),
        configuration=yaml.safe_dump(benchmark_document(result.scenarios, plan), sort_keys=False),
        maps=[_replayed_map(result, plan.names, episodes) for episodes in driven if episodes],
        sections=[Section("Tables", [INTERVALS], _tables(result), id="tables")],
        downloads=[download(name, content) for name, content in result.files.items()],
        missing=_missing(result),
        changed=[line for episodes in driven for line in _changed(result, episodes)],
    )


def maps_and_runs(scenarios: Sequence[Scenario], repeats: int) -> str:
    """Return the number of maps, with their tasks if they have several, and of runs on each in words."""
    maps = maps_in_words(map(place_of_task, scenarios))
    return f"{maps}, {counted(repeats, 'run')} of each controller on each"


def verdict_of_benchmark(rows: Sequence[Row], controllers: Sequence[str]) -> list[str]:
    """Return success and time of each controller, the difference of each pair, and the number of copies in sentences.

    Args:
        rows: The runs.
        controllers: Names of the controllers, in order.
    """
    ordered = sorted(score_rows(rows, controllers), key=lambda row: (-row["success"], row["mean s"] or np.inf))
    pairs = pair_rows(rows, [row["controller"] for row in ordered])
    faster = [sentence for pair in pairs for sentence in _faster(pair, len(pairs))]
    about = few_maps_in_words(rows) + too_few_runs(rows, controllers)
    return [_sentence(row) for row in ordered] + faster + about + copies_in_words(rows)


def _sentence(row: Row) -> str:
    """Return success and mean time of one controller in words."""
    low, high = (f"{100 * row[f'success {end}']:.0f}" for end in ("from", "to"))
    text = (
        f"{row['controller']} reaches the goal in {row['goals']} of {counted(row['runs'], 'run')} "
        f"({100 * row['success']:.0f} %, 95 % interval {low} to {high} %)"
    )
    if row["mean s"] is None:
        return f"{text}."
    interval = "" if row["mean s from"] is None else f" ({row['mean s from']:.1f} to {row['mean s to']:.1f})"
    return f"{text}, in {row['mean s']:.1f} s{interval} in the mean of these."


def _faster(pair: Row, pairs: int) -> Iterator[str]:
    """Say which of two controllers is faster if both reach the goal; nothing if there are too few such runs.

    Args:
        pair: A row of ``pair_rows``.
        pairs: Number of its rows, over which the p-values are corrected.
    """
    mean, low, high = (pair[name] for name in ("faster s", "faster s from", "faster s to"))
    if low is None:
        return
    fast, slow = (pair["first"], pair["second"]) if mean <= 0 else (pair["second"], pair["first"])
    low, high = (-high, -low) if mean <= 0 else (low, high)
    p = p_in_words(pair["p_time_holm"]) + (f" by Holm over {pairs} pairs" if pairs > 1 else "")
    sure = "" if low > 0 and pair["p_time_holm"] < LEVEL else ", so neither is shown to be faster"
    yield (
        f"Where both reach the goal ({pair['both']} pairs of runs on the same map and noise), {fast} is "
        f"{abs(mean):.1f} s faster than {slow} in the mean (95 % interval {low:z.1f} to {high:z.1f} s, {p}{sure})."
    )


def _driven(result: Benchmark, plan: JobPlan, scenario: Scenario) -> list[Episode]:
    """Re-run the run of each controller on a map whose time is the median; runs that ended in an error are left out."""
    episodes = []
    for number, name in enumerate(plan.names):
        rows = [row for row in _rows_of(result, scenario.name, name) if row["outcome"] != "error"]
        if rows:
            episodes.append(drive(plan.job(scenario, number, typical_run(rows)["repeat"])))
    return episodes


def typical_run(rows: Sequence[Row]) -> Row:
    """Return the run with the median time, runs that did not reach the goal last."""
    return sorted(rows, key=lambda row: (row["outcome"] != "goal", row["time_s"]))[(len(rows) - 1) // 2]


def _replayed_map(result: Benchmark, names: Sequence[str], episodes: Sequence[Episode]) -> ReplayedMap:
    """Return the replay of a map, with the difference between the controllers in its title."""
    name = episodes[0].scenario.name
    summary = summary_of_map(name, {controller: _rows_of(result, name, controller) for controller in names})
    sample = f"Title: {summary.sample_at_goal}. Replay: the run of each controller with its median time."
    return ReplayedMap(f"{name}: {summary.difference}", episodes, sample=sample)


def _rows_of(result: Benchmark, name: str, controller: str) -> list[Row]:
    return [row for row in result.rows if (row["map"], row["controller"]) == (name, controller)]


def _changed(result: Benchmark, episodes: Sequence[Episode]) -> Iterator[str]:
    """Report replays whose outcome and time no recorded run has."""
    for episode in episodes:
        rows = _rows_of(result, episode.scenario.name, episode.controller)
        if (episode.outcome, episode.time) not in {(row["outcome"], row["time_s"]) for row in rows}:
            yield (
                f"The replay of {episode.controller} on {episode.scenario.name} ends with {episode.outcome} after "
                f"{episode.time:.2f} s, as none of its runs did."
            )


def _missing(result: Benchmark) -> list[str]:
    """Say how many maps have no replay."""
    left = len(result.scenarios) - MOST_REPLAYS
    return [f"Replays of the first {MOST_REPLAYS} maps only; {left} more are in the tables."] if left > 0 else []


def _tables(result: Benchmark) -> list[PageTable]:
    runs, failures = split_reasons(result.rows)
    return [
        *page_tables("Controllers", table_of_scores(result.table("controllers"), result.metrics)),
        *page_tables("Pairs", table_of_pairs(result.table("pairs"))),
        *page_tables("Maps", result.table()),
        *page_tables("Failed runs", Table(failures)),
        *page_tables("Runs", Table(runs)),
    ]


def split_reasons(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Return the runs without their reasons and with the seed last, and the runs with a reason.

    A reason is several lines long; among twenty columns of numbers it would make its row high and lie outside the page.

    Args:
        rows: Runs, with the seed and the reason of each.
    """
    moved = ("seed", "reason")
    runs = [{name: row[name] for name in (*(one for one in row if one not in moved), "seed")} for row in rows]
    return runs, [{name: row[name] for name in REASONS} for row in rows if row["reason"]]
