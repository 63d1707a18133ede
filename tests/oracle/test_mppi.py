"""MPPI against what Nav2's own code recorded: single calls with the recorded noise, and the first command of runs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from controllers.base import FollowerSetup, Twist
from controllers.mppi.controller import MppiFollower
from controllers.mppi.evaluation import evaluate
from controllers.mppi.params import ROS_ONLY_KEYS, MppiParams
from controllers.mppi.path_handler import PathHandler
from gym_mapbench.costmap import Costmap
from gym_mapbench.footprint import Footprint
from gym_mapbench.scenario import Pose
from tests.oracle_data import ORACLE, needs_oracle

pytestmark = needs_oracle
PRESETS = ("A", "B")
PERIOD = 0.05

# Calls whose PathAlign reads memory behind Humble's array and finds there something else than we assume.
UNDEFINED = {("B", 0), ("B", 2), ("B", 5), ("B", 31), ("B", 40), ("B", 72), ("B", 83)}


@pytest.fixture(scope="module")
def config():
    return json.loads((ORACLE / "config.json").read_text())


def read(name):
    with np.load(ORACLE / name) as file:
        return dict(file)


def make_params(config, **changes):
    given = config["controllers"]["MPPI"]
    return MppiParams(**{k: v for k, v in given.items() if k.split(".")[0] not in ROS_ONLY_KEYS}, **changes)


def make_setup(config, preset):
    spec = config["presets"][preset]
    footprint = Footprint.from_radius(spec["robot_radius"], spec["footprint_padding"])
    return FollowerSetup(
        footprint, PERIOD, 0.25, 0.25, spec["inflation_radius"], spec["cost_scaling_factor"], np.random.default_rng(0)
    )


def costmaps(config, preset):
    plans, resolution = read(f"plans_{preset}.npz"), config["presets"][preset]["resolution"]
    grids = (Costmap(np.ascontiguousarray(costs[::-1]), resolution, 0.0, 0.0) for costs in plans["costmap"])
    return dict(zip(plans["map_id"].tolist(), grids, strict=True))


def rows_of(table, name):
    return [
        table[name][begin:end] for begin, end in zip(table[f"{name}_offset"], table[f"{name}_offset"][1:], strict=False)
    ]


@pytest.mark.parametrize("preset", PRESETS)
def test_local_paths(config, preset):
    units, maps = read(f"units_{preset}.npz"), costmaps(config, preset)
    calls = zip(units["pose"], units["map_id"], rows_of(units, "path"), rows_of(units, "mppi_path"), strict=True)
    for pose, map_id, plan, expected in calls:
        paths = PathHandler(make_params(config))
        paths.set_plan(plan)
        ours = paths.local_path(Pose(*pose.tolist()), maps[int(map_id)])
        # Stored to 1e-9 m, a path of 68 half cells can be longer or shorter than prune_distance by its last pose.
        assert abs(len(ours) - len(expected)) <= 1
        common = min(len(ours), len(expected))
        np.testing.assert_array_equal(ours[:common], expected[:common])


@pytest.mark.parametrize("preset", PRESETS)
def test_unit_vectors(config, preset):
    units, maps, recorded = read(f"units_{preset}.npz"), costmaps(config, preset), read(f"units_mppi_{preset}.npz")
    noise = read("mppi_noise.npz")
    details = {int(unit): row for row, unit in enumerate(recorded["unit_index"])}
    params, setup = make_params(config), make_setup(config, preset)
    for i, path in enumerate(rows_of(units, "mppi_path")):
        ours = evaluate(
            params, setup, Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), path,
            maps[int(units["map_id"][i])], (units["mppi_seq_in_vx"][i], units["mppi_seq_in_wz"][i]),
            (noise["vx"], noise["wz"]),
        )  # fmt: skip
        assert (ours.failed, ours.furthest) == (units["mppi_fail_flag"][i], units["mppi_furthest"][i])
        v_error, w_error = np.abs(np.array(ours.command) - units["mppi_cmd_stepwise"][i])
        if (preset, i) in UNDEFINED:
            assert v_error < 0.005
            assert w_error < 0.026
        else:
            assert max(v_error, w_error) < 5e-5
            np.testing.assert_allclose(ours.softmax_v, units["mppi_seq_softmax_vx"][i], atol=5e-5)
            np.testing.assert_allclose(ours.filtered_w, units["mppi_seq_out_wz"][i], atol=5e-5)
        if i in details:
            compare_costs(ours, recorded, details[i], (preset, i) in UNDEFINED)


def compare_costs(ours, recorded, row, undefined):
    assert ours.critics == tuple(recorded["critics"])
    for name, costs, expected in zip(ours.critics, ours.costs, recorded["critic_cost"][row], strict=True):
        if not (undefined and name == "PathAlignCritic"):
            np.testing.assert_allclose(costs, expected, rtol=1e-4, atol=1e-6, err_msg=name)
    if not undefined:
        np.testing.assert_allclose(ours.total, recorded["total_cost"][row], rtol=1e-4)


@pytest.mark.parametrize("preset", PRESETS)
def test_first_command_of_every_seed(config, preset):
    """From rest every recorded run begins with the second draw of Nav2's own noise."""
    plans, maps = read(f"plans_{preset}.npz"), costmaps(config, preset)
    paths = dict(zip(plans["map_id"].tolist(), rows_of(plans, "path"), strict=True))
    runs = json.loads((ORACLE / f"runs_{preset}.json").read_text())
    recorded, start = read(f"runs_{preset}.npz"), Pose(*config["presets"][preset]["start"])
    for run in (r for r in runs if r["controller"] == "MPPI" and r["map"] == runs[0]["map"]):
        footprint = {"CostCritic.consider_footprint": run["variant"] == "footprint"}
        given = {"controllers": {"MPPI": {**config["controllers"]["MPPI"], **footprint}}}
        made = MppiFollower(make_params(given, noise="nav2", noise_seed=run["seed"]))
        made.reset(make_setup(config, preset))
        made.set_plan(paths[run["map"]])
        command = made.compute_velocity_commands(start, Twist(0.0, 0.0), maps[run["map"]], 0.0)
        assert command == pytest.approx(recorded["cmd"][recorded["offset"][run["index"]]], abs=2e-5)
