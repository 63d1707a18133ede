"""MPPI against the reference's worked examples (T7): one straight trajectory, one critic at a time."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import ControllerAbort, FollowerSetup, Twist
from controllers.mppi.controller import MppiFollower
from controllers.mppi.evaluation import evaluate
from controllers.mppi.params import MppiParams
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.scenario import Pose

STEPS = 56
LONG_PATH = np.column_stack([0.025 * np.arange(61), np.zeros(61), np.zeros(61)])


def setup(seed=0):
    rng = np.random.default_rng(seed)
    return FollowerSetup(Footprint.from_radius(0.22), 0.05, 0.25, 0.25, 0.55, 3.0, rng)


def free_map(costs=None):
    costs = np.zeros((200, 200), dtype=np.uint8) if costs is None else costs
    return Costmap(costs, 0.05, -5.0, -5.0)


def straight(critic, path, *, v, y=0.0, noise_v=0.0, **options):
    """One trajectory along x at a constant speed, scored by one critic."""
    params = MppiParams(batch_size=1, critics=(critic,), **{critic: options})
    controls = np.full(STEPS, v - noise_v, dtype=np.float32), np.zeros(STEPS, dtype=np.float32)
    noise = np.full((1, STEPS), noise_v, dtype=np.float32), np.zeros((1, STEPS), dtype=np.float32)
    return evaluate(params, setup(), Pose(0.0, y, 0.0), Twist(v, 0.0), path, free_map(), controls, noise)


def cost(critic, path, **options):
    return float(straight(critic, path, **options).costs[0, 0])


def test_path_follow():
    assert cost("PathFollowCritic", LONG_PATH, v=0.4, offset_from_furthest=6) == pytest.approx(0.775, abs=1e-5)
    assert cost("PathFollowCritic", LONG_PATH, v=0.4, offset_from_furthest=5) == pytest.approx(0.65, abs=1e-5)
    assert straight("PathFollowCritic", LONG_PATH, v=0.4).furthest == 45


def test_path_align():
    options = {"trajectory_point_step": 4, "cost_weight": 10.0}
    assert cost("PathAlignCritic", LONG_PATH, v=0.4, y=0.1, **options) == pytest.approx(1.02318, abs=1e-4)
    assert cost("PathAlignCritic", LONG_PATH, v=0.4, **options) == pytest.approx(0.20385, abs=1e-4)


def test_constraint():
    assert cost("ConstraintCritic", LONG_PATH, v=0.8) == pytest.approx(1.04040, abs=1e-4)


def test_goal():
    path = np.array([[0.5, 0.0, 0.0], [1.0, 0.0, 0.0]])
    assert cost("GoalCritic", path, v=0.5) == pytest.approx(2.044643, abs=1e-5)


def test_path_angle():
    path = np.array([[0.1, 0.3, 0.0], [0.5, 1.5, 0.0]])
    assert cost("PathAngleCritic", path, v=0.0) == pytest.approx(2.498092, abs=1e-4)


def test_prefer_forward():
    assert cost("PreferForwardCritic", LONG_PATH, v=-0.2) == pytest.approx(2.8, abs=1e-5)
    assert cost("PreferForwardCritic", LONG_PATH, v=0.2) == 0.0


def test_control_effort():
    # gamma / std^2 * sum of u * noise = 0.015 / 0.04 * 56 * 0.3 * 0.1.
    evaluation = straight("PreferForwardCritic", LONG_PATH, v=0.4, noise_v=0.1)
    assert float(evaluation.total[0] - evaluation.costs[0, 0]) == pytest.approx(0.63, abs=1e-5)


def test_savitzky_golay_on_a_constant():
    filtered = straight("PreferForwardCritic", LONG_PATH, v=0.4).filtered_v
    assert filtered[:6] == pytest.approx([0.25108, 0.30978, 0.36589, 0.40413, 0.40328, 0.40760], abs=1e-5)
    assert filtered[STEPS - 5] == pytest.approx(0.4)  # Humble leaves this one out


def test_the_same_seed_gives_the_same_commands():
    def commands(seed):
        follower = MppiFollower(MppiParams(batch_size=300, critics=("GoalCritic", "PathFollowCritic")))
        follower.reset(setup(seed))
        follower.set_plan(LONG_PATH)
        return [
            follower.compute_velocity_commands(Pose(0, 0.1, 0.2), Twist(0.1, 0), free_map(), 0.05 * i) for i in range(4)
        ]

    assert commands(1) == commands(1)
    assert commands(1) != commands(2)


def test_nowhere_to_go_aborts():
    follower = MppiFollower(MppiParams(batch_size=100, critics=("CostCritic", "GoalCritic")))
    follower.reset(setup())
    follower.set_plan(LONG_PATH)
    walls = free_map(np.full((200, 200), 254, dtype=np.uint8))
    with pytest.raises(ControllerAbort, match="Optimizer fail to compute path"):
        follower.compute_velocity_commands(Pose(0, 0), Twist(0, 0), walls, 0.0)


@pytest.mark.parametrize(
    ("options", "expected"),
    [
        ({"critics": ["CostCritik"]}, "CostCritic"),
        ({"batch_size": 0}, "batch_size"),
        ({"motion_model": "Omni"}, "motion_model"),
        ({"CostCritic": {"cost_wait": 1.0}}, "cost_weight"),
        ({"temprature": 0.3}, "temperature"),
    ],
)
def test_bad_parameters_are_refused(options, expected):
    with pytest.raises(ConfigError, match=expected):
        MppiParams(**options)


def test_a_control_period_beyond_model_dt_is_refused():
    follower = MppiFollower(MppiParams(model_dt=0.02))
    with pytest.raises(ConfigError, match="model_dt"):
        follower.reset(setup())
