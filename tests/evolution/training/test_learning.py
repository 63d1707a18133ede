"""Trainings of a few hundred steps: what they leave, how they are continued, and what is refused."""

from __future__ import annotations

import os
import signal
import sys
import tempfile

import numpy as np
import pytest

from controllers.learned.model_card import read_card
from evolution import bench, load, train
from evolution.training import TRAINING, Training, train_settings
from evolution.training.evaluation import judge
from evolution.training.learning import held_out_groups, make_levels
from evolution.training.levels import split
from evolution.training.worlds import EncodedWorlds
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import draw_scenario
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.scenario import Pose, Scenario
from tests.evolution.test_received import write_model

pytest.importorskip("stable_baselines3")

SMALL = {
    "steps": 320,
    "envs": 4,
    "world": {"time_limit": 8.0, "lidar": {"beams": 8}},
    "obstacles": [{"after": 0.0, "fewest": 0, "most": 3}],
    "evaluation": {"every": 150, "maps": 2, "obstacles": [2], "time_limit": 4.0},
    "network": {"hidden": [8]},
}
OF = {
    "ppo": {"hyperparameters": {"n_steps": 20, "batch_size": 40, "n_epochs": 2}},
    "sac": {"hyperparameters": {"buffer_size": 500, "learning_starts": 40, "batch_size": 8}},
    "td3": {"hyperparameters": {"buffer_size": 500, "learning_starts": 40, "batch_size": 8}},
}


def small(algorithm="ppo", **changes):
    return {**SMALL, **OF[algorithm], **changes}


def rooms(count):
    rng = np.random.default_rng(5)
    world = EnvConfig(shapes={"n_obstacles": (0, 3)})
    return [draw_scenario(world, rng) for _ in range(count)]


@pytest.mark.slow
@pytest.mark.parametrize("algorithm", OF)
def test_an_algorithm_learns_and_its_model_drives(algorithm, tmp_path, monkeypatch):
    seen = []
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    training = train(algorithm, config=small(algorithm), out=tmp_path / "run", on_progress=seen.append)
    assert not list((tmp_path / "temporary").glob("SB3*"))
    assert training.finished
    assert training.state["steps"] >= 320
    assert [row["steps"] for row in training.curve][-1] == training.state["steps"]
    assert len(training.curve) >= 2
    assert seen[-1].total == 320
    assert (training.path / "figures" / "learning_curve.svg").is_file()
    assert len(list((training.path / "checkpoints").iterdir())) == len(training.curve)
    assert training.best.stat().st_size < (training.path / "model.zip").stat().st_size
    card = read_card(training.best)
    assert (card.algorithm, card.world.lidar.beams, card.encoding.keys) == (algorithm, 8, ("goal", "velocity", "scan"))
    result = bench(rooms(1), [f"learned={training.best}"], time_limit=2.0, workers=1)
    assert result.table("runs")[0]["outcome"] in ("timeout", "collision")
    read = load(training.path)
    assert isinstance(read, Training)
    assert read.table().columns[:2] == ("steps", "seconds")


def test_networks_use_the_threads_that_they_are_given(tmp_path):
    import torch

    before, during = torch.get_num_threads(), []
    config = small(threads=3)
    train("ppo", config=config, out=tmp_path / "run", on_progress=lambda _: during.append(torch.get_num_threads()))
    assert set(during) == {3}
    assert torch.get_num_threads() == before


@pytest.mark.slow
def test_the_same_seed_is_the_same_model_and_another_is_not(tmp_path):
    def weights(name, seed):
        from stable_baselines3 import PPO

        training = train("ppo", config=small(), seed=seed, out=tmp_path / name)
        return PPO.load(training.path / "model.zip").policy.state_dict()["action_net.weight"].numpy()

    assert (weights("a", 1) == weights("b", 1)).all()
    assert (weights("c", 2) != weights("d", 1)).any()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("algorithm", "number"), [("ppo", signal.SIGTERM), ("sac", signal.SIGINT), ("td3", signal.SIGHUP)]
)
def test_a_signal_leaves_a_model_that_is_continued(algorithm, number, tmp_path):
    def interrupt(progress):
        if progress.steps >= 160:
            os.kill(os.getpid(), number)

    before = signal.getsignal(number)
    with pytest.raises(KeyboardInterrupt):
        train(algorithm, config=small(algorithm), out=tmp_path / "run", on_progress=interrupt)
    assert signal.getsignal(number) is before
    stopped = load(tmp_path / "run")
    assert not stopped.finished
    assert 160 <= stopped.state["steps"] < 320
    done = train(resume=tmp_path / "run")
    assert done.finished
    assert done.state["steps"] >= 320
    assert [row["steps"] for row in done.curve][: len(stopped.curve)] == [row["steps"] for row in stopped.curve]
    assert done.curve[-1]["seconds"] > stopped.state["seconds"]
    assert train(resume=tmp_path / "run").curve == done.curve


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGHUP])
def test_a_signal_that_was_ignored_before_does_not_stop_a_training(number, tmp_path):
    def interrupt(progress):
        os.kill(os.getpid(), number)

    before = signal.signal(number, signal.SIG_IGN)
    try:
        training = train("ppo", config=small(), out=tmp_path / "run", on_progress=interrupt)
    finally:
        signal.signal(number, before)
    assert training.finished


def test_a_signal_in_the_last_update_leaves_the_last_evaluation_to_do(tmp_path, monkeypatch):
    from stable_baselines3 import PPO

    update = PPO.train

    def interrupt(model):
        update(model)
        if model.num_timesteps >= 320:
            os.kill(os.getpid(), signal.SIGTERM)

    monkeypatch.setattr(PPO, "train", interrupt)
    with pytest.raises(KeyboardInterrupt):
        train("ppo", config=small(), out=tmp_path / "run")
    monkeypatch.undo()
    stopped = load(tmp_path / "run")
    assert stopped.state["steps"] == 320
    assert not stopped.finished
    done = train(resume=tmp_path / "run")
    assert done.finished
    assert [row["steps"] for row in done.curve] == [160, 320]


def test_statistics_travel_with_the_model(tmp_path):
    config = small(normalize_observations=True, normalize_rewards=True)
    training = train("ppo", config=config, out=tmp_path / "run")
    card = read_card(training.best)
    assert len(card.normalization.mean) == card.input_size
    assert (training.path / "vecnormalize.npz").is_file()
    assert np.std(card.normalization.mean) > 0


def test_given_maps_and_a_curriculum_are_kept_in_the_directory(tmp_path):
    training = train("ppo", config=small(steps=100), maps=rooms(6), curriculum=rooms(5), out=tmp_path / "run")
    assert {"maps", "curriculum"} <= set(training.curve[0])
    (tmp_path / "run" / "state.json").unlink()
    assert train(resume=tmp_path / "run").finished


@pytest.mark.slow
def test_a_policy_that_sees_the_path_is_trained_and_drives(tmp_path):
    encoding = {"features": ["goal", "velocity", "scan", "path"]}
    config = small(encoding=encoding, world={**SMALL["world"], "path": {"points": 5, "spacing": 0.2}}, anywhere=0.5)
    training = train("ppo", config=config, out=tmp_path / "run")
    assert read_card(training.best).world.path.points == 5
    result = bench(rooms(1), [f"learned={training.best}"], time_limit=2.0, workers=1)
    assert result.table("runs")[0]["outcome"] in ("timeout", "collision")


def test_given_maps_on_which_no_episode_can_begin_are_refused(tmp_path):
    halves = GridMap.from_rows(["#" * 80, *["#" + "." * 38 + "##" + "." * 38 + "#"] * 20, "#" * 80])
    apart = Scenario(halves, Pose(1.0, 0.5), Pose(3.0, 0.5), "halves")
    encoding = {"features": ["goal", "velocity", "scan", "path"]}
    with pytest.raises(ConfigError, match="halves: expected a map on which the planner finds the observed path"):
        train("ppo", config=small(encoding=encoding), maps=[apart], out=tmp_path / "run")
    inside = Scenario(halves, Pose(1.0, 0.1), Pose(1.0, 0.5))
    with pytest.raises(ConfigError, match="start: expected room for the robot"):
        train("ppo", config=small(), curriculum=[inside], out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_every_fifth_map_is_held_out():
    maps = rooms(11)
    kept, held_out = split(maps)
    assert held_out == [maps[4], maps[9]]
    assert [*kept, *held_out] != maps
    assert {one.digest for one in kept} | {one.digest for one in held_out} == {one.digest for one in maps}
    assert split(maps[:4]) == (maps[:4], maps[:4])


def test_held_out_random_maps_are_the_same_for_every_seed_and_no_training_map():
    one, two = (train_settings("ppo", small(), seed=seed) for seed in (1, 2))
    digests = [{level.digest for level in held_out_groups(each, (), ())["random_2"]} for each in (one, two)]
    assert digests[0] == digests[1]
    levels = make_levels(one, (), ())
    assert not digests[0] & {levels.next(0.0).digest for _ in range(30)}


class TestJudge:
    world = EnvConfig(control_hz=5.0, time_limit=20.0, action="normalized", observation=("goal",))

    def judged(self, act, maps):
        settings = train_settings(
            "ppo", {"encoding": {"features": ["goal"]}, "shaping": {"proximity": 0.0, "reverse": 0.0}}
        )
        return judge(act, self.world, settings.encoding, maps, 0)

    def test_every_map_is_driven_once(self):
        corridor = GridMap.from_rows(["#" * 80, *["#" + "." * 78 + "#"] * 20, "#" * 80])
        reached = [Scenario(corridor, Pose(0.5, 0.5), Pose(0.6 + 0.01 * i, 0.5)) for i in range(70)]
        away = [Scenario(corridor, Pose(2.0, 0.5), Pose(1.0 + 0.001 * i, 0.5)) for i in range(30)]
        found = self.judged(lambda features: np.tile([1.0, 0.0], (len(features), 1)), [*reached, *away])
        assert found.outcomes == {"goal": 70, "collision": 30}
        assert found.runs == 100
        low, high = found.interval
        assert low < found.success == 0.7 < high
        assert found.time == pytest.approx(0.6, abs=0.01)

    def test_standing_still_runs_out_of_time(self):
        found = self.judged(lambda features: np.zeros((len(features), 2)), rooms(3))
        assert (found.outcomes, found.time) == ({"timeout": 3}, None)


def test_a_world_begins_anew_on_its_next_level():
    settings = train_settings("ppo", small())
    drawn = []
    maps = rooms(20)

    def next_level():
        drawn.append(maps[len(drawn) % len(maps)])
        return drawn[-1]

    world = settings.world.replace(time_limit=0.6)
    worlds = EncodedWorlds(2, world, settings.encoding, next_level, 0)
    first = worlds.reset()
    for _ in range(3):
        step = worlds.step(np.array([[1.0, 0.0], [0.0, 1.0]]))
    assert step.truncated.all()
    assert [outcome for _, outcome in step.outcomes.values()] == ["timeout", "timeout"]
    again = worlds.begin_again(step.ended)
    assert len(drawn) == 4
    assert (again != step.features).any()
    assert again.shape == first.shape == (2, worlds.inputs)


def test_nearness_to_walls_is_taken_off():
    corridor = GridMap.from_rows(["#" * 80, *["#" + "." * 78 + "#"] * 20, "#" * 80])
    level = Scenario(corridor, Pose(1.0, 0.5), Pose(3.0, 0.5))
    rewards = {}
    for proximity in (0.0, 2.0):
        changes = {
            "shaping": {"proximity": proximity, "reach": 0.5, "stall_time": 0.0},
            "world": {"lidar": {"beams": 4}},
        }
        settings = train_settings("ppo", {**SMALL, **changes})
        worlds = EncodedWorlds(1, settings.world, settings.encoding, lambda: level, 0, settings.shaping)
        worlds.reset()
        rewards[proximity] = worlds.step(np.zeros((1, 2))).rewards[0]
    # The lower wall ends at y = 0.05 m: 0.45 m from the centre, 0.23 m from the outline, of 0.5 m.
    assert rewards[0.0] - rewards[2.0] == pytest.approx(2.0 / 5.0 * (1 - 0.23 / 0.5), abs=1e-5)


def test_nearness_to_people_is_taken_off():
    room = GridMap.from_rows(["#" * 80, *["#" + "." * 78 + "#"] * 60, "#" * 80])
    stands = MotionSpec(name="scripted", options={"waypoints": [[1.0, 2.5], [1.0, 2.5]], "speed": 0.3})
    level = Scenario(room, Pose(1.0, 1.5), Pose(3.0, 1.5), bodies=(Body(shape=Disc(radius=0.25), motion=stands),))
    encoding, rewards = {"features": ["goal", "velocity", "scan", "people"]}, {}
    for people in (0.0, 2.0):
        settings = train_settings("ppo", {**SMALL, "encoding": encoding, "shaping": {"people": people}})
        worlds = EncodedWorlds(1, settings.world, settings.encoding, lambda: level, 0, settings.shaping)
        worlds.reset()
        rewards[people] = worlds.step(np.zeros((1, 2))).rewards[0]
    gap = 1.0 - 0.25 - settings.world.robot.circumscribed_radius
    assert rewards[0.0] - rewards[2.0] == pytest.approx(2.0 / 5.0 * (1 - gap / 1.2), abs=1e-5)


def test_people_are_on_held_out_maps():
    settings = train_settings("ppo", {**SMALL, "people": {"count": 3}})
    assert [len(scenario.bodies) for scenario in held_out_groups(settings, (), ())["random_2"]] == [3, 3]


def test_driving_backwards_is_taken_off():
    rewards = {}
    for reverse in (0.0, 2.0):
        settings = train_settings("ppo", {**SMALL, "shaping": {"reverse": reverse, "proximity": 0.0}})
        room = Scenario(rooms(1)[0].map, *(Pose(*pose) for pose in ((6.95, 0.55, 2.36), (0.55, 6.95, 2.36))))
        worlds = EncodedWorlds(2, settings.world, settings.encoding, lambda room=room: room, 0, settings.shaping)
        worlds.reset()
        rewards[reverse] = worlds.step(np.array([[-0.2, 0.0], [0.2, 0.0]])).rewards
    # 0.2 of the 0.35 m/s that it can drive backwards, reached within the step, for 0.2 s.
    assert rewards[0.0] - rewards[2.0] == pytest.approx([2.0 * 0.07 * 0.2, 0.0], abs=1e-6)


def test_who_comes_no_closer_for_too_long_is_stopped():
    corridor = GridMap.from_rows(["#" * 80, *["#" + "." * 78 + "#"] * 20, "#" * 80])
    level = Scenario(corridor, Pose(1.0, 0.5), Pose(3.0, 0.5))
    changes = {"shaping": {"proximity": 0.0, "stall_time": 1.0, "stall": 3.0}, "world": {"reward": {"time": 0.0}}}
    settings = train_settings("ppo", {**SMALL, **changes})
    worlds = EncodedWorlds(2, settings.world, settings.encoding, lambda: level, 0, settings.shaping)
    worlds.reset()
    steps = [worlds.step(np.array([[1.0, 0.0], [0.0, 0.0]])) for _ in range(5)]
    assert not any(step.ended.any() for step in steps[:-1])
    done = steps[-1]
    assert done.ended.tolist() == [False, True]
    assert done.outcomes == {1: (level, "stalled")}
    assert not done.truncated.any()
    assert done.rewards[1] == pytest.approx(-3.0)
    worlds.begin_again(done.ended)
    assert not worlds.step(np.zeros((2, 2))).ended.any()


def unfinished(path):
    """Leave a training as if it was stopped after a few steps."""
    train("ppo", config=small(steps=80), out=path)
    state = (path / "state.json").read_text().replace("true", "false")
    (path / "state.json").write_text(state)


@pytest.mark.parametrize("algorithm", OF)
def test_a_training_that_diverges_ends_in_one_line(algorithm, tmp_path):
    with pytest.raises(
        RunError, match=r"run: the training has diverged at step \d+: expected finite weights"
    ) as caught:
        train(algorithm, config=small(algorithm, learning_rate=[1e30, 1e30]), out=tmp_path / "run")
    assert "\n" not in str(caught.value)


class TestRefused:
    def test_a_directory_that_holds_something(self, tmp_path):
        (tmp_path / "other.txt").write_text("mine")
        with pytest.raises(ConfigError, match="expected a new or empty directory"):
            train("ppo", config=small(), out=tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["other.txt"]

    def test_a_directory_of_another_training(self, tmp_path):
        TRAINING.begin(tmp_path / "run", {})
        with pytest.raises(ConfigError, match="already holds a training; continue it with --resume"):
            train("ppo", config=small(), out=tmp_path / "run")

    def test_a_directory_to_continue_that_is_none(self, tmp_path):
        with pytest.raises(RunError, match="not a training directory"):
            train(resume=tmp_path)

    def test_maps_that_are_held_out_and_trained_on(self, tmp_path):
        first, *others = maps = rooms(5)
        for options in ({"maps": maps, "curriculum": others}, {"maps": [*others, first], "curriculum": maps}):
            with pytest.raises(ConfigError, match="one holds out and the other trains on, got random"):
                train("ppo", config=small(), out=tmp_path / "run", **options)
        assert not (tmp_path / "run").exists()

    def test_other_options_beside_resume(self, tmp_path):
        with pytest.raises(ConfigError, match="resume: expected no other option, got steps"):
            train(resume=tmp_path, steps=5)

    @pytest.mark.parametrize(
        ("hyperparameters", "message"),
        [
            ({"n_step": 5}, r"unknown hyperparameter of ppo 'n_step'; did you mean 'n_steps'"),
            ({"env": 5}, "unknown hyperparameter of ppo 'env'"),
        ],
    )
    def test_unknown_hyperparameters(self, tmp_path, hyperparameters, message):
        with pytest.raises(ConfigError, match=message):
            train("ppo", config=small(hyperparameters=hyperparameters), out=tmp_path / "run")
        assert not (tmp_path / "run").exists()

    @pytest.mark.parametrize(
        ("algorithm", "hyperparameters", "message"),
        [
            ("ppo", {"gamma": "abc"}, r"hyperparameters.gamma: expected a number, got 'abc'"),
            ("ppo", {"n_epochs": 2.5}, r"hyperparameters.n_epochs: expected a whole number, got 2.5"),
            ("ppo", {"clip_range": True}, r"hyperparameters.clip_range: expected a number, got True"),
            ("ppo", {"normalize_advantage": 1}, r"hyperparameters.normalize_advantage: expected true or false, got 1"),
            ("ppo", {"n_epochs": 0}, r"hyperparameters.n_epochs: expected at least 1, got 0"),
            ("ppo", {"gamma": 1.5}, r"hyperparameters.gamma: expected 0 to 1, got 1.5"),
            ("ppo", {"target_kl": "a"}, r"hyperparameters.target_kl: expected a number, got 'a'"),
            ("ppo", {"target_kl": 0}, r"hyperparameters.target_kl: expected more than 0, got 0"),
            ("ppo", {"clip_range": -0.2}, r"hyperparameters.clip_range: expected more than 0, got -0.2"),
            ("ppo", {"max_grad_norm": 0.0}, r"hyperparameters.max_grad_norm: expected more than 0, got 0.0"),
            ("sac", {"ent_coef": -1}, r"hyperparameters.ent_coef: expected at least 0, got -1"),
            ("sac", {"gradient_steps": 0}, r"hyperparameters.gradient_steps: expected at least 1, or -1, got 0"),
            ("sac", {"learning_starts": 320}, r"steps: expected more than hyperparameters.learning_starts, 320"),
            ("sac", {"learning_starts": 0, "replay_buffer_kwargs": 5}, r"hyperparameters of sac: cannot be used"),
            ("td3", {"train_freq": 0}, r"hyperparameters.train_freq: expected at least 1, got 0"),
            ("sac", {"_init_setup_model": False}, r"unknown hyperparameter of sac '_init_setup_model'"),
            ("sac", {"train_freq": [1, "episode"]}, r"hyperparameters.train_freq: expected a whole number, got \[1, "),
        ],
    )
    def test_a_hyperparameter_of_the_wrong_kind(self, algorithm, hyperparameters, message, tmp_path):
        with pytest.raises(ConfigError, match=message):
            train(algorithm, config=small(algorithm, hyperparameters=hyperparameters), out=tmp_path / "run")
        assert not (tmp_path / "run").exists()

    def test_without_stable_baselines3(self, tmp_path, monkeypatch):
        monkeypatch.setitem(sys.modules, "stable_baselines3", None)
        with pytest.raises(ConfigError, match=r"training needs stable-baselines3 \(pip install 'gym-mapbench\[rl\]'\)"):
            train("ppo", config=small(), out=tmp_path / "run")
        assert not (tmp_path / "run").exists()

    def test_a_model_that_was_damaged(self, tmp_path):
        unfinished(tmp_path / "run")
        (tmp_path / "run" / "model.zip").write_bytes(b"no zip")
        with pytest.raises(RunError, match=r"model.zip: cannot be read as an archive"):
            train(resume=tmp_path / "run")

    def test_a_training_that_somebody_sent_runs_no_code(self, tmp_path, monkeypatch):
        monkeypatch.chdir(tmp_path)
        unfinished(tmp_path / "run")
        write_model(tmp_path / "run" / "model.zip")
        with pytest.raises(RunError, match=r"model.zip: cannot be continued as a model of ppo"):
            train(resume=tmp_path / "run")
        assert not (tmp_path / "mark").exists()
