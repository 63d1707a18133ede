"""run_minimizing(): delta debugging over the obstacles of a map, in a directory that can be continued."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from operator import itemgetter
from pathlib import Path
from typing import Any, Protocol

from evolution.driving import DEFAULT_RESOURCES, Job, JobPlan, OnRun, Resources, RunResult, drive, run_job
from evolution.files import Row, counted, write_json
from evolution.minimizing.delta_debugging import BATCH, minimal
from evolution.minimizing.obstacles import Obstacle, connected, farthest_first, halves, map_with, obstacles_of
from evolution.minimizing.results import MAPS, MINIMIZATION, SUMMARY, Minimized
from evolution.minimizing.verdicts import Trial, Verdict
from evolution.runs import exclusive_evaluator
from gym_mapbench.errors import ArgumentError
from gym_mapbench.mapio import check_map_set_size, group_scenarios, save_map_set
from gym_mapbench.quantities import Count
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import MapSet, Scenario

OnStep = Callable[[str], object]
OnSmaller = Callable[[Scenario], object]


class Runner(Protocol):
    """Runs jobs, such as an :class:`~evolution.driving.Evaluator`."""

    def run(self, jobs: Sequence[Job], /) -> Sequence[RunResult]:
        """Return the results of jobs, in their order."""
        ...


class Plan(Protocol):
    """The runs of a scenario, such as those of a :class:`~evolution.driving.JobPlan`."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controllers, in order."""
        ...

    def job(self, scenario: Scenario, number: int, repeat: int) -> Job:
        """Return a run of a controller, given by its position."""
        ...


class MinimizeSettings(Settings):
    """Options of a minimisation.

    Args:
        seeds: Seeds on which the verdict must hold.
        held_out_seeds: Further seeds of the final check of both maps.
    """

    seeds: Count = 3
    held_out_seeds: Count = 10


def run_minimizing(
    scenario: Scenario,
    plan: JobPlan,
    verdict: Verdict,
    settings: MinimizeSettings,
    path: Path,
    *,
    resume: bool = False,
    resources: Resources = DEFAULT_RESOURCES,
    on_step: OnStep = lambda _: None,
    on_run: OnRun | None = None,
) -> Minimized:
    """Minimise a map, or continue.

    Args:
        scenario: The map with its task.
        plan: Controllers, world and seed.
        verdict: What must stay true.
        settings: Options.
        path: New directory of the result.
        resume: Whether to continue a minimisation that was begun there.
        resources: Workers, executor and time limits; the results do not depend on it.
        on_step: Called with a line about each smaller map.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.

    Raises:
        ConfigError: If the verdict does not hold on the map, the map is too large for the files of the result, or the
            directory holds something else.
        RunError: If no worker starts, or nothing can be written.
    """
    check_map_set_size(group_scenarios([scenario]) * 2)
    document = {"minimization": _document(scenario, plan, verdict, settings)}
    MINIMIZATION.begin_or_resume(path, document, itemgetter("minimization"), resume=resume)
    with exclusive_evaluator(MINIMIZATION, path, resources, run_job, [plan], on_run) as evaluator:
        search = _Search(scenario, plan, verdict, settings, evaluator, on_step)
        search.measure()
        jobs = [plan.job(scenario, number, 0) for number in range(len(plan.controllers))]
        smallest = search.reduce([drive(job).trajectory for job in jobs])
        result = search.checked(smallest)
        save_map_set(MapSet((result.before, result.after)), path / MAPS)
        write_json(path / SUMMARY, result.document())
    return result


def smallest_map(
    scenario: Scenario,
    plan: Plan,
    verdict: Verdict,
    seeds: int,
    runner: Runner,
    paths: Sequence[Any],
    on_smaller: OnSmaller,
) -> Scenario:
    """Return the map without the obstacles that a verdict does not need, without writing anything.

    Args:
        scenario: The map with its task.
        plan: The runs.
        verdict: What must stay true.
        seeds: Number of seeds on which it must hold.
        runner: Runs the jobs.
        paths: Driven paths ``(n, 2)`` or more columns, x and y in m; the farthest obstacles are removed first.
        on_smaller: Called with each smaller map.

    Raises:
        ConfigError: If the verdict does not hold on the map.
    """
    search = _Search(scenario, plan, verdict, MinimizeSettings(seeds=seeds), runner, on_smaller=on_smaller)
    search.measure()
    return search.reduce(paths)


@dataclass
class _Search:
    """The state of a minimisation."""

    scenario: Scenario
    plan: Plan
    verdict: Verdict
    settings: MinimizeSettings
    evaluator: Runner
    on_step: OnStep = lambda _: None
    on_smaller: OnSmaller = lambda _: None
    steps: list[Row] = field(default_factory=list)

    def measure(self) -> None:
        """Run the original map, and take from its runs what the verdict compares with.

        Raises:
            ConfigError: If the verdict does not hold on it.
        """
        trials = self.trials([self.scenario], range(self.settings.seeds))[0]
        self.verdict = self.verdict.measured_on(trials)
        held = sum(map(self.verdict.holds, trials))
        if held < len(trials):
            errors = [run.reason for trial in trials for run in trial.values() if run.outcome == "error"]
            found = f"it holds on {held} of {counted(len(trials), 'seed')}"
            if errors:
                found += f", and {counted(len(errors), 'run')} ended in an error, the first because: {errors[0]}"
            raise ArgumentError("keep", f"expected a verdict that holds on {self.scenario.name}, but {found}")

    def reduce(self, paths: Sequence[Any]) -> Scenario:
        """Remove obstacles, farthest from the driven paths first, then cut the others, until neither is possible."""
        obstacles = farthest_first(obstacles_of(self.scenario.map), self.scenario.map, paths)
        kept, known = minimal(obstacles, self.first_of), -1
        while len(self.steps) != known:
            known = len(self.steps)
            kept = minimal([part for cells in self._cut(kept) for part in connected(cells)], self.first_of)
        return self.with_obstacles(kept)

    def first_of(self, candidates: list[list[Obstacle]]) -> int | None:
        """Return the position of the first candidate on which the verdict holds for all seeds."""
        scenarios = [self.with_obstacles(one) for one in candidates]
        first = self.trials(scenarios, range(1))
        for number, (trial,) in enumerate(first):
            if self.verdict.holds(trial) and self.holds(scenarios[number]):
                self._record(scenarios[number])
                return number
        return None

    def holds(self, scenario: Scenario) -> bool:
        """Whether the verdict holds on a map for all seeds."""
        return all(map(self.verdict.holds, self.trials([scenario], range(self.settings.seeds))[0]))

    def with_obstacles(self, obstacles: Sequence[Obstacle]) -> Scenario:
        """Return the scenario with these obstacles only; the genome is lost, as it describes all obstacles."""
        fewer = map_with(self.scenario.map, obstacles)
        return replace(self.scenario, map=fewer, name=f"{self.scenario.name}_minimal", genome=None)

    def checked(self, after: Scenario) -> Minimized:
        """Return the result with both maps on held-out seeds."""
        seeds = self.settings.seeds
        held_out = range(seeds, seeds + self.settings.held_out_seeds)
        before, now = ([self.verdict.holds(one) for one in of] for of in self.trials([self.scenario, after], held_out))
        return Minimized(self.scenario, after, self.verdict.text, tuple(before), tuple(now), tuple(self.steps))

    def trials(self, scenarios: Sequence[Scenario], repeats: range) -> list[list[Trial]]:
        """Return the trials of each scenario, one for each repeat."""
        numbers = range(len(self.plan.names))
        jobs = [self.plan.job(one, number, repeat) for one in scenarios for repeat in repeats for number in numbers]
        results = iter(self.evaluator.run(jobs))
        return [[{name: next(results) for name in self.plan.names} for _ in repeats] for _ in scenarios]

    def _cut(self, obstacles: Sequence[Obstacle]) -> list[Obstacle]:
        """Return the obstacles, each cut as long as the verdict holds with one of its halves."""
        kept = list(obstacles)
        for number in range(len(kept)):
            while (smaller := self._smaller(kept, number)) is not None:
                kept[number] = smaller
        return kept

    def _smaller(self, kept: list[Obstacle], number: int) -> Obstacle | None:
        """Return a half of an obstacle with which the verdict still holds; None if there is none."""
        parts = list(halves(kept[number]))[:BATCH]
        found = self.first_of([[*kept[:number], part, *kept[number + 1 :]] for part in parts])
        return None if found is None else parts[found]

    def _record(self, scenario: Scenario) -> None:
        count, cells = len(obstacles_of(scenario.map)), int(scenario.map.occupancy.sum())
        self.steps.append({"step": len(self.steps) + 1, "obstacles": count, "occupied_cells": cells})
        self.on_step(f"{counted(count, 'obstacle')}, {counted(cells, 'occupied cell')}")
        self.on_smaller(scenario)


def _document(scenario: Scenario, plan: JobPlan, verdict: Verdict, settings: MinimizeSettings) -> dict[str, Any]:
    return {
        "map": scenario.name,
        "map_digest": scenario.digest,
        "controllers": {spec.name: spec.model_dump(mode="json", exclude={"name"}) for spec in plan.controllers},
        "seed": plan.root_seed,
        "keep": verdict.text,
        "tolerance": verdict.tolerance,
        "settings": plan.settings.model_dump(mode="json"),
        **settings.model_dump(mode="json"),
    }
