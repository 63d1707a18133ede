from __future__ import annotations

import pytest

from evolution.training import algorithm_names, train_settings
from gym_mapbench.errors import ConfigError


@pytest.mark.parametrize("name", algorithm_names())
def test_every_algorithm_of_the_package_can_be_used(name):
    settings = train_settings(name)
    assert settings.algorithm == name
    assert settings.world.observation == settings.encoding.keys
    assert settings.world.action == "normalized"
    assert settings.world.lidar.beams <= 64


def test_a_config_is_laid_over_the_algorithm_and_options_over_both(tmp_path):
    path = tmp_path / "mine.yaml"
    path.write_text("algorithm: sac\nsteps: 7000\nworld: {control_hz: 10}\nhyperparameters: {batch_size: 32}\n")
    settings = train_settings(config=path, seed=4, steps=None)
    assert (settings.algorithm, settings.steps, settings.seed) == ("sac", 7000, 4)
    assert settings.world.control_hz == 10
    assert settings.world.lidar == train_settings("sac").world.lidar
    assert settings.hyperparameters["batch_size"] == 32
    assert settings.hyperparameters["gamma"] == train_settings("sac").hyperparameters["gamma"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"steps": 0}, r"config: steps: expected greater than or equal to 1, got 0"),
        ({"step": 5}, r"unknown key 'step'; did you mean 'steps'\?"),
        ({"world": {"beams": 3}}, "world: unknown key 'beams'"),
        ({"obstacles": []}, "expected stages that begin at 0"),
        ({"evaluation": {"obstacles": []}}, "evaluation.obstacles: expected at least one number"),
        ({"obstacles": [{"after": 0.2, "fewest": 1, "most": 2}]}, "expected stages that begin at 0"),
        ({"obstacles": [{"after": 0.0, "fewest": 3, "most": 2}]}, "expected at most as many fewest as most"),
        ({"encoding": {"features": ["goal"]}, "shaping": {"proximity": 1.0}}, "expected a feature of the scan"),
        ({"shaping": {"people": 1.0}}, "shaping.people: expected people among encoding.features, got none"),
        ({"people": {"count": 51}}, "people.count"),
        ({"world": {"maps": "a.yaml"}}, "world.maps: expected none, the maps are given apart"),
        ({"world": {"goal_ends_episode": False}}, "world.goal_ends_episode: expected true, as success is an end"),
        ({"action_noise": 0.1}, "action_noise: expected 0, as ppo samples its actions, got 0.1"),
        ({"learning_rate": [0.0, 0.1]}, "learning_rate.0"),
    ],
)
def test_what_cannot_be_used_is_named(options, message):
    with pytest.raises(ConfigError, match=message):
        train_settings("ppo", options)


def test_an_unknown_algorithm():
    with pytest.raises(ConfigError, match=r"unknown algorithm 'pro'; did you mean 'ppo'"):
        train_settings("pro")


def test_a_config_that_is_no_mapping(tmp_path):
    (tmp_path / "list.yaml").write_text("- 1\n")
    with pytest.raises(ConfigError, match=r"list.yaml: expected a mapping of options, got list"):
        train_settings("ppo", tmp_path / "list.yaml")
