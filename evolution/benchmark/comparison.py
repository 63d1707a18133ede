"""Comparison of our times with times measured elsewhere (Gazebo and Nav2)."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from evolution.benchmark.runs import Benchmark
from evolution.runs import LoadedRun
from evolution.search import gini, order_of
from evolution.statistics import rank_correlation
from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.runner_results import RunnerResult

INTERVAL_PAIRS = 5
"""Fewest pairs that bound a rank correlation; with fewer, it could be anywhere between -1 and 1."""

Times = Mapping[tuple[str, str], tuple[float, ...]]
"""Times of the runs by (map, controller), s; infinite where the goal was not reached."""


@dataclass(frozen=True)
class Pair:
    """One controller on one map, here and elsewhere.

    Args:
        map: Name of the map.
        controller: Name of the controller.
        ours: Median time of our runs at the goal, s; NaN if there is none.
        theirs: That of the others.
        our_goals: Number of our runs at the goal.
        our_runs: Number of our runs.
        their_goals: Number of the others at the goal.
        their_runs: Number of the others.
    """

    map: str
    controller: str
    ours: float
    theirs: float
    our_goals: int
    our_runs: int
    their_goals: int
    their_runs: int

    @property
    def ratio(self) -> float:
        """Their time over ours."""
        return self.theirs / self.ours if self.ours > 0 else math.nan


@dataclass(frozen=True)
class Comparison:
    """Two sets of times compared.

    Args:
        pairs: Every controller on every map that both sides have.
        correlation: Spearman's rho over all pairs that both solved, with its 95 % interval; NaN where there are
            too few pairs to tell.
        order_kept: For each map, whether it has the same rank by Gini coefficient on both sides; maps on which a
            controller has no time are left out. Empty for one such map or one controller: no ranks could differ.
        missing: Maps and controllers of only one side, in words.
    """

    pairs: tuple[Pair, ...]
    correlation: tuple[float, float, float]
    order_kept: Mapping[str, bool]
    missing: tuple[str, ...]


def compare(ours: Times, theirs: Times) -> Comparison:
    """Compare two sets of times.

    Raises:
        MapFormatError: If they have no map and controller in common.
    """
    common = [key for key in ours if key in theirs]
    if not common:
        got = f"others ({_names(theirs)})" if theirs else "no run (an error is none)"
        raise MapFormatError(f"results: expected maps and controllers of ours ({_names(ours)}), got {got}")
    pairs = tuple(_pair(key, ours[key], theirs[key]) for key in common)
    both = [pair for pair in pairs if math.isfinite(pair.ours) and math.isfinite(pair.theirs)]
    return Comparison(
        pairs=pairs,
        correlation=_correlation(both),
        order_kept=_order_kept(pairs),
        missing=(*_only_in(ours, theirs, "not in the results"), *_only_in(theirs, ours, "no run of ours")),
    )


def check_maps(ours: LoadedRun | Benchmark, results: Iterable[RunnerResult]) -> None:
    """Refuse results on a map that has only the name in common with one of ours.

    Raises:
        MapFormatError: Naming the map.
    """
    digests = ours.digests if isinstance(ours, Benchmark) else {one.name: one.digest for one in ours.best}
    for name, digest in sorted({(result.map, result.digest) for result in results if result.digest}):
        if digests.get(name, digest) != digest:
            got = "one with other walls, start, goal or people"
            raise MapFormatError(f"results: expected the map {name} of ours, got {got}")


def check_one_setup(results: Iterable[RunnerResult]) -> None:
    """Refuse results that are not one sample: of several simulators, time limits or parameters, or with a run twice.

    Raises:
        MapFormatError: Naming what differs, or the run that is there twice.
    """
    results = [one for one in results if one.outcome != "error"]
    for (name, controller, repeat), count in Counter(one[:3] for one in results).items():
        if count > 1:
            raise MapFormatError(
                f"results: expected one line for each run, got {count} of {name}/{controller}, repeat {repeat}"
            )
    for what, found in (
        ("simulator", {result.simulator for result in results}),
        ("set of parameters and behaviour trees", {result.params for result in results}),
        ("time limit", {result.time_limit for result in results}),
    ):
        if len(found) > 1:
            named = ", ".join(one or "none written" for one in sorted(found))
            raise MapFormatError(f"results: expected runs with one {what}, got {len(found)} ({named})")


def times_of_results(results: Iterable[RunnerResult]) -> Times:
    """Return the times of a runner's CSV.

    An ``error`` is no run: Gazebo or Nav2 was not ready, or too slow for the runner's wall clock.
    """
    return _collected((one.map, one.controller, one.outcome, one.time) for one in results)


def our_times(results: LoadedRun | Benchmark) -> Times:
    """Return the times of the best map set of a run, or of a benchmark; an ``error`` is no run."""
    if isinstance(results, Benchmark):
        return _collected((row["map"], row["controller"], row["outcome"], row["time_s"]) for row in results.rows)
    return _collected(
        (entry["name"], name, one["outcome"], one["time_s"])
        for entry in results.best_results["maps"]
        for name, runs in entry["runs"].items()
        for one in runs
    )


def _correlation(solved: Sequence[Pair]) -> tuple[float, float, float]:
    """Return Spearman's rho, with an interval if there are enough pairs for a meaningful one."""
    rho, low, high = rank_correlation([pair.ours for pair in solved], [pair.theirs for pair in solved])
    return (rho, low, high) if len(solved) >= INTERVAL_PAIRS else (rho, math.nan, math.nan)


def _only_in(first: Times, second: Times, what: str) -> list[str]:
    return [f"{name}/{controller}: {what}" for name, controller in first if (name, controller) not in second]


def _collected(rows: Iterable[tuple[str, str, str, float]]) -> Times:
    times: dict[tuple[str, str], list[float]] = {}
    for name, controller, outcome, time in rows:
        if outcome != "error":
            times.setdefault((name, controller), []).append(float(time) if outcome == "goal" else math.inf)
    return {key: tuple(values) for key, values in times.items()}


def _order_kept(pairs: Sequence[Pair]) -> dict[str, bool]:
    names = list(dict.fromkeys(pair.map for pair in pairs))
    controllers = {pair.controller for pair in pairs}
    timed = {(pair.map, pair.controller) for pair in pairs if _finite(pair)}
    solved = [name for name in names if all((name, controller) in timed for controller in controllers)]
    if min(len(solved), len(controllers)) < 2:
        return {}
    ours, theirs = (_places(pairs, solved, side) for side in (lambda pair: pair.ours, lambda pair: pair.theirs))
    return {name: ours[name] == theirs[name] for name in solved}


def _places(pairs: Sequence[Pair], names: Sequence[str], side: Callable[[Pair], float]) -> dict[str, int]:
    """Return the rank of each map by the Gini coefficient of its controllers' times; equal ones share a rank."""
    scores = [gini([side(pair) for pair in pairs if pair.map == name]) for name in names]
    return dict(zip(names, order_of(scores) or (), strict=True))


def _finite(pair: Pair) -> bool:
    return math.isfinite(pair.ours) and math.isfinite(pair.theirs)


def _pair(key: tuple[str, str], ours: Sequence[float], theirs: Sequence[float]) -> Pair:
    reached, others = ([time for time in times if math.isfinite(time)] for times in (ours, theirs))
    middle, other = (median(times) if times else math.nan for times in (reached, others))
    return Pair(*key, middle, other, len(reached), len(ours), len(others), len(theirs))


def _names(times: Times) -> str:
    return ", ".join(f"{name}/{controller}" for name, controller in list(times)[:3]) or "none"
