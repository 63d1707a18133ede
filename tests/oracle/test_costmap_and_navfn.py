"""Costmaps, potentials and paths against all recorded cases of Nav2's own code."""

from __future__ import annotations

import numpy as np
import pytest

from gym_mapbench.costmap import CostmapParams, InflationLayer, build_static_costmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.planners import NavfnParams, NavfnPlanner
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose
from tests.oracle_data import LYRICAL, RECORDINGS

STORED = 1e-9  # paths are recorded rounded to this
NEAR = 1e-3  # cells: the target of ``mapbench validate``; Lyrical's paths differ by float32 steps, the cause is unknown


class Recorded:
    """One recording, with the costmaps and the task it was made from."""

    def __init__(self, recording):
        self.config = recording.spec
        self.plans, self.units = recording.load("plans"), recording.load("units")
        self.planner = NavfnPlanner(NavfnParams(release=recording.release))
        self.path_error = NEAR * self.config["resolution"] if recording.release == "lyrical" else STORED
        self.start, self.goal = Pose(*self.config["start"]), Pose(*self.config["goal"])
        self.footprint = Footprint.from_radius(self.config["robot_radius"], self.config["footprint_padding"])
        layer = InflationLayer(**{k: self.config[k] for k in ("inflation_radius", "cost_scaling_factor")})
        params = CostmapParams.example_global(inflation_layer=layer, release=recording.release)
        occupied = recording.arrays("maps.npz")["occupied"]
        grids = [GridMap.from_image_array(cells, self.config["resolution"]) for cells in occupied]
        self.costmaps = [build_static_costmap(grid, params, self.footprint) for grid in grids]


@pytest.fixture(scope="module", params=[*RECORDINGS, LYRICAL])
def recorded(request):
    return Recorded(request.param)


def plan(recorded, costmap, start):
    try:
        return recorded.planner.plan(costmap, start, recorded.goal)
    except NoPathError:
        return np.empty((0, 3))


def test_footprint(recorded):
    assert recorded.footprint.inscribed_radius == pytest.approx(float(recorded.plans["inscribed_radius"]), abs=1e-9)
    circumscribed = float(recorded.plans["circumscribed_radius"])
    assert recorded.footprint.circumscribed_radius == pytest.approx(circumscribed, abs=1e-9)


def test_costmaps_are_identical(recorded):
    for costmap, expected in zip(recorded.costmaps, recorded.plans["costmap"], strict=True):
        assert np.array_equal(costmap.costs, expected[::-1])


def test_potentials_are_identical(recorded):
    plans = recorded.plans
    if "potential" not in plans:
        pytest.skip("potentials were not recorded")
    index = {int(map_id): k for k, map_id in enumerate(plans["potential_map_id"])}
    for i, costmap in enumerate(recorded.costmaps):
        potential = recorded.planner.potential(costmap, recorded.start, recorded.goal)
        reached = np.isfinite(potential)
        assert reached.sum() == plans["pot_n_reached"][i]
        assert potential[reached].max() == plans["pot_max"][i]
        assert potential[reached].mean(dtype=float) == pytest.approx(plans["pot_mean"][i], rel=1e-9)
        if int(plans["map_id"][i]) in index:
            expected = plans["potential"][index[int(plans["map_id"][i])]][::-1]
            assert np.array_equal(np.where(reached, potential, np.nan), expected, equal_nan=True)


def test_paths_are_identical(recorded):
    plans = recorded.plans
    for i, costmap in enumerate(recorded.costmaps):
        path = plan(recorded, costmap, recorded.start)
        expected = plans["path"][plans["path_offset"][i] : plans["path_offset"][i + 1]]
        assert path.shape == expected.shape
        assert bool(plans["found"][i]) == (len(path) > 0)
        assert np.abs(path - expected).max(initial=0) <= recorded.path_error
        if len(path):
            length = np.hypot(*np.diff(path[:, :2], axis=0).T).sum()
            assert length == pytest.approx(plans["path_length"][i], abs=max(1e-6, recorded.path_error))


def test_paths_from_anywhere_are_identical(recorded):
    units = recorded.units
    map_index = {int(map_id): i for i, map_id in enumerate(recorded.plans["map_id"])}
    for i, start in enumerate(units["plan_from"]):
        path = plan(recorded, recorded.costmaps[map_index[int(units["map_id"][i])]], Pose(*start))
        expected = units["path"][units["path_offset"][i] : units["path_offset"][i + 1]]
        assert path.shape == expected.shape
        assert np.abs(path - expected).max() <= recorded.path_error
