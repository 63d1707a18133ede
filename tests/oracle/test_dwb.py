"""DWB against what Nav2's own code recorded: every candidate of every call, the map grids, and whole runs."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import Twist
from controllers.dwb.kernels.decision import near_plan
from controllers.dwb.kernels.plan import GOAL, GOAL_AHEAD, PATH, distance_fields
from evolution.validation.setup import make_planner
from gym_mapbench.world.scenario import Pose
from tests.oracle.recordings import each_recording
from tests.oracle.test_rpp import check_runs

# Scores, twists and commands are recorded to six decimals.
SCORE = 6e-7
# 20 s of every run; `mapbench validate` drives them to their end.
TICKS = 400
RUNS_PER_KIND = 6


def calls(recorded):
    """Every recorded call: its row, a follower that has the plan, and pose, velocity and costmap."""
    units, costmaps, planner = recorded.load("units"), recorded.costmaps, make_planner(recorded.oracle)
    for i, map_id in enumerate(units["map_id"]):
        costmap = costmaps[int(map_id)]
        made = recorded.follower("DWB")
        made.set_plan(planner.plan(costmap, Pose(*units["plan_from"][i].tolist()), recorded.preset.goal))
        yield i, made, Pose(*units["pose"][i].tolist()), Twist(*units["vel"][i].tolist()), costmap


@each_recording
def test_every_candidate_is_judged_alike(recorded):
    table, units = recorded.load("units_dwb"), recorded.load("units")
    for i, made, pose, velocity, costmap in calls(recorded):
        rows = slice(*table["offset"][i : i + 2])
        evaluation = made.evaluate(pose, velocity, costmap, 0.0)
        assert np.abs(evaluation.twists - table["twist"][rows]).max() <= SCORE
        assert (evaluation.illegal_by == table["illegal_by"][rows]).all()
        assert np.abs(evaluation.raw_scores - table["raw_score"][rows]).max() <= SCORE
        np.testing.assert_allclose(evaluation.totals, table["total"][rows], rtol=1e-7, atol=SCORE)
        assert evaluation.best == table["best_index"][i]
        assert made.compute_velocity_commands(pose, velocity, costmap, 0.0) == pytest.approx(
            units["dwb_cmd"][i], abs=SCORE
        )
        best = table["best_traj"][slice(*table["best_traj_offset"][i : i + 2])]
        error = made.trajectory(evaluation.best)[[*range(len(best) - 1), -1]] - best
        error[:, 2] = np.arctan2(np.sin(error[:, 2]), np.cos(error[:, 2]))
        assert np.abs(error).max() <= SCORE
    assert evaluation.critics == tuple(table["critics"])


@each_recording
def test_map_grids(recorded):
    table = recorded.load("units_dwb")
    layers = {"GoalAlign": GOAL_AHEAD, "PathAlign": PATH, "PathDist": PATH, "GoalDist": GOAL}
    compared = 0
    for i, made, pose, _, costmap in calls(recorded):
        for grids in table["grid"][table["grid_unit_index"] == i]:
            side = 150 * costmap.resolution
            first, last = near_plan(made._plan, tuple(pose), made._tuning[0], side / 2)
            bearing = np.arctan2(made._goal.y - pose.y, made._goal.x - pose.x)
            fields, _, _ = distance_fields(
                made._plan[first:last], 0.1 * np.cos(bearing), 0.1 * np.sin(bearing),
                costmap.costs, 0.0, 0.0, costmap.resolution, (0.0, side, 0.0, side),
            )  # fmt: skip
            for name, grid in zip(table["grid_critics"], grids, strict=True):
                assert (fields[layers[str(name)]].reshape(150, 150) == grid[::-1]).all(), (i, name)
                compared += 1
    assert compared == 4 * len(table["grid_unit_index"])


@pytest.mark.parametrize(("variant", "local"), [("default", "full"), ("default", "rolling"), ("fast", "full")])
@each_recording
def test_closed_loop_runs_come_out_the_same(recorded, variant, local):
    check_runs(recorded, "DWB", variant, local, RUNS_PER_KIND, TICKS)
