"""The Graceful Controller and the Rotation Shim against what Jazzy's own code recorded; Humble's were not recorded."""

from __future__ import annotations

import pytest

from controllers.base import ControllerError, Twist
from controllers.dwb.params import ROS_ONLY_KEYS as DWB_ROS_ONLY_KEYS
from controllers.graceful.params import ROS_ONLY_KEYS
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.registry import FOLLOWERS
from gym_mapbench.world.scenario import Pose
from tests.oracle.test_rpp import compare, drive, full_costmaps, make_setup
from tests.oracle_data import each_jazzy_recording

KINDS = {"Graceful": "graceful", "RotationShim": "shim_dwb"}
each_kind = pytest.mark.parametrize("name", KINDS)


def make_follower(recorded, name):
    params = {
        "Graceful": lambda: recorded.params("Graceful", ROS_ONLY_KEYS),
        "RotationShim": lambda: {
            **recorded.params("DWB", DWB_ROS_ONLY_KEYS),
            **recorded.params("RotationShim", {"primary_controller"}),
        },
    }[name]()
    made = FOLLOWERS[KINDS[name]](CONTROLLERS[KINDS[name]].params(**params))
    made.reset(make_setup(recorded))
    return made


@each_kind
@each_jazzy_recording
def test_unit_vectors(recorded, name):
    costmaps, units = full_costmaps(recorded), recorded.load("units")
    column = {"Graceful": "graceful", "RotationShim": "shim"}[name]
    for i, map_id in enumerate(units["map_id"]):
        made = make_follower(recorded, name)
        begin, end = units["path_offset"][i : i + 2]
        made.set_plan(units["path"][begin:end])
        call = Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), costmaps[int(map_id)], 0.0
        message = str(units[f"{column}_exception"][i])
        if message:
            with pytest.raises(ControllerError) as raised:
                made.compute_velocity_commands(*call)
            assert str(raised.value) == message
        else:
            assert made.compute_velocity_commands(*call) == pytest.approx(units[f"{column}_cmd"][i], abs=1e-8)


@each_kind
@each_jazzy_recording
def test_closed_loop_runs_come_out_the_same(recorded, name):
    costmaps, runs = full_costmaps(recorded), recorded.load("runs")
    for run in recorded.runs(name, "default", "full"):
        rows = slice(*runs["offset"][run["index"] : run["index"] + 2])
        driven = drive(recorded, make_follower(recorded, name), costmaps[run["map"]], None, rows.stop - rows.start)
        compare(driven, runs, rows, run)
