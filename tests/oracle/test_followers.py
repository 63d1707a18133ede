"""The Graceful Controller and the Rotation Shim against what Jazzy's own code recorded; Humble's were not recorded."""

from __future__ import annotations

import pytest

from controllers.dwb.params import ROS_ONLY_KEYS as DWB_ROS_ONLY_KEYS
from controllers.graceful.params import ROS_ONLY_KEYS
from controllers.nav2_params.plugins import CONTROLLERS
from controllers.registry import FOLLOWERS
from tests.oracle.test_rpp import compare, drive, each_unit_vector, full_costmaps, make_setup
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
    column = {"Graceful": "graceful", "RotationShim": "shim"}[name]
    assert len(list(each_unit_vector(recorded, lambda: make_follower(recorded, name), column))) > 0


@each_kind
@each_jazzy_recording
def test_closed_loop_runs_come_out_the_same(recorded, name):
    costmaps, runs = full_costmaps(recorded), recorded.load("runs")
    for run in recorded.runs(name, "default", "full"):
        rows = slice(*runs["offset"][run["index"] : run["index"] + 2])
        driven = drive(recorded, make_follower(recorded, name), costmaps[run["map"]], None, rows.stop - rows.start)
        compare(driven, runs, rows, run)
