"""What DWB and MPPI considered in their last cycle, for a reader."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import FollowerSetup, LocalPlan, Twist
from controllers.dwb.controller import DwbFollower
from controllers.dwb.params import DwbParams
from controllers.mppi.controller import MppiFollower
from controllers.mppi.kernels.rollout import retrace
from controllers.mppi.params import MppiParams
from controllers.nav2_params import load_preset
from gym_mapbench.costmap import Costmap
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

POSE, VELOCITY = Pose(0.1, 0.2, 0.3), Twist(0.2, -0.1)
PATH = np.column_stack([np.linspace(0.0, 1.4, 57), np.linspace(0.2, 0.6, 57), np.full(57, 0.28)])


@pytest.fixture
def setup():
    return FollowerSetup(Footprint.from_radius(0.22), 0.05, 0.25, 0.25, 0.55, 3.0, np.random.default_rng(0))


@pytest.fixture
def costmap():
    costs = np.zeros((60, 60), np.uint8)
    costs[40:44, 35:] = 254
    return Costmap(costs, 0.05, -1.5, -1.5)


@pytest.mark.parametrize("release", RELEASES)
def test_mppis_trajectories_are_those_of_the_roll_out(release, setup, costmap):
    params = MppiParams(release=release, batch_size=64, vx_max=0.4, gamma=0.02)
    follower = MppiFollower(params)
    follower.reset(setup)
    follower.set_plan(PATH)
    follower.take_local_plan(LocalPlan(PATH, float(np.hypot(*np.diff(PATH[:, :2], axis=0).T).sum()), Pose(*PATH[-1])))
    assert follower.last_samples(10) is None
    follower.compute_velocity_commands(POSE, VELOCITY, costmap, 0.0)
    samples = follower.last_samples(64)
    explored, total = follower._optimizer.explored, follower._optimizer.total
    order = np.argsort(total.ravel()[:64], kind="stable")
    assert samples.costs.tolist() == total.ravel()[order].tolist()
    for number, sample in enumerate(order.tolist()):
        block, k = divmod(sample, total.shape[1])
        call, dt = follower._optimizer._call[0], np.float32(params.model_dt)
        noise = explored.noise_v[block], explored.noise_w[block]
        end = retrace(*noise, k, params.time_steps - 1, explored.v, explored.w, call, dt)
        np.testing.assert_allclose(samples.points[number, -1], np.add((call["base_x"], call["base_y"]), end), atol=1e-4)


def test_mppis_chosen_trajectory_begins_with_its_command(setup, costmap):
    params = MppiParams(**{**load_preset("thesis").controller("mppi").params, "batch_size": 64})
    follower = MppiFollower(params)
    follower.reset(setup)
    follower.set_plan(PATH)
    command = follower.compute_velocity_commands(POSE, VELOCITY, costmap, 0.0)
    chosen_v, chosen_w = follower._optimizer.chosen
    assert command.v in chosen_v.tolist()
    assert command.w in chosen_w.tolist()
    assert follower.last_samples(5).chosen.shape == (params.time_steps, 2)
    assert len(follower.last_samples(5).points) == 5


def test_dwbs_last_evaluation_is_that_of_the_command(setup, costmap):
    follower = DwbFollower(DwbParams(**load_preset("thesis").controller("dwb").params))
    follower.reset(setup)
    follower.set_plan(PATH)
    assert len(follower.last_evaluation().totals) == 0
    command = follower.compute_velocity_commands(POSE, VELOCITY, costmap, 0.0)
    judged = follower.last_evaluation()
    assert judged.velocities[judged.best].tolist() == [command.v, command.w]
    legal = judged.illegal_by < 0
    assert judged.totals[judged.best] == judged.totals[legal].min()
