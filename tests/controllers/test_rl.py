from __future__ import annotations

import base64
import functools
import json
import sys
import zipfile

import gymnasium
import numpy as np
import pytest
from gymnasium.spaces import Box, Dict, Discrete, MultiBinary, MultiDiscrete

from controllers.model_files import model_data, uncompressed
from controllers.registry import make_controller
from controllers.rl import as_controller, load_sb3
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from tests.controllers.plain_follower import context

OBSERVATION = {"goal": np.zeros(3, dtype=np.float32), "scan": np.full(8, 2.0, dtype=np.float32)}


class Policy:
    """Predicts with a state that counts calls."""

    observation_space = Dict({"scan": Box(0, 9, (8,)), "goal": Box(-9, 9, (3,))})

    def __init__(self) -> None:
        self.seen: list[tuple] = []

    def predict(self, observation, state=None, episode_start=None, deterministic=False):
        self.seen.append((state, bool(episode_start[0]), deterministic))
        return np.array([0.1, 0.2]), (state or 0) + 1


SEEN = [(None, True, True), (1, False, True), (2, False, True)]
"""What a policy is told in three steps of an episode."""


def acted(policy, **options):
    controller = as_controller(policy, "mine", **options)
    controller.reset(context())
    return controller.act(OBSERVATION)


def drive_two_episodes(controller):
    for _ in range(2):
        controller.reset(context())
        for _ in range(3):
            controller.act(OBSERVATION)


@pytest.mark.parametrize(
    "answer", [(0.1, 0.2), [0.1, 0.2], np.array([0.1, 0.2]), (np.array([0.1, 0.2]), None), ([0.1, 0.2], "state")]
)
def test_every_form_of_answer(answer):
    assert acted(lambda observation: answer) == (0.1, 0.2)


def test_state_is_carried_until_reset():
    policy = Policy()
    drive_two_episodes(as_controller(policy, "mine"))
    assert policy.seen == 2 * SEEN


def test_observed_keys_are_the_policys_own():
    assert set(as_controller(Policy(), "mine").observation_keys) == {"scan", "goal"}
    assert as_controller(Policy(), "mine", observation_keys=("goal",)).observation_keys == ("goal",)
    assert as_controller(lambda observation: (0, 0), "mine").observation_keys == EnvConfig().observation


class Delegate:
    """Passes on what it is given, as wrappers around a model do."""

    def __init__(self, policy):
        self.policy = policy

    def predict(self, *args, **kwargs):
        return self.policy.predict(*args, **kwargs)


class Options(Delegate):
    """Names the observation alone."""

    def predict(self, observation, **options):
        return self.policy.predict(observation, **options)


@pytest.mark.parametrize(
    "form",
    [
        *(Delegate, Options, lambda policy: policy.predict, lambda policy: Delegate(policy).predict),
        *(lambda policy: functools.partial(policy.predict), lambda policy: functools.partial(Delegate(policy).predict)),
    ],
)
def test_every_form_of_predict_is_told_the_state_and_the_beginning(form):
    policy = Policy()
    drive_two_episodes(as_controller(form(policy), "mine", ("goal",)))
    assert policy.seen == 2 * SEEN


def test_what_a_partial_has_bound_stays():
    policy = Policy()
    acted(functools.partial(policy.predict, deterministic=False))
    assert policy.seen == [(None, True, False)]


def test_an_observation_may_have_the_name_of_an_option():
    assert acted(lambda state: tuple(state["scan"][:2])) == (2.0, 2.0)
    assert acted(lambda state, deterministic: (float(deterministic), 0.0)) == (1.0, 0.0)


def test_a_module_of_torch_is_told_what_its_forward_takes():
    torch = pytest.importorskip("torch")

    class Plain(torch.nn.Module):
        def forward(self, observation):
            return torch.tensor([0.1, 0.2])

    class Recurrent(torch.nn.Module):
        def forward(self, observation, state=None):
            return torch.tensor([0.1, 0.2]), (state or 0) + 1

    assert acted(Plain()) == pytest.approx((0.1, 0.2))
    assert acted(Recurrent()) == pytest.approx((0.1, 0.2))


def test_a_tensor_with_a_gradient_is_one_clear_line():
    torch = pytest.importorskip("torch")
    with pytest.raises(ConfigError, match=r"^mine: action: expected two numbers, got tensor\(.*requires_grad"):
        acted(lambda observation: torch.zeros(2, requires_grad=True))


@pytest.mark.parametrize("kind", [np.float32, np.float64])
@pytest.mark.parametrize("form", [np.float32, np.float64, list])
def test_share_of_the_limits_becomes_physical(kind, form):
    share = [0.5, -0.25] if form is list else np.array([0.5, -0.25], form)
    policy = Policy()
    policy.predict = lambda observation: (share, None)
    policy.action_space = Box(-1.0, 1.0, (2,), kind)
    assert acted(policy) == (0.5 * 0.5, -0.25 * 1.9)


def test_observations_come_in_the_type_of_the_policys_space():
    policy, seen = Policy(), {}
    policy.observation_space = Dict({"goal": Box(-9, 9, (3,), np.float64), "scan": Box(0, 9, (8,), np.float32)})
    policy.predict = lambda observation: seen.update(observation) or (0.1, 0.2)
    acted(policy)
    assert {key: value.dtype for key, value in seen.items()} == {"goal": np.float64, "scan": np.float32}
    assert OBSERVATION["goal"].dtype == np.float32


def test_the_world_shows_as_many_bodies_as_the_policy_was_made_for():
    policy = Policy()
    policy.observation_space = Dict({"people": Box(-1e8, 1e8, (12,)), "path": Box(-1e8, 1e8, (6,))})
    fitted = as_controller(policy, "mine").fit(EnvConfig())
    assert (fitted.people.nearest, fitted.path.points) == (2, 3)


@pytest.mark.parametrize("answer", [(1.0, float("nan")), np.zeros(3), "fast", np.zeros((1, 2))])
def test_bad_action_names_the_policy(answer):
    with pytest.raises(ConfigError, match=r"^mine: action: expected two"):
        acted(lambda observation: answer)


def test_a_policy_that_returns_nothing_is_told_so():
    with pytest.raises(ConfigError, match=r"^mine: action: expected two numbers, got None$"):
        acted(lambda observation: None)


def test_neither_policy_nor_callable():
    with pytest.raises(ConfigError, match=r"mine: expected an object with predict\(obs\) or a callable, got int"):
        as_controller(3, "mine")


def test_keys_are_several_names():
    with pytest.raises(ConfigError, match=r"^mine: observation_keys: expected several names, got 'goal'$"):
        as_controller(Policy(), "mine", "goal")
    with pytest.raises(ConfigError, match=r"^mine: observation: expected at least one key"):
        as_controller(Policy(), "mine", ()).fit(EnvConfig())


def test_flat_observation_space_is_refused():
    policy = Policy()
    policy.observation_space = Box(0, 1, (11,))
    with pytest.raises(
        ConfigError, match=r"expected a policy over the env's Dict observation, .* a Box of shape \(11,\)$"
    ):
        as_controller(policy, "mine")


@pytest.mark.parametrize("space", [Discrete(5), MultiDiscrete([3, 3]), MultiBinary(2), Box(-1.0, 1.0, (3,))])
def test_actions_that_are_not_two_continuous_numbers_are_refused(space):
    policy = Policy()
    policy.action_space = space
    with pytest.raises(ConfigError, match=r"^mine: expected a policy whose actions are a Box of shape \(2,\), got a "):
        as_controller(policy, "mine")


class Room(gymnasium.Env):
    """Nothing but the spaces a model is made for."""

    observation_space = Policy.observation_space
    action_space = Box(-1.0, 1.0, (2,))

    def reset(self, *, seed=None, options=None):
        return OBSERVATION, {}


class TestStableBaselines3:
    @pytest.fixture
    def sb3(self):
        return pytest.importorskip("stable_baselines3")

    @pytest.mark.parametrize("algorithm", ["PPO", "A2C", "SAC", "DDPG"])
    def test_model_acts_as_it_predicts(self, sb3, algorithm, tmp_path):
        replay = {"buffer_size": 1000} if algorithm in ("SAC", "DDPG") else {}
        model = getattr(sb3, algorithm)("MultiInputPolicy", Room(), seed=0, **replay)
        model.save(tmp_path / "model.zip")
        controller = make_controller(f"learned={tmp_path / 'model.zip'}")
        if replay:
            assert controller._predict.__self__.replay_buffer.buffer_size == 1
        assert (controller.name, set(controller.observation_keys)) == ("learned", {"scan", "goal"})
        controller.reset(context())
        share, _ = model.predict(OBSERVATION, deterministic=True)
        v, w = controller.act(OBSERVATION)
        assert (v, w) == pytest.approx((share[0] * (0.5 if share[0] > 0 else 0.35), share[1] * 1.9), abs=1e-6)

    def test_name_from_the_file(self, sb3, tmp_path):
        sb3.PPO("MultiInputPolicy", Room()).save(tmp_path / "brave.zip")
        assert make_controller(str(tmp_path / "brave.zip")).name == "brave"
        assert make_controller(str(tmp_path / "brave.zip"), label="timid").name == "timid"

    def test_broken_model(self, sb3, tmp_path):
        with zipfile.ZipFile(tmp_path / "broken.zip", "w") as archive:
            archive.writestr("data", json.dumps({"policy_class": {"__module__": "stable_baselines3.sac.policies"}}))
        with pytest.raises(ConfigError, match=r"^x: .*broken.zip cannot be loaded as a SAC model \(.*\)$"):
            load_sb3(tmp_path / "broken.zip", "x")

    def test_file_without_the_weights_of_the_policy(self, sb3, tmp_path):
        sb3.PPO("MultiInputPolicy", Room()).save(tmp_path / "whole.zip")
        rewrite(tmp_path / "whole.zip", tmp_path / "part.zip", **{"policy.pth": None})
        with pytest.raises(ConfigError, match="Names of parameters do not match"):
            load_sb3(tmp_path / "part.zip", "x")

    def test_policy_kwargs_that_cannot_be_read_are_refused(self, sb3, tmp_path):
        """Without its keywords a policy may have the shapes of the saved one, and another activation function."""
        relu = pytest.importorskip("torch").nn.ReLU
        sb3.PPO("MultiInputPolicy", Room(), policy_kwargs={"activation_fn": relu}).save(tmp_path / "whole.zip")
        data = model_data(tmp_path / "whole.zip")
        data["policy_kwargs"][":serialized:"] = base64.b64encode(b"cbuiltins\nlen\n(I5\ntR.").decode()  # len(5)
        rewrite(tmp_path / "whole.zip", tmp_path / "other.zip", data=json.dumps(data))
        with pytest.raises(ConfigError, match=r"Could not deserialize object policy_kwargs.*has no len\(\)\)$"):
            load_sb3(tmp_path / "other.zip", "x")

    @pytest.mark.parametrize("algorithm", ["PPO", "SAC"])
    def test_what_only_learning_needs_is_not_unpickled(self, sb3, algorithm, tmp_path):
        """A schedule that another Python compiled is not loaded, or crashes the process when it is called."""
        replay = {"buffer_size": 10, "train_freq": (1, "episode")} if algorithm == "SAC" else {"clip_range": abs}
        model = getattr(sb3, algorithm)("MultiInputPolicy", Room(), learning_rate=lambda left: 3e-4 * left, **replay)
        model.save(tmp_path / "whole.zip")
        data = model_data(tmp_path / "whole.zip")
        learning = [name for name in data if name in ("learning_rate", "lr_schedule", "clip_range", "train_freq")]
        for name in learning:
            data[name][":serialized:"] = base64.b64encode(b"of another Python").decode()
        rewrite(tmp_path / "whole.zip", tmp_path / "other.zip", data=json.dumps(data))
        controller = load_sb3(tmp_path / "other.zip", "x")
        controller.reset(context())
        share, _ = model.predict(OBSERVATION, deterministic=True)
        assert controller.act(OBSERVATION)[1] == pytest.approx(share[1] * 1.9, abs=1e-6)


def rewrite(source, target, **changes):
    """Copy a model file, compressed and with other parts; None leaves a part out."""
    with zipfile.ZipFile(source) as old, zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as new:
        for name in old.namelist():
            if (content := changes.get(name, old.read(name))) is not None:
                new.writestr(name, content)


def write(path, data):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("data", data)
    return path


def test_parts_of_a_model_file_are_unpacked_once(tmp_path):
    """A part that stays compressed is unpacked again for every step back that its reader takes."""
    parts = {"data": "{}", "policy.pth": "weights" * 99}
    with zipfile.ZipFile(tmp_path / "m.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in parts.items():
            archive.writestr(name, content)
    with zipfile.ZipFile(uncompressed(tmp_path / "m.zip")) as archive:
        assert {name: archive.read(name).decode() for name in archive.namelist()} == parts
        assert {part.compress_type for part in archive.infolist()} == {zipfile.ZIP_STORED}


def test_missing_model(tmp_path):
    with pytest.raises(ConfigError, match=r"^x: .*none.zip does not exist$"):
        load_sb3(tmp_path / "none.zip", "x")


def test_not_a_zip(tmp_path):
    (tmp_path / "text.zip").write_text("hello")
    with pytest.raises(ConfigError, match=r"^x: .*text.zip: cannot be read as an archive"):
        load_sb3(tmp_path / "text.zip", "x")


@pytest.mark.parametrize("data", ["no json", "[]"])
def test_zip_without_a_model(tmp_path, data):
    with pytest.raises(ConfigError, match="is not a Stable-Baselines3 model"):
        load_sb3(write(tmp_path / "m.zip", data), "x")


def test_unknown_algorithm(tmp_path):
    data = json.dumps({"policy_class": {"__module__": "sb3_contrib.tqc.policies"}})
    with pytest.raises(
        ConfigError, match=r"an A2C, .* or TD3 model .*, got a policy class of sb3_contrib.tqc.policies$"
    ):
        load_sb3(write(tmp_path / "m.zip", data), "x")


def test_not_installed(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "stable_baselines3", None)
    data = json.dumps({"policy_class": {"__module__": "stable_baselines3.sac.policies"}})
    with pytest.raises(ConfigError, match="needs stable-baselines3"):
        load_sb3(write(tmp_path / "m.zip", data), "x")
