"""run_sweep(): run every controller on every map in every world, and record the runs in a directory.

::

    sweep.json        the settings, and the versions it was run with
    results.sqlite    every run
    runs.csv          one line per run
    effects.csv       one line per world and controller
    figures/          success, time and recoveries by world
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from pathlib import Path

from evolution.benchmark import bench_row
from evolution.driving import DEFAULT_RESOURCES, Job, OnRun, Resources, RunResult, check_room, run_job, try_controllers
from evolution.files import DirectoryKind, Row, Table, Tabled, csv_of, read_csv, write_text
from evolution.pictures import effects_figure, save_figure
from evolution.runs import exclusive_evaluator
from evolution.studies.sweep.effects import effect_rows
from evolution.studies.sweep.settings import SweepSettings
from gym_mapbench.errors import ConfigError, RunError, refuse_unknown
from gym_mapbench.world.scenario import Scenario

SWEEP = DirectoryKind("sweep", "sweep.json", format_version=1, remade=True)
RUNS, EFFECTS, FIGURE = "runs.csv", "effects.csv", "figures/effects"


@dataclass(frozen=True)
class SweepResults(Tabled):
    """A sweep as far as it has come.

    Args:
        path: Its directory.
        settings: The sweep.
        runs: One row per run.
    """

    path: Path
    settings: SweepSettings
    runs: tuple[Row, ...]

    @property
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """``effects`` (see :func:`~evolution.studies.sweep.effects.effect_rows`) and ``runs``."""
        return {"effects": lambda: Table(self._effects(), self.settings.name), "runs": lambda: Table(self.runs)}

    def _effects(self) -> list[Row]:
        driven = [name for name in self.settings.worlds if any(row["world"] == name for row in self.runs)]
        return effect_rows(self.runs, driven, [spec.name for spec in self.settings.specs])


def run_sweep(
    settings: SweepSettings,
    path: str | Path,
    *,
    resume: bool = False,
    only: Sequence[str] | None = None,
    maps: int | None = None,
    resources: Resources = DEFAULT_RESOURCES,
    on_run: OnRun | None = None,
) -> SweepResults:
    """Run or continue a sweep; it can be killed at any moment. The tables have all runs that the directory holds.

    Args:
        settings: The sweep.
        path: Its directory.
        resume: Whether to continue a sweep that was begun there.
        only: Names of the worlds to run now, besides the first; all if None.
        maps: Number of maps to run on now; all if None.
        resources: Workers, executor and time limits of the runs.
        on_run: Called after each run with its job, its result, and how many are left.

    Raises:
        ConfigError: If an option cannot be used, or the directory holds another sweep, or something else.
        RunError: If no worker starts, or nothing can be written.
    """
    path = Path(path)
    worlds = _chosen(settings, only)
    plans = {name: settings.plan(name) for name in settings.worlds}
    scenarios = settings.scenarios()
    for name in worlds:
        _check(settings, name, scenarios[:maps])
    SWEEP.begin_or_resume(path, {"sweep": settings.model_dump(mode="json")}, itemgetter("sweep"), resume=resume)
    every = [(name, job) for name in plans for scenario in scenarios for job in plans[name].jobs(scenario)]
    wanted = [job for name in worlds for scenario in scenarios[:maps] for job in plans[name].jobs(scenario)]
    with exclusive_evaluator(SWEEP, path, resources, run_job, [plans[name] for name in worlds], on_run) as evaluator:
        evaluator.run(wanted)
        results = evaluator.store.get_many(job.key for _, job in every)
        rows = tuple(_row(name, job, results[job.key]) for name, job in every if job.key in results)
        return _written(SweepResults(path, settings, rows))


def read_sweep(path: str | Path) -> SweepSettings:
    """Return the settings of the sweep in a directory.

    Raises:
        RunError: If it is not a sweep, or damaged.
    """
    config = SWEEP.open(Path(path))
    try:
        return SweepSettings.from_mapping(config.get("sweep"), str(Path(path) / SWEEP.mark))
    except ConfigError as error:
        raise RunError(str(error)) from None


def load_sweep(path: str | Path) -> SweepResults:
    """Read the directory of a sweep.

    Raises:
        RunError: If it is not a sweep, was not finished, or is damaged.
    """
    path, settings = Path(path), read_sweep(path)
    if not (path / RUNS).is_file():
        raise RunError(f"{path}: nothing was finished; continue it with --resume")
    return SweepResults(path, settings, tuple(read_csv(path / RUNS)))


def _chosen(settings: SweepSettings, only: Sequence[str] | None) -> list[str]:
    """Return the worlds to run; the first is always among them."""
    for name in only or ():
        refuse_unknown("world", name, settings.worlds)
    first = next(iter(settings.worlds))
    return [name for name in settings.worlds if only is None or name in only or name == first]


def _check(settings: SweepSettings, world: str, scenarios: Sequence[Scenario]) -> None:
    """Refuse a world in which no controller can run."""
    try:
        try_controllers(settings.specs, settings.world(world))
        check_room(scenarios, settings.world(world))
    except ConfigError as error:
        raise ConfigError(f"{settings.name}: {world}: {error}") from None


def _row(world: str, job: Job, result: RunResult) -> Row:
    """Return one line of ``runs.csv``, without wall-clock values, which differ between repetitions."""
    return {"world": world, **bench_row(job, replace(result, timings={}))}


def _written(results: SweepResults) -> SweepResults:
    """Write the tables and the figure."""
    effects = results.table()
    write_text(results.path / RUNS, csv_of(list(results.runs)))
    write_text(results.path / EFFECTS, effects.to_csv())
    save_figure(effects_figure(list(effects)), results.path / FIGURE)
    return results
