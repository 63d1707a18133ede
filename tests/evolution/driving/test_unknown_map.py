"""Driving without the map: the first path knows nothing of the walls, and the robot finds its way all the same."""

from __future__ import annotations

import sys

import numpy as np
import pytest

from controllers.rl import as_controller
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, drive, try_controllers
from evolution.driving.unknown_map import check_observed, without_map
from gym_mapbench.costmap import LayeredCostmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario


def walled_grid(origin=(0.0, 0.0)):
    """Return 8 m x 4 m with a wall across the straight way, open above 2.8 m; the lidar sees it only from nearby."""
    occupancy = np.zeros((80, 160), dtype=np.bool_)
    occupancy[[0, -1]] = occupancy[:, [0, -1]] = True
    occupancy[:56, 88:92] = True
    return GridMap(occupancy, 0.05, origin)


def episode(unknown_map, origin=(0.0, 0.0)):
    grid = walled_grid(origin)
    ends = [Pose(x + origin[0], 0.8 + origin[1], 0.0) for x in (0.8, 7.2)]
    settings = DriveSettings(navigation="thesis", unknown_map=unknown_map)
    plan = JobPlan((ControllerSpec(name="rpp"),), settings, root_seed=3)
    (job,) = plan.jobs(Scenario(grid, *ends, "walled"))
    return grid, drive(job)


def crosses_walls(grid, path):
    return any(grid.occupancy[cell] for x, y, _ in path if (cell := grid.world_to_cell(x, y)))


@pytest.mark.parametrize("origin", [(0.0, 0.0), (-7.5, 2.25)])
def test_the_way_is_found_by_looking(origin):
    grid, seeing = episode(unknown_map=True, origin=origin)
    assert crosses_walls(grid, seeing.path)
    assert seeing.outcome == "goal"
    _, knowing = episode(unknown_map=False, origin=origin)
    assert not crosses_walls(grid, knowing.path)
    assert knowing.outcome == "goal"
    assert seeing.time > knowing.time


def test_the_costmap_lies_where_the_map_is_and_knows_nothing():
    grid = walled_grid((-7.5, 2.25))
    navigation = without_map(DriveSettings(navigation="thesis").navigation, grid)
    costmap = LayeredCostmap(navigation.global_costmap, grid, Footprint.from_radius(0.2, 0.0)).update(Pose(-5.0, 4.0))
    assert costmap.costs.shape == grid.shape
    assert (costmap.origin_x, costmap.origin_y) == grid.origin
    rows, cols = np.nonzero(costmap.costs != 255)
    known = np.hypot(-7.5 + 0.05 * (cols + 0.5) - -5.0, 2.25 + 0.05 * (rows + 0.5) - 4.0)
    assert 0 < known.max() < 0.25  # the cells under the robot are set free
    assert navigation.planner.params["allow_unknown"] is True


@pytest.mark.parametrize("shape", [(7, 5), (81, 100), (1, 1)])
def test_the_costmap_holds_the_whole_map(shape):
    grid = GridMap(np.zeros(shape, dtype=np.bool_), 0.07)
    costmap = without_map(DriveSettings(navigation="thesis").navigation, grid).global_costmap
    rows, cols = shape
    assert cols * 0.07 <= costmap.width + 1e-9 < cols * 0.07 + 1
    assert rows * 0.07 <= costmap.height + 1e-9 < rows * 0.07 + 1


def test_a_costmap_without_the_map_stays_as_it_is():
    navigation = DriveSettings(navigation="thesis").navigation
    assert without_map(navigation, walled_grid()).local_costmap == navigation.local_costmap
    rolling = navigation.replace(global_costmap=navigation.global_costmap.replace(rolling_window=True, width=9))
    costmap = without_map(rolling, walled_grid()).global_costmap
    assert (costmap.rolling_window, costmap.width, costmap.plugins) == (True, 9, ("obstacle_layer", "inflation_layer"))


def test_a_costmap_that_nothing_would_fill_is_refused():
    navigation = DriveSettings(navigation="thesis").navigation
    blind = navigation.replace(global_costmap=navigation.global_costmap.replace(plugins=("static_layer",)))
    DriveSettings(navigation=blind)
    with pytest.raises(ConfigError, match=r"unknown_map: .* in the global_costmap, .* got static_layer"):
        DriveSettings(navigation=blind, unknown_map=True)


@pytest.mark.parametrize(
    ("keys", "seen"), [(("goal", "path"), "path"), (("costmap", "goal", "path"), "path and costmap")]
)
def test_a_policy_that_observes_the_map_is_refused(tmp_path, monkeypatch, keys, seen):
    specs = (ControllerSpec(name="rpp"), ControllerSpec(name="mine", kind="seeing_policy:make"))
    (tmp_path / "seeing_policy.py").write_text(
        "from controllers.rl import as_controller\n\n"
        f"def make():\n    return as_controller(lambda observation: (0.1, 0.0), 'ahead', {keys})\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "seeing_policy", raising=False)
    settings = DriveSettings(navigation="thesis")
    try_controllers(specs, settings)
    unknown = settings.replace(unknown_map=True)
    (_, job) = JobPlan(specs, unknown, root_seed=3).jobs(Scenario(walled_grid(), Pose(0.8, 0.8), Pose(7.2, 0.8)))
    for attempt in (lambda: try_controllers(specs, unknown), lambda: drive(job)):
        with pytest.raises(ConfigError, match=rf"unknown_map: .* got mine, which observes {seen}$"):
            attempt()


def test_a_policy_that_observes_the_scan_alone_drives_without_the_map():
    blind = as_controller(lambda observation: (0.1, 0.0), "ahead", ("goal", "velocity", "scan"))
    check_observed(blind, "ahead")
