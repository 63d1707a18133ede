"""BARN's task: the benchmark's robot, goal, clock and score on its published worlds.

Source: the BARN Challenge (Xiao et al., 2022 on): success within 1 m of the goal, any contact fails, 100 s,
the clock starts after 0.1 m of motion.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from evolution.benchmark.runs import Benchmark
from evolution.driving import DriveSettings
from evolution.files import Row
from evolution.statistics import rank_correlation
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.mapio.barn import GOAL_RADIUS, TIME_LIMIT, read_barn_path, read_dwa_reference, world_files
from gym_mapbench.metrics import score_barn
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario

PREFIX = "barn:"
TOP_SPEED = 2.0
REFINEMENT = 3
"""A lattice cell of 0.15 m becomes 3 x 3 cells of 0.05 m, Nav2's usual resolution."""

INFLATION_RADIUS = 0.30
FOOTPRINT_PADDING = 0.1
REFERENCE = "dwa_reference.csv"
RULED = ("robot", "time_limit", "collision_ends_episode", "xy_goal_tolerance", "yaw_goal_tolerance")
"""Fields of the env whose values are BARN's."""


@dataclass(frozen=True)
class BarnScore:
    """One run as BARN scores it; ``time`` is on BARN's clock, s."""

    world: str
    controller: str
    success: bool
    time: float
    score: float


def load_barn(source: str) -> list[Scenario]:
    """Load the worlds of ``barn:DIR`` at Nav2's resolution."""
    return [replace(scenario, map=refined(scenario.map, REFINEMENT)) for scenario in load_scenarios(source)]


def refined(grid: GridMap, factor: int) -> GridMap:
    """Cut every cell into ``factor`` x ``factor`` cells."""
    cells = np.repeat(np.repeat(grid.occupancy, factor, axis=0), factor, axis=1)
    return GridMap(cells, grid.resolution / factor, grid.origin)


def barn_settings(settings: DriveSettings) -> DriveSettings:
    """Overlay settings with BARN's rules: Jackal, any contact ends the run, goal within 1 m at any heading.

    The env decides when the goal is reached. Nav2's own checker keeps its tolerance, because RPP would turn on the
    spot for ever if that were larger than its lookahead distance.
    """
    environment = settings.environment.replace(
        robot=make_robot("jackal"),
        time_limit=TIME_LIMIT,
        collision_ends_episode=True,
        xy_goal_tolerance=GOAL_RADIUS,
        yaw_goal_tolerance=math.pi,
    )
    navigation = settings.navigation.replace(
        local_costmap=_costmap(settings.navigation.local_costmap),
        global_costmap=_costmap(settings.navigation.global_costmap),
    )
    return settings.replace(environment=environment, navigation=navigation, own_goal_check=False)


def refuse_ruled(given: Mapping[str, object]) -> None:
    """Refuse values in the place of BARN's.

    Args:
        given: Options by name; None for an option that was not given.

    Raises:
        ConfigError: Naming the first option that was given.
    """
    for name, value in given.items():
        if value is not None:
            raise ConfigError(f"{name}: expected none beside {PREFIX}DIR, whose rules set it, got {value!r:.80}")


def official_lengths(source: str) -> dict[str, float]:
    """Return the path lengths that BARN scores with, by world, m.

    Args:
        source: ``barn:DIR``, or ``barn:FILE`` for one world.

    Raises:
        ConfigError: If a world's published path, from which the optimal time comes, is missing.
    """
    place = Path(source.removeprefix(PREFIX))
    lengths = {}
    for world in [place] if place.is_file() else world_files(place):
        path = read_barn_path(world)
        if path is None:
            raise ConfigError(
                f"{world}: expected its published path ({world.stem.replace('world', 'path')}.npy) nearby"
            )
        lengths[world.stem] = path.official_length
    return lengths


def score_runs(benchmark: Benchmark, lengths: Mapping[str, float], low: float) -> list[BarnScore]:
    """Score every run.

    Args:
        benchmark: The runs.
        lengths: What :func:`official_lengths` returns for their worlds.
        low: Being faster than ``low`` times the optimal time earns no more (4 in 2022, 2 since).
    """
    return [_score(row, lengths[row["map"]], low) for row in benchmark.rows]


def reference_of(source: str) -> Mapping[str, float]:
    """Return the published mean times of DWA by world, s; empty if the folder has no such file."""
    path = Path(source.removeprefix(PREFIX)) / REFERENCE
    if not path.is_file():
        return {}
    return {world: reference.mean_time for world, reference in read_dwa_reference(path).items()}


def correlation_with(reference: Mapping[str, float], scores: Sequence[BarnScore]) -> tuple[float, float, float, int]:
    """Return Spearman's rho between our mean times and the published ones, its interval, and the number of worlds."""
    times: dict[str, list[float]] = {}
    for one in scores:
        if one.success and math.isfinite(reference.get(one.world, math.nan)):
            times.setdefault(one.world, []).append(one.time)
    rho, low, high = rank_correlation([np.mean(ours) for ours in times.values()], [reference[name] for name in times])
    return rho, low, high, len(times)


def _score(row: Row, length: float, low: float) -> BarnScore:
    success, time = row["outcome"] == "goal", row["time_s"] - (row.get("motion_start") or 0.0)
    score = score_barn(success, time, length / TOP_SPEED, low)
    return BarnScore(row["map"], row["controller"], success, time, score)


def _costmap(params: CostmapParams) -> CostmapParams:
    """Change a costmap to BARN's published one: the robot's footprint with 0.1 m of padding, 0.30 m of inflation."""
    inflation = params.inflation_layer.replace(inflation_radius=INFLATION_RADIUS)
    return params.replace(
        robot_radius=None, footprint=None, footprint_padding=FOOTPRINT_PADDING, inflation_layer=inflation
    )
