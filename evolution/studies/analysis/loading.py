"""Reads a study back from its directory, finished or not, and lists missing and damaged parts."""

from __future__ import annotations

import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from evolution.files import Versions, check, counted, differences, written_elsewhere
from evolution.runs import CONFIG, RecordedExperiment, RunDir, errors_in, load_run, results_in
from evolution.search import experiment_of
from evolution.studies.analysis.results import StudyResults, StudyRun
from evolution.studies.directory import RESOLVED, STUDY, StudyDir
from evolution.studies.reevaluation import read_reevaluation
from evolution.studies.settings import Configuration
from gym_mapbench.errors import MapBenchError, RunError, UntrustedError
from gym_mapbench.ros_params import overlay
from gym_mapbench.trust import refuse_code


def load_results(path: str | Path) -> StudyResults:
    """Read the directory of a study, finished or not.

    Raises:
        RunError: If the directory is not a study, or of another format.
    """
    directory = StudyDir.open(path)
    reader = _Reader(directory)
    reader.read()
    return StudyResults(
        directory.path,
        directory.settings,
        str(directory.config.get("version")),
        reader.libraries,
        reader.resolved,
        tuple(reader.runs),
        tuple(reader.missing),
    )


class _Reader:
    """Reads one run after the other and lists missing and damaged parts."""

    def __init__(self, directory: StudyDir) -> None:
        self.directory = directory
        self.libraries: Mapping[str, str] = {}
        self.resolved: Mapping[str, Any] = {}
        self.runs: list[StudyRun] = []
        self.missing: list[str] = []
        self.resume = f"mapbench study {shlex.quote(str(directory.path))} --resume"

    def read(self) -> None:
        """Read everything."""
        with self._noted("the versions it was run with are unknown"):
            check(Versions, self.directory.config, self.directory.path / STUDY.mark)
            self.libraries = self.directory.config["libraries"]
            self.missing += written_elsewhere(self.directory.config)
        with self._noted():
            self.resolved = self.directory.read_resolved()
        self.missing += self._taken_from_few()
        for configuration in self.directory.settings.configurations:
            self._read_configuration(configuration)

    @contextmanager
    def _noted(self, advice: str = "", who: str = "") -> Iterator[None]:
        """Note an error, whom it is about and what to do, and go on."""
        try:
            yield
        except MapBenchError as error:
            self.missing.append(f"{who}{': ' if who else ''}{error}{'; ' if advice else ''}{advice}")

    def _taken_from_few(self) -> list[str]:
        """Return lines about options taken from fewer seeds than a configuration has."""
        settings = self.directory.settings
        wanted = {one.name: len(settings.seeds_of(one)) for one in settings.configurations}
        few = {name: entry for name, entry in self.resolved.items() if len(entry["seeds"]) < wanted.get(name, 0)}
        folders = [self.directory.path / part / name for name in few for part in ("runs", "searches", "reevaluation")]
        remove = shlex.join(["rm", "-r", *map(str, [self.directory.path / RESOLVED, *filter(Path.exists, folders)])])
        return [
            f"{name}: {' and '.join(f'{key} {value:.4g}' for key, value in entry['search'].items())} taken from "
            f"{len(entry['seeds'])} of {counted(wanted[name], 'seed')}; to take it from all: {remove} and then "
            f"{self.resume}"
            for name, entry in few.items()
        ]

    def _read_configuration(self, configuration: Configuration) -> None:
        absent = []
        seeds = self.directory.settings.seeds_of(configuration)
        for seed in seeds:
            path = self.directory.run_path(configuration.name, seed)
            if not path.is_dir():
                absent.append(seed)
                continue
            who = f"{configuration.name}, seed {seed}"
            with self._noted(self._repeat(path), who):
                self._read_run(configuration, seed, who)
        self.missing += _absent(configuration.name, absent, len(seeds))
        self._check_best(configuration)

    def _repeat(self, path: Path) -> str:
        """Return how to repeat the run in a directory."""
        return f"to repeat the run: {shlex.join(['rm', '-r', str(path)])} and then {self.resume}"

    def _check_best(self, configuration: Configuration) -> None:
        """Read all files of the best run, because it is shown; a damaged one is replaced by the next best."""
        of_this = [run for run in self.runs if run.configuration == configuration]
        for run in sorted(of_this, key=lambda run: run.fitness):
            with self._noted(self._repeat(run.path), f"{configuration.name}, seed {run.seed}"):
                load_run(run.path)
                return
            self.runs = [other for other in self.runs if other is not run]

    def _read_run(self, configuration: Configuration, seed: int, who: str) -> None:
        """Read one run and its re-evaluation, and list their problems."""
        rundir = RunDir.open(self.directory.run_path(configuration.name, seed))
        if not rundir.finished:
            done, budget = (rundir.checkpoint or {"evaluations": 0}), rundir.config["search"]["evaluations"]
            self.missing.append(f"{who}: stopped after {done['evaluations']} of {counted(budget, 'evaluation')}")
            return
        experiment = self._experiment(rundir, configuration, seed)
        rundir.check_files()
        run = StudyRun(
            configuration,
            seed,
            rundir.path,
            experiment,
            rundir.read_generations(),
            rundir.read_best_results(),
            rundir.read_timing(),
        )
        with self._noted(f"{self.resume} repeats it", who):
            run = self._with_reevaluation(run, who)
        if rundir.config["version"] != self.directory.config.get("version"):
            self.missing += [f"{who}: {line}" for line in written_elsewhere(rundir.config)]
        self.missing += [f"{who}: {line}" for line in _errors(run)]
        self.runs.append(run)

    def _experiment(self, rundir: RunDir, configuration: Configuration, seed: int) -> RecordedExperiment:
        """Read the experiment of a run, and refuse it if it is not that of its configuration.

        Only options in the study are compared, and never a parameter file, which may have changed since. A world that
        names code cannot be read without running it: it is shown as it was recorded, and not compared.
        """
        stated = self.directory.settings.document(configuration, seed, self._taken)
        run = {name: value for name, value in stated.get("run", {}).items() if name != "navigation"}
        path, read = rundir.path / CONFIG, _looked_up
        try:
            refuse_code([rundir.config["run"], run], path)
        except UntrustedError:
            read, run = RecordedExperiment.read, {}
        found = read(rundir.config, str(path))
        laid_over = overlay(rundir.config, {**stated, "run": run})
        if laid_over == rundir.config:
            return found
        said = read(laid_over, str(path))
        for name, was, now in differences(found.document(), said.document()):
            raise RunError(f"{path}: belongs to another experiment: {name} is {was!r:.80}, expected {now!r:.80}")
        return found

    @property
    def _taken(self) -> dict[str, Any]:
        return {name: entry["search"] for name, entry in self.resolved.items()}

    def _with_reevaluation(self, run: StudyRun, who: str) -> StudyRun:
        """Add the re-evaluation of a run."""
        seeds = self.directory.settings.reevaluation.seeds
        path = self.directory.reevaluation_path(run.configuration.name, run.seed)
        if seeds == 0:
            return run
        if not path.is_file():
            self.missing.append(f"{who}: not re-evaluated yet")
            return run
        return replace(run, reevaluation=read_reevaluation(path, run.best_results, run.experiment, seeds))


def _looked_up(document: Mapping[str, Any], where: str) -> RecordedExperiment:
    """Return an experiment with all options that a document leaves out; the names in it are looked up."""
    return RecordedExperiment.of(experiment_of(document, where))


def _absent(name: str, seeds: Sequence[int], runs: int) -> list[str]:
    if not seeds:
        return []
    if len(seeds) == runs:
        return [f"{name}: none of its {counted(runs, 'search', 'searches')} was begun"]
    were, named = ("was", "seed") if len(seeds) == 1 else ("were", "seeds")
    return [f"{name}: {len(seeds)} of {runs} searches {were} not begun ({named} {', '.join(map(str, seeds))})"]


def _errors(run: StudyRun) -> list[str]:
    """Report the runs on the best set that ended in an error."""
    names = run.experiment.names
    held_out = run.reevaluation.results if run.reevaluation else ()
    return [
        *errors_in(results_in(run.best_results, names), names, "in the search"),
        *errors_in(held_out, names, "on held-out seeds"),
    ]
