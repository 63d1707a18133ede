"""Whole runs, driven in the Box2D env: outcomes, travel times and trajectories compared with the recorded ones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats

from controllers.navigator.navigator import Navigator
from evolution.driving import EXECUTORS, RUN_TIMEOUT_SECONDS, WorkerSetup, environment_for, run_episode, warm_up
from evolution.validation.measures import Cases, Measure
from evolution.validation.oracle import Oracle, Preset
from evolution.validation.setup import KINDS, make_follower, navigation_of, robot_of
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import RunError
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Scenario

NEAR_CONTACT = 0.005
"""m; recorded runs this close to touching a wall are counted apart: Box2D stops a robot that the recording let pass."""

EVERYWHERE = ("DWB", "RPP", "MPPI")
"""Controllers that every recording should have; the others are in the table only where they were recorded."""

SAME_TIMES = ("<= 0", "<= 0")
TIME_TARGETS = {**dict.fromkeys(KINDS, SAME_TIMES), "MPPI": ("<= 0.005", "")}
"""Targets for the relative errors of the travel times: of their median and of their 95th percentile."""


@dataclass(frozen=True)
class RunTask:
    """One recorded run to be re-run."""

    directory: Path
    preset: str
    index: int


@dataclass(frozen=True)
class DrivenRun:
    """A recorded run and ours under the same conditions.

    Args:
        record: The recorded run.
        preset: Name of its preset.
        success: Whether we reached the goal without touching a wall.
        time: Duration of our run, s.
        reason: How our run ended.
        deviation: Largest distance between the two robots at equal times, m; NaN if one of them touched a wall, which
            the recorded robot passes through.
    """

    record: dict[str, Any]
    preset: str
    success: bool
    time: float
    reason: str
    deviation: float = math.nan

    @property
    def name(self) -> str:
        """The run in words."""
        record = self.record
        seed = "" if record.get("seed") is None else f" seed {record['seed']}"
        return (
            f"preset {self.preset} map {record['map']} {record['controller']}/{record['variant']} "
            f"{record['local_costmap']}{seed}"
        )

    @property
    def near_contact(self) -> bool:
        """Whether the recorded run came within 5 mm of touching a wall."""
        clearance = self.record["min_clearance"]
        return clearance is not None and abs(clearance) < NEAR_CONTACT


def drive_recorded(oracle: Oracle, workers: int) -> list[DrivenRun]:
    """Re-run every recorded run of our controllers; the results are the same for any number of workers.

    Raises:
        RunError: If a run takes too long.
    """
    tasks = [
        RunTask(oracle.directory, preset.name, index)
        for preset in oracle.presets
        for index, record in enumerate(oracle.runs(preset))
        if record["controller"] in KINDS
    ]
    with EXECUTORS.get("processes")(WorkerSetup(workers, RUN_TIMEOUT_SECONDS, warm_up)) as pool:
        try:
            return list(pool.map(drive_again, tasks))
        except TimeoutError:
            limit = f"{RUN_TIMEOUT_SECONDS:g} s"
            raise RunError(f"{oracle.directory}: expected runs of at most {limit}, got one that takes longer") from None


def closed_loop_measures(driven: Sequence[DrivenRun]) -> list[Measure]:
    """Agreement of outcomes, errors of times and trajectories, and rank correlation over the runs both finished."""
    outcomes, near = Cases("outcome_agreement", ">= 0.99"), Cases("outcome_agreement_near_contact", "")
    for run in driven:
        cases = near if run.near_contact else outcomes
        cases.add(float(run.success != bool(run.record["strict_success"])), f"{run.name} ({run.reason})")
    both = [run for run in driven if run.success and run.record["strict_success"]]
    measures = [outcomes.agreement(), near.agreement()]
    kinds = [kind for kind in KINDS if kind in EVERYWHERE or any(run.record["controller"] == kind for run in driven)]
    for kind in kinds:
        measures += _time_measures(kind, [run for run in both if run.record["controller"] == kind])
    for kind in kinds:
        measures.append(_trajectory_measure(kind, [run for run in driven if run.record["controller"] == kind]))
    return [*measures, _spearman(both)]


def disagreements(driven: Sequence[DrivenRun]) -> list[str]:
    """Describe every run whose outcome differs from the recorded one."""
    return [
        f"{run.name}: recorded {run.record['reason']} at {run.record['time']:.2f} s "
        f"(clearance {run.record['min_clearance']}), ours {run.reason} at {run.time:.2f} s"
        for run in driven
        if run.success != bool(run.record["strict_success"])
    ]


def _trajectory_measure(kind: str, runs: Sequence[DrivenRun]) -> Measure:
    """The largest deviation of all runs; for MPPI the median, as rounding in its soft-max grows in tight passages."""
    largest = kind != "MPPI"
    cases = Cases(
        f"trajectory_err_{'max' if largest else 'median'}_{kind.lower()}", "<= 1e-5" if largest else "<= 0.01"
    )
    for run in runs:
        if not math.isnan(run.deviation):
            cases.add(run.deviation, run.name)
    return cases.largest() if largest else cases.median()


def _time_measures(kind: str, runs: Sequence[DrivenRun]) -> list[Measure]:
    """Median and 95th percentile of the relative errors; for MPPI, of the median time over its seeds on each map."""
    of_median, of_most = TIME_TARGETS[kind]
    cases = Cases(f"time_err_median_{kind.lower()}", of_median)
    groups: dict[tuple[Any, ...], list[DrivenRun]] = {}
    for run in runs:
        record = run.record
        key = (run.preset, record["map"], record["variant"], record["local_costmap"])
        groups.setdefault(key if kind == "MPPI" else (*key, run.name), []).append(run)
    for members in groups.values():
        ours = float(np.median([run.time for run in members]))
        recorded = float(np.median([run.record["time"] for run in members]))
        cases.add(abs(ours - recorded) / recorded, members[0].name)
    return [cases.median(), cases.percentile(95, f"time_err_p95_{kind.lower()}", of_most)]


def _spearman(both: Sequence[DrivenRun]) -> Measure:
    ours, recorded = [run.time for run in both], [run.record["time"] for run in both]
    enough = len(both) > 2 and np.ptp(ours) > 0 and np.ptp(recorded) > 0
    rho = float(stats.spearmanr(ours, recorded).statistic) if enough else float("nan")
    return Measure("spearman", rho, len(both), target=">= 0.99")


def drive_again(task: RunTask) -> DrivenRun:
    """Drive one recorded run under its recorded conditions."""
    oracle = _open(task.directory)
    preset = next(preset for preset in oracle.presets if preset.name == task.preset)
    record = oracle.runs(preset)[task.index]
    episode = _drive(oracle, preset, record)
    free = episode.first_contact_time is None
    deviation = _deviation(oracle, preset, record, episode) if free else math.nan
    reason = episode.reason or episode.outcome
    return DrivenRun(record, preset.name, episode.success and free, episode.time, reason, deviation)


def _deviation(oracle: Oracle, preset: Preset, record: dict[str, Any], episode: Episode) -> float:
    """Largest distance between the two robots at equal times, m; NaN if the recorded one touched a wall."""
    if record.get("first_contact_time") is not None or "index" not in record:
        return math.nan
    runs = oracle.table("runs", preset)
    begin, end = runs["offset"][record["index"] : record["index"] + 2]
    recorded, ours = runs["traj"][begin:end, :2], episode.trajectory[:, :2]
    common = min(len(recorded), len(ours))
    return float(np.hypot(*(recorded[:common] - ours[:common]).T).max()) if common else math.nan


def _drive(oracle: Oracle, preset: Preset, record: dict[str, Any]) -> Episode:
    simulation = oracle.config["simulation"]
    config = EnvConfig(
        robot=robot_of(oracle, preset),
        physics_hz=simulation["integration_hz"],
        control_hz=simulation["control_hz"],
        time_limit=simulation["timeout"],
    )
    kind, variant = record["controller"], record["variant"]
    follower = make_follower(oracle, kind, variant, record.get("seed"))
    navigation = navigation_of(oracle, oracle.costmap_of(preset, kind, variant), record["local_costmap"], variant)
    # In the recordings of Humble, failure_tolerance also covers a ControllerAbort, which in Nav2 it does not.
    navigator = Navigator(follower, navigation, kind, abort_is_exception=oracle.release == "humble")
    scenario = Scenario(_maps(oracle.directory, preset)[record["map"]], preset.start, preset.goal)
    env = environment_for(config, navigator)
    return run_episode(env, navigator, scenario, name=kind, seed=0)


@lru_cache(maxsize=1)
def _open(directory: Path) -> Oracle:
    return Oracle(directory)


@lru_cache(maxsize=8)
def _maps(directory: Path, preset: Preset) -> dict[int, GridMap]:
    return _open(directory).maps(preset)
