"""Maps that benchmarks share: sampled from families, and one of the thesis that has a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from controllers.nav2_params import NavigationParams
from evolution.search import scenario_on
from gym_mapbench.costmap import Costmap, build_static_costmap
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import NoPathError
from gym_mapbench.generator import WITHOUT_ROUTE, FamilySpec, ShapeSettings, default_task, draw_from, sample_map
from gym_mapbench.planners import make_planner
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Scenario


def sampled(count: int, first_seed: int, families: Sequence[Sequence[str]] = (WITHOUT_ROUTE,)) -> list[Scenario]:
    """Return maps on which the robot gets from start to goal, each with a seed of its own, named after its family.

    Args:
        count: Number of maps.
        first_seed: Seed of the first map.
        families: Groups of families, which take turns; those without a route by default.
    """
    shapes, robot = ShapeSettings(), make_robot("turtlebot3_waffle")
    groups = [[FamilySpec(name=name) for name in names] for names in families]
    drawn = [
        draw_from(np.random.default_rng(first_seed + number), groups[number % len(groups)], shapes, robot)
        for number in range(count)
    ]
    return [replace(scenario_on(one.cells, shapes), name=f"{n:03d}_{one.family}") for n, one in enumerate(drawn)]


def full_costmap(scenario: Scenario, navigation: NavigationParams) -> Costmap:
    """Return the inflated costmap of a whole map."""
    params = navigation.global_costmap
    return build_static_costmap(scenario.map, params, params.make_footprint(EnvConfig().robot))


def map_with_path(navigation: NavigationParams, seed: int = 3) -> Scenario:
    """Sample maps of the thesis until one has a path."""
    rng = np.random.default_rng(seed)
    while True:
        grid = GridMap(sample_map(rng, ShapeSettings()))
        scenario = Scenario(grid, *default_task(grid))
        try:
            make_planner("navfn").plan(full_costmap(scenario, navigation), scenario.start, scenario.goal)
        except NoPathError:
            continue
        return scenario
