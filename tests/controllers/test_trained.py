"""Models with a card: what they see, how often they decide, and what is said where a world differs."""

from __future__ import annotations

import json
import zipfile

import numpy as np
import pytest

from controllers.learned.encoding import EncodingSettings
from controllers.learned.model_card import CARD, ModelCard, Normalization, read_card, write_card
from controllers.learned.trained import TrainedPolicy
from controllers.registry import make_controller
from controllers.rl import as_controller
from evolution.driving import environment_for, run_episode
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

WORLD = EnvConfig(control_hz=5.0, lidar={"beams": 16, "range_max": 6.0})
ROOM = Scenario(GridMap.from_rows(["#" * 60, *["#" + "." * 58 + "#"] * 58, "#" * 60]), Pose(1.0, 1.0), Pose(2.0, 1.0))


def card_of(**options):
    return ModelCard(**{"algorithm": "ppo", "world": WORLD, "encoding": EncodingSettings(frames=2), **options})


class Recorder:
    """Drives straight ahead and remembers what it saw."""

    def __init__(self, action=(1.0, 0.0)):
        self.seen = []
        self.action = action

    def predict(self, seen, deterministic):
        assert deterministic
        self.seen.append(seen)
        return np.array([self.action]), None


def drive(card, world, action=(1.0, 0.0)):
    network = Recorder(action)
    controller = TrainedPolicy(network.predict, "learned", card)
    env = environment_for(world, controller)
    return network, env, run_episode(env, controller, ROOM, name="learned", seed=0)


def test_it_decides_as_often_as_in_training_and_sees_with_its_own_scanner():
    network, env, episode = drive(card_of(), EnvConfig(control_hz=20.0, time_limit=1.0))
    assert (env.config.lidar.beams, env.config.lidar.range_max) == (16, 6.0)
    assert len(episode.commands) == 20
    assert len(network.seen) == 5
    assert network.seen[0].shape == (1, card_of().input_size)
    assert (episode.commands == (0.5, 0.0)).all()


def test_what_the_other_robot_can_do_is_what_the_actions_are_shares_of():
    _, _, episode = drive(card_of(), EnvConfig(robot="turtlebot3_burger", time_limit=0.2), (1.0, -0.5))
    assert episode.commands[0] == pytest.approx((0.22, -0.5 * 2.84))


def test_a_robot_too_fast_for_the_physics_of_the_training_is_driven():
    fast = WORLD.robot.replace(name="fast", max_linear_velocity=6.0)
    world = EnvConfig(robot=fast, physics_hz=1000.0, time_limit=0.2)
    _, _, episode = drive(card_of(), world)
    assert episode.commands[0] == pytest.approx((6.0, 0.0))
    straight = as_controller(lambda observation: (0.3, 0.0), "straight", ("goal",))
    episode = run_episode(environment_for(world, straight), straight, ROOM, name="straight", seed=0)
    assert episode.commands[0] == pytest.approx((0.3, 0.0))


def test_the_mount_of_the_scanner_stays_the_worlds():
    world = EnvConfig(noise="nominal", lidar={"x": 0.05, "scan_rate": 5.0})
    lidar = card_of().fit(world).lidar
    assert (lidar.x, lidar.scan_rate, lidar.beams) == (0.05, 5.0, 16)


def test_statistics_of_the_input_are_applied():
    size = card_of().input_size
    statistics = Normalization(mean=(1.0,) * size, variance=(4.0,) * size, epsilon=0.0, clip=0.25)
    network, *_ = drive(card_of(normalization=statistics), EnvConfig(time_limit=0.1))
    plain, *_ = drive(card_of(), EnvConfig(time_limit=0.1))
    assert network.seen[0] == pytest.approx(np.clip((plain.seen[0] - 1) / 2, -0.25, 0.25))


def test_a_rate_that_does_not_fit_is_refused_in_one_line():
    message = r"^learned: control_hz: expected a multiple of 5, the rate at which the model decides, got 12.5$"
    with pytest.raises(ConfigError, match=message):
        drive(card_of(), EnvConfig(control_hz=12.5))


@pytest.mark.parametrize("action", [(np.nan, 0.0), (1.0, 2.0, 3.0)])
def test_a_network_that_returns_nonsense_is_named(action):
    with pytest.raises(ConfigError, match=r"^learned: action: expected two"):
        drive(card_of(), EnvConfig(), action)


def test_differences_are_said():
    world = EnvConfig(robot="jackal", noise="nominal", yaw_goal_tolerance=0.1)
    assert card_of().differences(world) == [
        "trained with the robot turtlebot3_waffle and drives jackal, its actions as shares of that robot's limits",
        "sees with its own 16 beams to 6 m instead of 360 to 3.5 m",
        "trained with other noise",
        "trained with commands that are 0 s late, here it is 0.01 s",
        "trained with yaw_goal_tolerance 0.25, here it is 0.1",
    ]
    assert card_of().differences(WORLD.replace(control_hz=20.0)) == []


def test_the_same_level_of_noise_is_another_delay_at_another_rate():
    card = card_of(world=WORLD.replace(noise="nominal"))
    world = card.fit(EnvConfig(noise="nominal"))
    assert card.differences(world) == ["trained with commands that are 0.04 s late, here it is 0.01 s"]
    assert card.differences(world.replace(control_hz=5.0)) == []


def test_what_the_world_decides_is_said_where_it_differs():
    world = WORLD.replace(plant="fortress", lidar={**WORLD.lidar.model_dump(), "no_reading": "zero", "scan_rate": 5.0})
    said = [
        "trained with plant ideal, here it is fortress",
        "trained with lidar.no_reading range_max, here it is zero",
        "trained with lidar.scan_rate None, here it is 5.0",
    ]
    assert card_of().differences(world) == said
    assert card_of(encoding=EncodingSettings(features=("goal",))).differences(world) == said[:1]


def test_a_policy_that_sees_the_path_has_it_planned_as_in_training():
    trained = WORLD.replace(observation=("path",), costmap={"cost_scaling_factor": 10.0}, path={"rooms": (0.05, 0.0)})
    card = card_of(world=trained, encoding=EncodingSettings(features=("path",)))
    fitted = card.fit(EnvConfig())
    assert (fitted.path, fitted.costmap) == (trained.path, trained.costmap)
    assert "sees its own window of path" in card.differences(EnvConfig())
    assert card_of().fit(EnvConfig()).costmap == EnvConfig().costmap


class TestFile:
    @pytest.fixture
    def model(self, tmp_path):
        with zipfile.ZipFile(tmp_path / "model.zip", "w") as archive:
            archive.writestr("data", "{}")
        return tmp_path / "model.zip"

    def test_a_card_comes_back_as_it_was_written(self, model):
        assert read_card(model) is None
        card = card_of(normalization=Normalization(mean=(0.1,), variance=(2.0,)), training={"steps": 3})
        write_card(model, card)
        assert read_card(model) == card

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("no json", "mapbench.json: not a JSON file"),
            ("[1]", "expected a mapping"),
            ('{"format_version": 2}', "format_version: expected 1, got 2"),
            ('{"algorithm": "ppo"}', "missing key"),
        ],
    )
    def test_a_damaged_card(self, model, text, message):
        with zipfile.ZipFile(model, "a") as archive:
            archive.writestr(CARD, text)
        with pytest.raises(ConfigError, match=message):
            read_card(model)

    def test_a_card_of_another_network(self, tmp_path):
        sb3 = pytest.importorskip("stable_baselines3")
        from gymnasium.spaces import Box

        from tests.controllers.test_rl import Room

        room = Room()
        room.observation_space = Box(-1.0, 1.0, (7,))
        path = tmp_path / "model.zip"
        sb3.PPO("MlpPolicy", room).save(path)
        write_card(path, card_of())
        size = card_of().input_size
        with pytest.raises(ConfigError, match=rf"expected a network for \({size},\) inputs, as its card says, got"):
            make_controller(f"learned={path}")


class Plain:
    """A policy over the env's own Dict observation, trained with 12 beams to 5 m."""

    def __init__(self, **sizes):
        from gymnasium.spaces import Box, Dict

        shapes = {"scan": (12,), "path": (8,), "costmap": (1, 6, 6), "goal": (3,)} | sizes
        self.observation_space = Dict({key: Box(0.0, 5.0, shape) for key, shape in shapes.items()})

    def predict(self, observation, deterministic):
        return np.array([0.1, 0.0]), None


def test_a_plain_model_is_given_sensors_of_its_sizes():
    env = environment_for(EnvConfig(), as_controller(Plain(), "plain"))
    assert {key: space.shape for key, space in env.observation_space.items()} == {
        "scan": (12,),
        "path": (8,),
        "costmap": (1, 6, 6),
        "goal": (3,),
    }
    assert env.config.lidar.range_max == 5.0


@pytest.mark.parametrize(
    ("sizes", "message"),
    [
        ({"goal": (2,)}, r"^plain: expected goal of shape \(2,\), the world's is \(3,\)$"),
        ({"path": (7,)}, r"^plain: expected path of shape \(7,\), the world's is \(6,\)$"),
        ({"camera": (3,)}, r"^plain: .*unknown observation key 'camera'"),
    ],
)
def test_a_plain_model_whose_spaces_do_not_match(sizes, message):
    with pytest.raises(ConfigError, match=message):
        environment_for(EnvConfig(), as_controller(Plain(**sizes), "plain"))


def test_the_card_is_json_that_a_stranger_can_read(tmp_path):
    with zipfile.ZipFile(tmp_path / "m.zip", "w"):
        pass
    write_card(tmp_path / "m.zip", card_of())
    with zipfile.ZipFile(tmp_path / "m.zip") as archive:
        document = json.loads(archive.read(CARD))
    assert document["world"]["control_hz"] == 5.0
    assert document["encoding"]["features"] == ["goal", "velocity", "scan"]
