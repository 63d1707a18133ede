"""RPP against what Nav2's own code recorded, call by call."""

from __future__ import annotations

import json

import numpy as np
import pytest

from controllers.base import ControllerError, FollowerSetup, Twist
from controllers.rpp.controller import RppFollower
from controllers.rpp.params import RppParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.footprint import Footprint
from gym_mapbench.scenario import Pose
from tests.oracle_data import ORACLE, needs_oracle

pytestmark = needs_oracle
PRESETS = ("A", "B")


@pytest.fixture(scope="module")
def config():
    return json.loads((ORACLE / "config.json").read_text())


def make_follower(config, preset, **changes):
    params = {**config["controllers"]["RPP"], **changes}
    del params["transform_tolerance"]
    radius, inflation = (config["presets"][preset][key] for key in ("robot_radius", "inflation_radius"))
    made = RppFollower(RppParams(**params))
    made.reset(FollowerSetup(Footprint.from_radius(radius), 0.05, 0.25, 0.25, inflation, 3.0, np.random.default_rng(0)))
    return made


def full_costmaps(config, preset):
    with np.load(ORACLE / f"plans_{preset}.npz") as plans:
        resolution = config["presets"][preset]["resolution"]
        grids = (np.ascontiguousarray(costs[::-1]) for costs in plans["costmap"])
        return {
            int(map_id): Costmap(costs, resolution, 0.0, 0.0)
            for map_id, costs in zip(plans["map_id"], grids, strict=True)
        }


@pytest.mark.parametrize("preset", PRESETS)
def test_unit_vectors(config, preset):
    costmaps = full_costmaps(config, preset)
    with np.load(ORACLE / f"units_{preset}.npz") as file:
        units = dict(file)
    for i, map_id in enumerate(units["map_id"]):
        made = make_follower(config, preset)
        begin, end = units["path_offset"][i : i + 2]
        made.set_plan(units["path"][begin:end])
        call = Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), costmaps[int(map_id)], 0.0
        message = str(units["rpp_exception"][i])
        if message:
            with pytest.raises(ControllerError) as raised:
                made.compute_velocity_commands(*call)
            assert str(raised.value) == message
        else:
            assert made.compute_velocity_commands(*call) == pytest.approx(units["rpp_cmd"][i], abs=1e-8)
        assert made.carrot == pytest.approx(units["rpp_carrot"][i], abs=1e-8)
