"""MPPI against what Lyrical's own code recorded: noise, every step of single calls, and the first command of runs."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.base import Twist
from controllers.mppi.lyrical import LyricalOptimizer
from controllers.mppi.noise import Layout, LyricalNoise, make_source
from controllers.mppi.params import MppiParams
from evolution.validation import Oracle, mppi_measures
from evolution.validation.setup import follower_params, follower_setup, full_costmaps
from gym_mapbench.world.scenario import Pose
from tests.oracle_data import LYRICAL_ORACLE, needs_lyrical_oracle

pytestmark = needs_lyrical_oracle
PRUNE_DISTANCE = 2.0


@pytest.fixture(scope="module")
def oracle():
    return Oracle(LYRICAL_ORACLE)


def test_noise(oracle):
    recorded = oracle.arrays("mppi_noise.npz")
    layout = Layout(*recorded["vx"].shape)
    source = LyricalNoise(layout, (0.2, 0.4))
    draws = [source.sample() for _ in range(recorded["draw_index"].max())]
    for axis, name in enumerate(("vx", "wz")):
        ours = [layout.flat(draw[axis].transpose(1, 0, 2)).T for draw in draws]
        np.testing.assert_allclose(ours[0], recorded[name], atol=2.5e-7)
        for row, index in enumerate(recorded["draw_index"]):
            np.testing.assert_allclose(ours[index - 1][:8, 0], recorded[f"draw_head_{name}"][row], atol=1e-7)
            assert ours[index - 1].sum(dtype=np.float64) == pytest.approx(recorded["draw_sum"][row, axis], abs=1e-4)


def test_every_step_of_single_calls(oracle):
    measures = {measure.key: measure for measure in mppi_measures(oracle)}
    assert len(measures) == 7
    assert measures["mppi_validator_agreement"].count == 100
    assert not [measure for measure in measures.values() if measure.missed]


def test_first_command_of_every_seed(oracle):
    (preset,) = oracle.presets
    plans, runs, maps = oracle.table("plans", preset), oracle.table("runs", preset), full_costmaps(oracle, preset)
    for run in oracle.runs(preset):
        if run["controller"] != "MPPI" or run["map"] > 1:
            continue
        params = MppiParams(**follower_params(oracle, "MPPI"), noise="nav2", noise_seed=run["seed"])
        setup = follower_setup(oracle, preset)
        optimizer = LyricalOptimizer(params, setup, make_source(params, setup.rng))
        path = plans["path"][plans["path_offset"][run["map"]] : plans["path_offset"][run["map"] + 1]]
        length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path[:, :2], axis=0).T))])
        local = path[length <= PRUNE_DISTANCE]
        end = (float(local[-1, 0]), float(local[-1, 1]))
        command = optimizer.compute(Pose(*preset.start), Twist(0.0, 0.0), local, end, maps[run["map"]])
        assert command == pytest.approx(runs["cmd"][runs["offset"][run["index"]]], abs=2e-5)
