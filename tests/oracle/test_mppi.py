"""MPPI against what Nav2's own code recorded: single calls with the recorded noise, and the first command of runs."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import STOP, Twist
from controllers.mppi.evaluation import evaluate
from controllers.mppi.params import MppiParams
from controllers.mppi.path_handler import PathHandler
from evolution.validation.setup import follower_params, follower_setup
from gym_mapbench.world.scenario import Pose
from tests.oracle.recordings import each_recording

# Calls whose PathAlign reads memory behind Humble's array and finds there something else than we assume.
UNDEFINED = {("B", 0), ("B", 2), ("B", 5), ("B", 31), ("B", 40), ("B", 72), ("B", 83)}


def params_of(recorded):
    return MppiParams(**follower_params(recorded.oracle, "MPPI"))


def rows_of(table, name):
    return [
        table[name][begin:end] for begin, end in zip(table[f"{name}_offset"], table[f"{name}_offset"][1:], strict=False)
    ]


@each_recording
def test_local_paths(recorded):
    units, maps = recorded.load("units"), recorded.costmaps
    calls = zip(units["pose"], units["map_id"], rows_of(units, "path"), rows_of(units, "mppi_path"), strict=True)
    for pose, map_id, plan, expected in calls:
        paths = PathHandler(params_of(recorded))
        paths.set_plan(plan)
        ours = paths.local_path(Pose(*pose.tolist()), maps[int(map_id)])
        # Stored to 1e-9 m, a path of 68 half cells can be longer or shorter than prune_distance by its last pose.
        assert abs(len(ours) - len(expected)) <= 1
        common = min(len(ours), len(expected))
        np.testing.assert_array_equal(ours[:common], expected[:common])


@each_recording
def test_unit_vectors(recorded):
    units, maps, table = recorded.load("units"), recorded.costmaps, recorded.load("units_mppi")
    noise = recorded.oracle.arrays("mppi_noise.npz")
    undefined = UNDEFINED if recorded.oracle.release == "humble" else set()
    details = {int(unit): row for row, unit in enumerate(table["unit_index"])}
    params, setup, preset = params_of(recorded), follower_setup(recorded.oracle, recorded.preset), recorded.name
    for i, path in enumerate(rows_of(units, "mppi_path")):
        paths = PathHandler(params)
        paths.set_plan(np.array([recorded.preset.goal]))
        ours = evaluate(
            params, setup, Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), path,
            maps[int(units["map_id"][i])], (units["mppi_seq_in_vx"][i], units["mppi_seq_in_wz"][i]),
            (noise["vx"], noise["wz"]), paths.goal(path),
        )  # fmt: skip
        assert (ours.failed, ours.furthest) == (units["mppi_fail_flag"][i], units["mppi_furthest"][i])
        v_error, w_error = np.abs(np.array(ours.command) - units["mppi_cmd_stepwise"][i])
        if (preset, i) in undefined:
            assert v_error < 0.005
            assert w_error < 0.026
        else:
            assert max(v_error, w_error) < 5e-5
            np.testing.assert_allclose(ours.softmax_v, units["mppi_seq_softmax_vx"][i], atol=5e-5)
            np.testing.assert_allclose(ours.filtered_w, units["mppi_seq_out_wz"][i], atol=5e-5)
        if i in details:
            compare_costs(ours, table, details[i], (preset, i) in undefined)


def compare_costs(ours, table, row, undefined):
    assert ours.critics == tuple(table["critics"])
    for name, costs, expected in zip(ours.critics, ours.costs, table["critic_cost"][row], strict=True):
        if not (undefined and name == "PathAlignCritic"):
            np.testing.assert_allclose(costs, expected, rtol=1e-4, atol=1e-6, err_msg=name)
    if not undefined:
        np.testing.assert_allclose(ours.total, table["total_cost"][row], rtol=1e-4)


@each_recording
def test_first_command_of_every_seed(recorded):
    """From rest every recorded run begins with Nav2's own noise: the second draw, or the first if it is regenerated."""
    plans, maps, runs = recorded.load("plans"), recorded.costmaps, recorded.load("runs")
    paths = dict(zip(plans["map_id"].tolist(), rows_of(plans, "path"), strict=True))
    for variant in ("default", "footprint", "fixed_noise"):
        for run in (one for one in recorded.runs("MPPI", variant, "full") if one["map"] == plans["map_id"][0]):
            made = recorded.follower("MPPI", variant, run["seed"])
            made.set_plan(paths[run["map"]])
            command = made.compute_velocity_commands(recorded.preset.start, STOP, maps[run["map"]], 0.0)
            assert command == pytest.approx(runs["cmd"][runs["offset"][run["index"]]], abs=2e-5)
