"""run_study(): run every configuration with every seed; finished runs are not repeated."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

from evolution.driving import DEFAULT_RESOURCES, Evaluator, Job, Resources, RunResult, models_of
from evolution.files import WriteError
from evolution.runs import RecordedExperiment, exclusive_evaluator, load_run
from evolution.search import Progress
from evolution.studies.analysis.loading import load_results
from evolution.studies.analysis.results import StudyResults
from evolution.studies.directory import STUDY, StudyDir
from evolution.studies.methods import opened, run_task
from evolution.studies.path_length import run_study_job
from evolution.studies.reevaluation import read_reevaluation, reevaluate, write_reevaluation
from evolution.studies.settings import LATER, Configuration, StudySettings
from evolution.studies.tasks import Task, check_study, make_task, take_from_earlier
from gym_mapbench.errors import MapBenchError, RunError

PLAN_COST = 0.01
"""Work of planning one path, as a fraction of the work of one run."""


@dataclass(frozen=True)
class StudyProgress:
    """Where a study stands.

    Args:
        configuration: Name of the configuration that is being run.
        seed: Seed of the run.
        step: ``search`` after a generation, ``done`` after a run with its re-evaluation.
        best: Best fitness of this run so far.
        fraction: Share of the work that is done, 0 to 1.
        seconds_left: Estimate from the work done so far; None if nothing was done yet.
        runs_per_second: Runs per second so far.
    """

    configuration: str
    seed: int
    step: Literal["search", "done"]
    best: float
    fraction: float
    seconds_left: float | None
    runs_per_second: float


OnProgress = Callable[[StudyProgress], None]


def run_study(
    settings: StudySettings,
    path: str | Path,
    *,
    resume: bool = False,
    only: Sequence[str] | None = None,
    runs: int | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    on_progress: OnProgress | None = None,
) -> StudyResults:
    """Run or continue a study.

    Every run has a run directory of its own and can be killed at any moment; all of them share one
    store of driven runs. If a run fails, so do the runs that build on it: they are counted in ``failed``,
    with the reasons in ``missing``, and the others go on.

    Args:
        settings: The study.
        path: Its directory.
        resume: Whether to continue a study that was begun there.
        only: Names of the configurations to run now; all if None. The others are missing until they are run.
        runs: Number of seeds to run now; all if None.
        resources: Workers, executor and time limits of the runs.
        on_progress: Called after every generation and every run.

    Raises:
        ConfigError: If an option cannot be used, or the directory holds another study, or something else.
        RunError: If the directory is of another version, the study's own files are damaged, no worker starts,
            or nothing can be written.
    """
    begun = StudyDir.open_to_drive(path) if resume else None  # before what it names is looked up
    tasks = check_study(settings)
    chosen = _chosen(settings, tasks, only)
    seeds = settings.seeds[: settings.runs if runs is None else runs]
    directory = _directory(path, settings, begun, tasks)
    plans = [task.experiment.plan for task in chosen]
    with exclusive_evaluator(
        STUDY, directory.path, resources, run_study_job, plans, evaluator_kind=_StudyEvaluator
    ) as evaluator:
        work = sum(work_of(first) * len(_of(settings, first, seeds)) for first in chosen)
        study = _Study(directory, evaluator, _Meter(evaluator, work, on_progress))
        for first in chosen:
            study.run(first, _of(settings, first, seeds))
    return study.results()


def _chosen(settings: StudySettings, tasks: Sequence[Task], only: Sequence[str] | None) -> list[Task]:
    """Return the first task of each configuration to run, in the study's order."""
    wanted = settings.names if only is None else [settings.configuration(name).name for name in only]
    return [task for task in tasks if task.configuration.name in wanted]


def _of(settings: StudySettings, task: Task, seeds: range) -> range:
    """Return those of some seeds that the configuration of a task is run with."""
    return seeds[: len(settings.seeds_of(task.configuration))]


def _directory(path: str | Path, settings: StudySettings, begun: StudyDir | None, tasks: Sequence[Task]) -> StudyDir:
    """Make the directory of a new study, or accept the one in which it was begun."""
    models = models_of(spec for task in tasks for spec in task.experiment.controllers)
    if begun is None:
        return StudyDir.create(path, settings, models)
    begun.check(settings, models)
    return begun


class _StudyStoppedError(RunError):
    """No run is possible any more, so the study stops."""


class _StudyEvaluator(Evaluator):
    """An evaluator whose own failures (workers, store) stop the study."""

    def run(self, jobs: Sequence[Job]) -> list[RunResult]:
        """Return the results of ``jobs``; raises ``_StudyStoppedError`` where an evaluator raises ``RunError``."""
        try:
            return super().run(jobs)
        except RunError as error:
            raise _StudyStoppedError(str(error)) from None


@dataclass
class _Study:
    """A study being run; ``failed`` is the number of failed runs, and ``reasons`` holds their errors."""

    directory: StudyDir
    evaluator: Evaluator
    meter: _Meter
    reasons: list[str] = field(default_factory=list)
    failed: int = 0

    def run(self, first: Task, seeds: Sequence[int]) -> None:
        """Run one configuration, of which ``first`` is a task, with every seed."""
        name = first.configuration.name
        tasks: list[Task] = []
        with self._costing(name, first, len(seeds)):
            tasks = self._tasks(first.configuration, seeds)
        for task in tasks:
            with self._costing(f"{name}, seed {task.seed}", task, 1):
                self._run(task)

    def results(self) -> StudyResults:
        """Return the finished runs, and each reason of a failure once."""
        results = load_results(self.directory.path)
        reasons = [one for one in self.reasons if not any(line.startswith(one) for line in results.missing)]
        return replace(results, missing=(*reasons, *results.missing), failed=self.failed)

    @contextmanager
    def _costing(self, who: str, task: Task, runs: int) -> Iterator[None]:
        """Count ``runs`` runs as failed if an error occurs, unless that error would make all others fail, too."""
        try:
            yield
        except (WriteError, _StudyStoppedError):
            raise
        except MapBenchError as error:
            self.reasons.append(f"{who}: {error}")
            self.failed += runs
            self.meter.skip(task, runs)

    def _tasks(self, configuration: Configuration, seeds: Sequence[int]) -> list[Task]:
        """Return one task per seed, with the options taken from earlier runs."""
        if configuration.pop_size_from or configuration.cluster_scale_from:
            take_from_earlier(configuration, self.directory, seeds)
        taken = {name: entry["search"] for name, entry in self.directory.read_resolved().items()}
        settings = self.directory.settings
        return [make_task(settings, configuration, seed, taken) for seed in seeds]

    def _run(self, task: Task) -> None:
        """Run one task and re-evaluate its best set."""
        name, seed = task.configuration.name, task.seed
        STUDY.check_there(self.directory.path)
        self._check_parent(task)
        if self.directory.is_finished(name, seed) and self._is_reevaluated(task):
            self.meter.skip(task)
            return
        run_task(task, self.directory, self.evaluator, lambda progress: self.meter.search(task, progress))
        run = load_run(self.directory.run_path(name, seed))
        if task.fresh is not None:
            document = reevaluate(run, task.experiment, task.fresh, self.evaluator)
            write_reevaluation(self.directory.reevaluation_path(name, seed), document)
        self.meter.done(task, run.best_results["fitness"])

    def _is_reevaluated(self, task: Task) -> bool:
        """Whether the best set of a finished run is re-evaluated; refuses a run of another experiment."""
        name, seed = task.configuration.name, task.seed
        rundir = opened(self.directory.run_path(name, seed), task.experiment)
        if task.fresh is None:
            return True
        path, reported = self.directory.reevaluation_path(name, seed), rundir.read_best_results()
        try:
            read_reevaluation(path, reported, RecordedExperiment.of(task.experiment), task.fresh.search.repeats)
        except RunError:
            return False
        return True

    def _check_parent(self, task: Task) -> None:
        parent = task.configuration.of
        if parent is not None and not self.directory.is_finished(parent, task.seed):
            raise RunError(f"builds on {parent}, whose run {task.seed} is not finished")


class _Meter:
    """Measures progress and speed; the unit of work is one run, and the total is an upper bound."""

    def __init__(self, evaluator: Evaluator, total: float, on_progress: OnProgress | None) -> None:
        self.evaluator = evaluator
        self.on_progress = on_progress
        self.total = total
        self.finished = 0.0
        self.skipped = 0.0
        self.began = time.perf_counter()
        self._searched = 0

    def skip(self, task: Task, runs: int = 1) -> None:
        """Count ``runs`` runs like ``task`` that are finished already or have failed."""
        self._searched = 0
        self.skipped += work_of(task) * runs
        self.finished += work_of(task) * runs

    def search(self, task: Task, progress: Progress) -> None:
        """Report a generation of a search."""
        self._searched += progress.driven + progress.reused
        options = task.experiment.search
        share = progress.row["evaluations"] / options.evaluations
        done = share * search_work(task) if options.runs is None else self._searched
        self._report(task, "search", progress.row["best"], self.finished + done)

    def done(self, task: Task, best: float) -> None:
        """Report a finished task."""
        self._searched = 0
        self.finished += work_of(task)
        self._report(task, "done", best, self.finished)

    def _report(self, task: Task, step: Literal["search", "done"], best: float, done: float) -> None:
        if self.on_progress is None:
            return
        seconds = time.perf_counter() - self.began
        worked = done - self.skipped
        self.on_progress(
            StudyProgress(
                configuration=task.configuration.name,
                seed=task.seed,
                step=step,
                best=best,
                fraction=done / self.total if self.total else 1.0,
                seconds_left=seconds / worked * (self.total - done) if worked > 0 else None,
                runs_per_second=self.evaluator.driven / max(seconds, 1e-9),
            )
        )


def work_of(task: Task) -> float:
    """Return the largest number of runs of a task, including its re-evaluation."""
    search = task.experiment.search
    fresh = 0 if task.fresh is None else task.fresh.search.repeats
    return search_work(task) + search.maps_per_set * len(task.experiment.controllers) * fresh


def search_work(task: Task) -> float:
    """Return the largest number of runs in the search of a task; a planned path counts as :data:`PLAN_COST`."""
    search, controllers = task.experiment.search, len(task.experiment.controllers)
    if task.configuration.method in LATER:
        return 0.0
    if task.configuration.method == "path_length":
        return search.evaluations * search.maps_per_set * PLAN_COST
    most = search.evaluations * search.maps_per_set * controllers * search.repeats
    return float(most if search.runs is None else min(most, search.runs))
