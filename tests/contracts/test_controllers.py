"""What every registered controller keeps to, whoever wrote it."""

from __future__ import annotations

import copy
import pickle
from functools import lru_cache

import numpy as np
import pytest

from controllers.base import Controller
from controllers.registry import CONTROLLERS, make_controller
from evolution.driving.one_run import environment_for, run_episode
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.groups import OBSERVATION_KEYS
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

NAMES = CONTROLLERS.names()
ROOM = GridMap.from_rows(("#" * 70, *["#" + "." * 68 + "#"] * 38, "#" * 70), 0.05)
AHEAD = Scenario(ROOM, Pose(0.8, 1.0, 0.0), Pose(2.6, 1.0, 0.0), "ahead")
BEND = Scenario(ROOM, Pose(0.8, 0.7, 1.57), Pose(2.6, 1.3, 0.0), "bend")
CONFIG = EnvConfig(time_limit=60.0)

pytestmark = pytest.mark.parametrize("name", NAMES)


def drive(controller: Controller, scenario: Scenario = AHEAD, seed: int = 1) -> Episode:
    env = environment_for(CONFIG, controller)
    return run_episode(env, controller, scenario, name="any", seed=seed)


@lru_cache
def first_run(name: str) -> Episode:
    return drive(make_controller(name))


def assert_same_run(one: Episode, other: Episode) -> None:
    assert (one.outcome, one.time, one.events) == (other.outcome, other.time, other.events)
    assert np.array_equal(one.trajectory, other.trajectory)
    assert np.array_equal(one.commands, other.commands)


def test_reaches_a_goal_in_an_open_room(name):
    episode = first_run(name)
    assert (episode.outcome, episode.first_contact_time) == ("goal", None)
    assert len(episode.path) > 0


def test_commands_are_finite_pairs(name):
    commands = first_run(name).commands
    assert commands.shape[1] == 2
    assert np.isfinite(commands).all()


def test_observes_what_the_env_offers(name):
    keys = make_controller(name).observation_keys
    assert keys
    assert set(keys) <= set(OBSERVATION_KEYS)


def test_same_seed_same_run_though_it_drove_elsewhere_before(name):
    controller = make_controller(name)
    drive(controller, BEND, seed=7)
    assert_same_run(drive(controller), first_run(name))


def test_unpickled_controller_drives_the_same(name):
    assert_same_run(drive(pickle.loads(pickle.dumps(make_controller(name)))), first_run(name))


def test_leaves_the_observation_alone(name):
    controller = make_controller(name)
    env = environment_for(CONFIG, controller)
    seen = []

    class Watched:
        observation_keys = controller.observation_keys
        decides_goal = getattr(controller, "decides_goal", False)
        status = "running"

        def reset(self, context):
            controller.reset(context)

        def act(self, observation):
            before = copy.deepcopy(observation)
            command = controller.act(observation)
            seen.append(all(np.array_equal(before[key], observation[key]) for key in before))
            self.status = "failed" if len(seen) == 30 else "running"
            return command

    run_episode(env, Watched(), AHEAD, name="any", seed=1)
    assert len(seen) == 30
    assert all(seen)


def test_unknown_parameter_is_refused_in_one_line(name):
    with pytest.raises(ConfigError) as refused:
        make_controller(name, no_such_parameter=1)
    assert "no_such_parameter" in str(refused.value)
    assert "\n" not in str(refused.value)
