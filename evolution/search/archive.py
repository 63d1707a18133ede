"""The archive of a search: every evaluated map with all its runs.

It stands between the search and the evaluator. It asks for the runs that a map still lacks, stage by stage, and finds
the best set of all evaluated maps.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from itertools import product
from typing import Any

from evolution.driving import Evaluator, Job, JobPlan, RunResult, SetResults
from evolution.search.judging import (
    MAX_MAPS,
    Fitness,
    JudgedMap,
    MapResults,
    Names,
    best_of_judged,
    is_solved,
    repeats_of,
)
from evolution.search.staging import Stage, Stages, next_stage, single_stage
from gym_mapbench.world.scenario import MapSet, Scenario

MAX_EXCHANGES = 100

GoingOn = Callable[[Sequence[str]], Collection[str]]
"""Takes the digests of maps that lack the runs of their next stage, and returns those that get them."""


class Archive:
    """All evaluated maps by their digest.

    Args:
        evaluator: Drives the runs.
        plan: Which runs a map needs.
        stages: Which controllers run one after the other, until one fails; None for all at the same time.

    Attributes:
        scenarios: The maps with their task, in order of first use.
        stages: Which controllers run one after the other.
        count: Different runs so far, driven or answered by the store.
    """

    def __init__(self, evaluator: Evaluator, plan: JobPlan, stages: Stages | None = None) -> None:
        self.evaluator = evaluator
        self.plan = plan
        self.scenarios: dict[str, Scenario] = {}
        self.count = 0
        self._runs: dict[str, list[list[RunResult]]] = {}
        self._judged: dict[str, JudgedMap] = {}
        self._judge: Fitness | None = None
        self._new: list[tuple[Job, RunResult]] = []
        self.stages = stages or single_stage(plan)

    def evaluate(self, map_sets: Sequence[MapSet], going_on: GoingOn | None = None) -> list[SetResults]:
        """Return the results of these sets; new maps are driven with the repeats of the plan.

        Args:
            map_sets: The sets.
            going_on: Returns which maps, of those that have some runs, get the runs of their next stage; None for all.
        """
        scenarios = {scenario.world_digest: scenario for map_set in map_sets for scenario in map_set}
        for digest, scenario in scenarios.items():
            self.scenarios.setdefault(digest, scenario)
            self._runs.setdefault(digest, [[] for _ in self.plan.controllers])
        first = dict.fromkeys(scenarios, 0)
        self._drive_stages(dict.fromkeys(scenarios, self.plan.repeats), first, going_on)
        return [self.results_of(map_set) for map_set in map_sets]

    def drive(self, repeats: Mapping[str, int]) -> None:
        """Drive known maps, stage by stage, until each controller has a number of runs on them; earlier runs count.

        Failures in earlier repeats do not end the stages of later ones.

        Args:
            repeats: For each map, by digest, the number of runs.
        """
        self._drive_stages(repeats, {name: self.repeats_of(name) for name in repeats})

    def drive_more(self, further: Mapping[str, Sequence[int]]) -> None:
        """Drive further runs on known maps; controllers may get different numbers of them.

        Args:
            further: For each map, by digest, the number of further runs of each controller.
        """
        self._drive(
            [
                self.plan.job(self.scenarios[name], place, driven + number)
                for name, counts in further.items()
                for place, (driven, count) in enumerate(zip(self.runs_of(name), counts, strict=True))
                for number in range(count)
            ]
        )

    def missing(self, repeats: Mapping[str, int]) -> dict[str, tuple[int, ...]]:
        """Return the number of runs of each controller that known maps lack.

        Args:
            repeats: For each map, by digest, the number of runs that each controller should have.
        """
        return {name: tuple(max(most - one, 0) for one in self.runs_of(name)) for name, most in repeats.items()}

    def complete(self, map_sets: Iterable[MapSet]) -> None:
        """Drive the runs of these sets that controllers lack on maps where another controller has more."""
        digests = {scenario.world_digest: None for map_set in map_sets for scenario in map_set}
        self.drive_more(self.missing({digest: self.repeats_of(digest) for digest in digests}))

    def drive_while_solved(self, repeats: Mapping[str, int]) -> None:
        """Drive known maps, one seed after the other, until each has a number of runs or one failed run.

        Args:
            repeats: For each map, by digest, the number of runs.
        """
        while left := {
            digest: driven + 1
            for digest, wanted in repeats.items()
            if (driven := self.repeats_of(digest)) < wanted and is_solved(self._runs[digest])
        }:
            self.drive(left)

    def take_new(self) -> list[tuple[Job, RunResult]]:
        """Return the runs since the last call, in their order."""
        new, self._new = self._new, []
        return new

    def results(self, digest: str) -> MapResults:
        """Return the results of one map, ``[controller][repeat]``."""
        return tuple(map(tuple, self._runs[digest]))

    def all_results(self) -> dict[str, MapResults]:
        """Return the results of every map that has any, by digest, in order of first use."""
        return {digest: self.results(digest) for digest in self.scenarios if self.repeats_of(digest)}

    def results_of(self, map_set: MapSet) -> SetResults:
        """Return the results of a set of evaluated maps."""
        return tuple(self.results(scenario.world_digest) for scenario in map_set)

    def runs_of(self, digest: str) -> tuple[int, ...]:
        """Return the number of runs of each controller on a map."""
        return tuple(map(len, self._runs[digest]))

    def repeats_of(self, digest: str) -> int:
        """Return the number of repeats of a map."""
        return repeats_of(self._runs[digest])

    def is_solved(self, digest: str) -> bool:
        """Return whether every controller always reached the goal on a map."""
        return is_solved(self._runs[digest])

    def solved(self) -> dict[str, MapResults]:
        """Return the maps on which every controller always reached the goal."""
        digests = [digest for digest, of_map in self._runs.items() if is_solved(of_map)]
        return {digest: self.results(digest) for digest in digests}

    def judged(self, digest: str, fitness: Fitness) -> JudgedMap:
        """Return a map as a fitness judges it; the answer is kept until the map gets further runs."""
        if fitness is not self._judge:
            self._judge, self._judged = fitness, {}
        if digest not in self._judged:
            self._judged[digest] = fitness.judge_map(self.results(digest))
        return self._judged[digest]

    def map_set(self, names: Iterable[str]) -> MapSet:
        """Return the set of some maps, named by digest."""
        return MapSet(tuple(self.scenarios[name] for name in names))

    def best(self, fitness: Fitness, size: int) -> Names:
        """Return the best set of solved maps; empty if there are fewer than ``size``.

        It is the exact best set if the fitness allows that and a set has up to three maps; else no single exchange
        improves it.
        """
        maps = self.solved()
        if len(maps) < size:
            return ()
        judged = {name: self.judged(name, fitness) for name in maps}
        if size <= MAX_MAPS and fitness.exact:
            return best_of_judged(judged, fitness, size)
        return best_by_exchange(
            tuple(maps)[:size], maps, lambda names: fitness.judge([judged[name] for name in names]).rank_key
        )

    def _drive_stages(
        self, repeats: Mapping[str, int], since: Mapping[str, int], going_on: GoingOn | None = None
    ) -> None:
        """Drive maps stage by stage until a run fails; failures before the repeat ``since`` do not count."""
        names, begun = list(repeats), {name for name in repeats if self.repeats_of(name) > since[name]}
        while next_of := self._next_stages(names, repeats, since):
            if going_on is not None and (asked := [name for name in next_of if name in begun]):
                dropped = set(asked) - set(going_on(asked))
                next_of = {name: stage for name, stage in next_of.items() if name not in dropped}
            names = list(next_of)
            begun.update(names)
            lacking = self.missing({name: repeats[name] for name in names})
            self.drive_more({name: _of_stage(counts, next_of[name]) for name, counts in lacking.items()})

    def _next_stages(
        self, names: Iterable[str], repeats: Mapping[str, int], since: Mapping[str, int]
    ) -> dict[str, Stage]:
        """Return the next stage of each map that has one."""
        found = {name: next_stage(self._runs[name], self.stages, repeats[name], since[name]) for name in names}
        return {name: stage for name, stage in found.items() if stage}

    def _drive(self, jobs: Sequence[Job]) -> None:
        place = {spec.name: number for number, spec in enumerate(self.plan.controllers)}
        for job, result in zip(jobs, self.evaluator.run(jobs), strict=True):
            self._runs[job.scenario.world_digest][place[job.controller.name]].append(result)
            self._judged.pop(job.scenario.world_digest, None)
            self._new.append((job, result))
        self.count += len(jobs)


def best_by_exchange(names: Names, maps: Collection[str], value: Callable[[Names], Any]) -> Names:
    """Return a set that no exchange of a single map improves.

    Args:
        names: The set to begin with.
        maps: Names of the maps that may come in.
        value: Returns the sort key of a set; less is better.
    """
    least = value(names)
    for _ in range(MAX_EXCHANGES):
        tried = [
            (*names[:place], name, *names[place + 1 :])
            for place, name in product(range(len(names)), maps)
            if name not in names
        ]
        values = [value(one) for one in tried]
        if not values or min(values) >= least:
            break
        least = min(values)
        names = tried[values.index(least)]
    return names


def _of_stage(counts: Sequence[int], stage: Stage) -> list[int]:
    """Return the numbers of runs of the controllers of a stage, and 0 for the others."""
    return [count if place in stage else 0 for place, count in enumerate(counts)]
