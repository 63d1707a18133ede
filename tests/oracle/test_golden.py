"""Two recorded cases that need no recorded data at hand; the full comparison is beside."""

from __future__ import annotations

import base64
import hashlib
import json
import zlib

import numpy as np
import pytest

from gym_mapbench.costmap import CostmapParams, InflationLayer, build_static_costmap
from gym_mapbench.planners import NavfnPlanner
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose
from tests.oracle.write_golden import EVERY, GOLDEN


@pytest.mark.parametrize("case", json.loads(GOLDEN.read_text()), ids=["A", "B"])
def test_nav2_made_the_same_of_this_map(case):
    preset = case["preset"]
    bits = np.frombuffer(zlib.decompress(base64.b64decode(case["occupied"])), np.uint8)
    occupied = np.unpackbits(bits)[: 150 * 150].reshape(150, 150)
    grid = GridMap.from_image_array(occupied, preset["resolution"])
    layer = InflationLayer(**{k: preset[k] for k in ("inflation_radius", "cost_scaling_factor")})
    footprint = Footprint.from_radius(preset["robot_radius"], preset["footprint_padding"])
    costmap = build_static_costmap(grid, CostmapParams.example_global(inflation_layer=layer), footprint)
    digest = hashlib.blake2b(costmap.costs[::-1].tobytes(), digest_size=16).hexdigest()
    assert digest == case["costmap_blake2b"]
    task = Pose(*preset["start"]), Pose(*preset["goal"])
    potential = NavfnPlanner().potential(costmap, *task)
    reached = np.isfinite(potential)
    assert (reached.sum(), potential[reached].max()) == (case["pot_n_reached"], case["pot_max"])
    path = NavfnPlanner().plan(costmap, *task)
    assert len(path) == case["path_points"]
    assert np.hypot(*np.diff(path[:, :2], axis=0).T).sum() == pytest.approx(case["path_length"], abs=1e-6)
    assert path[::EVERY] == pytest.approx(np.array(case["path_every_25th"]), abs=1e-9)
