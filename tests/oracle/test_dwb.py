"""DWB against what Nav2's own code recorded: every candidate of every call, the map grids, and whole runs."""

from __future__ import annotations

import json

import numpy as np
import pytest

from controllers.base import FollowerSetup, Twist
from controllers.dwb.controller import DwbFollower
from controllers.dwb.kernels.plan import distance_fields
from controllers.dwb.params import ROS_ONLY_KEYS, DwbParams
from controllers.dwb.scene import GOAL, GOAL_AHEAD, PATH
from gym_mapbench.footprint import Footprint
from gym_mapbench.planners.navfn import NavfnPlanner
from gym_mapbench.scenario import Pose
from tests.oracle.test_rpp import PRESETS, drive, full_costmaps, rolling_window
from tests.oracle_data import ORACLE, needs_oracle

pytestmark = needs_oracle
# Scores, twists and commands are recorded to six decimals, trajectories of runs to five, in float32.
SCORE, COMMAND = 6e-7, 2e-5
# 20 s of every run; `mapbench validate` drives them to their end.
TICKS = 400
RUNS_PER_KIND = 6


@pytest.fixture(scope="module")
def settings():
    return json.loads((ORACLE / "config.json").read_text())


def make_follower(settings, preset, **changes):
    recorded = {**settings["controllers"]["DWB"], **changes}
    made = DwbFollower(DwbParams(**{key: value for key, value in recorded.items() if key not in ROS_ONLY_KEYS}))
    radius, inflation = (settings["presets"][preset][key] for key in ("robot_radius", "inflation_radius"))
    made.reset(FollowerSetup(Footprint.from_radius(radius), 0.05, 0.25, 0.25, inflation, 3.0, np.random.default_rng(0)))
    return made


def load(name):
    with np.load(ORACLE / name) as file:
        return dict(file)


def calls(settings, preset):
    """Every recorded call: its row, a follower that has the plan, and pose, velocity and costmap."""
    units, costmaps = load(f"units_{preset}.npz"), full_costmaps(settings, preset)
    goal = Pose(*settings["presets"][preset]["goal"])
    for i, map_id in enumerate(units["map_id"]):
        costmap = costmaps[int(map_id)]
        made = make_follower(settings, preset)
        made.set_plan(NavfnPlanner().plan(costmap, Pose(*units["plan_from"][i].tolist()), goal))
        yield i, made, Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), costmap


@pytest.mark.parametrize("preset", PRESETS)
def test_every_candidate_is_judged_alike(settings, preset):
    recorded, units = load(f"units_dwb_{preset}.npz"), load(f"units_{preset}.npz")
    for i, made, pose, velocity, costmap in calls(settings, preset):
        rows = slice(*recorded["offset"][i : i + 2])
        evaluation = made.evaluate(pose, velocity, costmap, 0.0)
        assert np.abs(evaluation.twists - recorded["twist"][rows]).max() <= SCORE
        assert (evaluation.illegal_by == recorded["illegal_by"][rows]).all()
        assert np.abs(evaluation.raw_scores - recorded["raw_score"][rows]).max() <= SCORE
        np.testing.assert_allclose(evaluation.totals, recorded["total"][rows], rtol=1e-7, atol=SCORE)
        assert evaluation.best == recorded["best_index"][i]
        assert made.compute_velocity_commands(pose, velocity, costmap, 0.0) == pytest.approx(
            units["dwb_cmd"][i], abs=SCORE
        )
        best = recorded["best_traj"][slice(*recorded["best_traj_offset"][i : i + 2])]
        error = made.trajectory(evaluation.best)[[*range(len(best) - 1), -1]] - best
        error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
        assert np.abs(error).max() <= SCORE
    assert evaluation.critics == tuple(recorded["critics"])


@pytest.mark.parametrize("preset", PRESETS)
def test_map_grids(settings, preset):
    recorded = load(f"units_dwb_{preset}.npz")
    layers = {"GoalAlign": GOAL_AHEAD, "PathAlign": PATH, "PathDist": PATH, "GoalDist": GOAL}
    compared = 0
    for i, made, pose, velocity, costmap in calls(settings, preset):
        for grids in recorded["grid"][recorded["grid_unit_index"] == i]:
            scene = made._look(pose, velocity, costmap, 0.0)
            bearing = np.arctan2(scene.goal.y - pose.y, scene.goal.x - pose.x)
            side = 150 * costmap.resolution
            fields, _, _ = distance_fields(
                scene.plan, 0.1 * np.cos(bearing), 0.1 * np.sin(bearing),
                costmap.costs, 0.0, 0.0, costmap.resolution, (0.0, side, 0.0, side),
            )  # fmt: skip
            for name, grid in zip(recorded["grid_critics"], grids, strict=True):
                assert (fields[layers[str(name)]].reshape(150, 150) == grid[::-1]).all(), (i, name)
                compared += 1
    assert compared == 4 * len(recorded["grid_unit_index"])


@pytest.mark.parametrize(("variant", "local"), [("default", "full"), ("default", "rolling"), ("fast", "full")])
@pytest.mark.parametrize("preset", PRESETS)
def test_closed_loop_runs_come_out_the_same(settings, preset, variant, local):
    costmaps = full_costmaps(settings, preset)
    start, goal = (Pose(*settings["presets"][preset][end]) for end in ("start", "goal"))
    recorded = load(f"runs_{preset}.npz")
    runs = [
        run
        for run in json.loads((ORACLE / f"runs_{preset}.json").read_text())
        if (run["controller"], run["variant"], run["local_costmap"]) == ("DWB", variant, local)
        and run["reason"] != "no_path"
    ]
    for run in runs[:RUNS_PER_KIND]:
        begin, end = recorded["offset"][run["index"] : run["index"] + 2]
        rows = slice(begin, min(end, begin + TICKS))
        made = make_follower(settings, preset, **settings["variants"].get(f"DWB/{variant}", {}))
        window = rolling_window(settings, preset, run["map"], start) if local == "rolling" else None
        driven = drive(made, costmaps[run["map"]], window, start, goal, rows.stop - rows.start)
        states, commands = zip(*driven, strict=True)
        assert [command is None for command in commands] == recorded["exception"][rows].tolist(), run["map"]
        told = np.array([command or (0.0, 0.0) for command in commands])
        assert told == pytest.approx(recorded["cmd"][rows], abs=COMMAND), run["map"]
        error = np.array(states) - recorded["traj"][rows]
        error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
        assert np.abs(error).max() < COMMAND, run["map"]
