"""Drives: all variants on the map of the page, with their ways while they are computed."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from itertools import groupby
from operator import attrgetter

from controllers.registry import relative_cost
from evolution.driving import Job, RunResult, check_room
from evolution.play.answers import answer_message, run_message
from evolution.play.messages.replies import Data, Way
from evolution.play.messages.requests import Drive
from evolution.play.plans import PlannedVariant, command_lines, parameter_files, planned
from evolution.play.scenes import scenario_of
from evolution.play.streaming import Part, Waypoint, run_streamed
from evolution.play.track import RunJobs
from evolution.play.worlds import Given
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.scenario import Scenario

Send = Callable[[Data], object]


@dataclass
class Driven:
    """A ``drive`` of the page.

    Args:
        request: What the page asked for.
        scenario: Its map.
        variants: The variants, ready to run.
        results: Results of the runs so far, by the key of the job.
        ends: Last pose of each run so far, by the key of the job.
        ways: Ways of the first repeat so far, by the key of the job.
    """

    request: Drive
    scenario: Scenario
    variants: list[PlannedVariant]
    results: dict[str, RunResult] = field(default_factory=dict)
    ends: dict[str, Waypoint] = field(default_factory=dict)
    ways: dict[str, list[Waypoint]] = field(default_factory=dict)

    def take(self, job: Job, part: Part) -> None:
        """Keep what later requests need of the way of a run."""
        if part.poses:
            self.ends[job.key] = part.poses[-1]
        if job.repeat == 0:
            self.ways.setdefault(job.key, []).extend(part.poses)

    def job(self, name: str, repeat: int) -> Job:
        """Return a job by the name of its variant and its repeat.

        Raises:
            ConfigError: If there is no such run.
        """
        for variant in self.variants:
            if variant.variant.name == name and repeat < variant.plan.repeats:
                return variant.plan.job(self.scenario, 0, repeat)
        raise ConfigError(f"variant: expected a run of the last drive, got {name!r}, repeat {repeat}")


def prepared(request: Drive, given: Given) -> Driven:
    """Return a drive, ready to run.

    Raises:
        ConfigError: If the map or a variant cannot be used.
    """
    driven = Driven(request, scenario_of(request.scene), planned(request, given))
    for one in driven.variants:
        check_room([driven.scenario], one.plan.settings)
    return driven


def drive(driven: Driven, run: RunJobs, send: Send) -> None:
    """Run all variants; sends ``way`` and ``run`` for each run, then ``answer``.

    Raises:
        CancelledError: If something newer is wanted.
    """
    jobs = {one.variant.name: one.plan.jobs(driven.scenario) for one in driven.variants}
    names: dict[str, list[str]] = {}
    for name, own in jobs.items():
        for job in own:
            names.setdefault(job.key, []).append(name)

    def pass_on(job: Job, part: Part) -> None:
        driven.take(job, part)
        for name in names[job.key]:
            send(Way.model_construct(id=driven.request.id, variant=name, repeat=job.repeat, **vars(part)))

    def finish(job: Job, result: RunResult) -> None:
        driven.results[job.key] = result
        for name in names[job.key]:
            send(run_message(driven.request.id, name, job, result, driven.ends.get(job.key)))

    every = {job.key: job for own in jobs.values() for job in own}
    run(run_streamed, _in_order(every.values()), pass_on, finish)
    send(_answer(driven, jobs))


def _in_order(jobs: Iterable[Job]) -> list[Job]:
    """Order jobs so that all end early: repeat by repeat, the most expensive controller first, then the cheapest."""
    ordered = sorted(jobs, key=lambda job: (job.repeat, _cost(job)))
    repeats = [list(group) for _, group in groupby(ordered, key=attrgetter("repeat"))]
    return [job for group in repeats for job in (group[-1], *group[:-1])]


def _cost(job: Job) -> float:
    return relative_cost(job.controller.registered_name, job.settings.navigation)


def _answer(driven: Driven, jobs: dict[str, list[Job]]) -> Data:
    request, variants = driven.request, driven.variants
    results = {name: [(job, driven.results[job.key]) for job in own] for name, own in jobs.items()}
    name = request.scene.name
    files, commands = [f"{name}.yaml", *parameter_files(variants)], command_lines(variants, name)
    return answer_message(request.id, variants, results, commands, files)
