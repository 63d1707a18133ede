"""Searches: changed maps that are harder, that tell the variants apart, or that explain a verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import fmean

import numpy as np

from evolution.driving import Job, RunResult, derive_seed
from evolution.files import counted
from evolution.minimizing import read_verdict, smallest_map
from evolution.play.answers import gini_of, median_time
from evolution.play.drives import Driven, Send
from evolution.play.messages.replies import Offer, Offers
from evolution.play.messages.requests import AskSearch, AskWhy
from evolution.play.plans import PlannedVariant
from evolution.play.scenes import changed_name, scene_of
from evolution.play.streaming import run_silently
from evolution.play.track import RunJobs
from evolution.search import change_near_way, gini
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import Scenario

MAX_CELLS = 1_000_000
"""Most cells of a map whose changes are searched."""
BATCH = 4
"""Maps that are changed and run together."""
MOST_KNOWN = 50
"""Changes that were tried before, after which no further one is looked for in a batch."""
OFFERED = 3
FOUND = {
    "harder": ("map is harder", "maps are harder"),
    "apart": ("map tells the variants further apart", "maps tell the variants further apart"),
}
FAILURE_FACTOR = 2.0
"""A failed run counts as this many time limits, as with the failure policy ``par2``."""


@dataclass(frozen=True)
class _Tried:
    """A map with the results of every variant, by name."""

    scenario: Scenario
    operators: tuple[str, ...]
    results: Mapping[str, RunResult]
    score: float


def search(driven: Driven, asked: AskSearch, run: RunJobs, send: Send) -> None:
    """Change the map near the path again and again; sends ``offers`` with the best three after each batch.

    The search ends early where no change is left that was not tried.

    Raises:
        CancelledError: If something newer is wanted.
        ConfigError: If the map is too large.
    """
    _check_size(driven.scenario)
    seed = derive_seed(driven.request.settings.seed, driven.scenario.world_digest, asked.goal, 0)
    rng, each = np.random.default_rng(seed), len(driven.variants)
    (first,) = _tried(driven, [(driven.scenario, ())], asked.goal, run)
    best, seen = [first], {driven.scenario.digest}
    done, maps = 0, max(asked.runs // each, 1)
    while done < maps:
        changed = _changes(driven, best, min(BATCH, maps - done), seen, rng)
        tried = _tried(driven, changed, asked.goal, run)
        best = sorted([*best, *tried], key=lambda one: one.score, reverse=True)[: OFFERED + 1]
        done += len(changed)
        maps = maps if changed else done
        better = [one for one in best if one.score > first.score][:OFFERED]
        offers = [_offer(one, first, asked.goal) for one in better]
        text = _found(asked, better, done * each)
        send(_offers(asked, done * each, maps * each, offers, text, finished=done >= maps))


def why(driven: Driven, asked: AskWhy, run: RunJobs, send: Send) -> None:
    """Remove the obstacles that a verdict does not need; sends ``offers`` with the smallest map so far.

    Raises:
        CancelledError: If something newer is wanted.
        ConfigError: If the verdict does not hold, or the map is too large.
    """
    _check_size(driven.scenario)
    verdict = read_verdict(asked.verdict, _Plan(driven.variants).names)
    plan = _Plan([one for one in driven.variants if not verdict.outcomes or one.variant.name in verdict.outcomes])
    runner = _Counted(run, asked.runs)
    smallest = driven.scenario

    def offer(scenario: Scenario) -> None:
        nonlocal smallest
        smallest = replace(scenario, name=changed_name(driven.scenario.name, "_why"))
        send(_offers(asked, runner.done, asked.runs, [_smaller(smallest, asked)], "", finished=False))

    jobs = [plan.job(driven.scenario, number, 0) for number in range(len(plan.names))]
    paths = [np.array(driven.ways[job.key])[:, 1:3] for job in jobs if driven.ways.get(job.key)]
    try:
        smallest_map(driven.scenario, plan, verdict, driven.request.settings.repeats, runner, paths, offer)
        text = f"{asked.verdict}: every obstacle that remains is needed ({counted(runner.done, 'run')})."
    except _SpentError:
        text = (
            f"{asked.verdict}: the smallest map after {counted(runner.done, 'run')}; some obstacles may not be needed."
        )
    send(_offers(asked, runner.done, asked.runs, [_smaller(smallest, asked)], text, finished=True))


@dataclass(frozen=True)
class _Plan:
    """The runs of some variants as the minimiser asks for them."""

    variants: Sequence[PlannedVariant]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(one.variant.name for one in self.variants)

    def job(self, scenario: Scenario, number: int, repeat: int) -> Job:
        return self.variants[number].plan.job(scenario, 0, repeat)


class _SpentError(Exception):
    """The runs of a search are spent."""


@dataclass
class _Counted:
    """Runs jobs until the allowed number is spent."""

    run_jobs: RunJobs
    allowed: int
    done: int = 0

    def run(self, jobs: Sequence[Job], /) -> list[RunResult]:
        if self.done + len(jobs) > self.allowed:
            raise _SpentError
        self.done += len(jobs)
        return self.run_jobs(run_silently, jobs)


def _changes(
    driven: Driven, best: Sequence[_Tried], count: int, seen: set[str], rng: np.random.Generator
) -> list[tuple[Scenario, tuple[str, ...]]]:
    """Return new maps, each a change of one of the best; fewer where too many of the changes were tried before.

    Raises:
        ConfigError: If there is no way on the map.
    """
    robot = driven.variants[0].plan.settings.robot
    found: list[tuple[Scenario, tuple[str, ...]]] = []
    known = 0
    while len(found) < count and known < MOST_KNOWN:
        changed = change_near_way(best[int(rng.integers(len(best)))].scenario, robot, rng)
        if changed is None:
            raise ConfigError("search: expected a map with room for the robot from start to goal, and for a change")
        if changed[0].digest in seen:
            known += 1
        else:
            seen.add(changed[0].digest)
            found.append(changed)
    return found


def _tried(
    driven: Driven, changed: Sequence[tuple[Scenario, tuple[str, ...]]], goal: str, run: RunJobs
) -> list[_Tried]:
    """Run every variant on changed maps."""
    jobs = [one.plan.job(scenario, 0, 0) for scenario, _ in changed for one in driven.variants]
    results = iter(run(run_silently, jobs))
    limit = driven.variants[0].plan.settings.time_limit
    tried = []
    for scenario, operators in changed:
        own = {one.variant.name: next(results) for one in driven.variants}
        times = [result.time_s if result.success else FAILURE_FACTOR * limit for result in own.values()]
        score = gini(times) if goal == "apart" else min(times) + fmean(times) / limit
        tried.append(_Tried(scenario, operators, own, score))
    return tried


def _offer(tried: _Tried, before: _Tried, goal: str) -> Offer:
    """Return a map with what the variants do there, beside what they did before."""
    times = {name: median_time([result]) for name, result in tried.results.items()}
    said = [f"{name} {_end(before.results[name])} → {_end(result)}" for name, result in tried.results.items()]
    return Offer(
        scene=scene_of(replace(tried.scenario, name=changed_name(tried.scenario.name, f"_{goal}"))),
        text=f"{' and '.join(tried.operators)}: {', '.join(said)}",
        gini=gini_of(list(times.values())),
        times=times,
    )


def _end(result: RunResult) -> str:
    return f"{result.time_s:.1f} s" if result.success else result.outcome.replace("_", " ")


def _smaller(scenario: Scenario, asked: AskWhy) -> Offer:
    return Offer(scene=scene_of(scenario), text=f"{asked.verdict}, with fewer obstacles", gini=None, times={})


def _found(asked: AskSearch, better: Sequence[_Tried], done: int) -> str:
    one, several = FOUND[asked.goal]
    return f"After {counted(done, 'run')}: {len(better) or 'no'} {several if len(better) > 1 else one}."


def _offers(asked: AskSearch | AskWhy, done: int, of: int, offers: list[Offer], text: str, *, finished: bool) -> Offers:
    return Offers(id=asked.id, task=asked.type, done=done, of=of, finished=finished, offers=offers, text=text)


def _check_size(scenario: Scenario) -> None:
    if scenario.map.occupancy.size > MAX_CELLS:
        raise ConfigError(f"search: expected a map of at most {MAX_CELLS} cells, got {scenario.map.occupancy.size}")
