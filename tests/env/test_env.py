from __future__ import annotations

import contextlib
import copy
import io
import itertools
import json
import math
import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from hypothesis import given, settings
from hypothesis import strategies as st

import gym_mapbench
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.groups import OBSERVATION_KEYS
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.task import OUTCOMES, distance_to_goal
from gym_mapbench.errors import ConfigError, NoPathError
from gym_mapbench.generator import ShapeSettings, sample_map
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.worlds import ROOM, ROOM_GOAL, ROOM_OPTIONS, ROOM_START

GRID = GridMap.from_rows(ROOM, 0.1)
SCENARIO = Scenario(GRID, Pose(*ROOM_START), Pose(*ROOM_GOAL), "room")


def random_env(**options):
    return MapBenchEnv(**{"shapes": ShapeSettings(size=80), "observation": OBSERVATION_KEYS, **options})


def test_the_first_example_of_every_tutorial():
    assert gym_mapbench.__doc__
    env = gymnasium.make("MapBench-v0")
    observation, info = env.reset(seed=0)
    assert set(observation) == {"pose", "velocity", "goal", "scan"}
    assert observation["scan"].shape == (360,)
    keys = {"time", "outcome", "contact", "touched", "contact_by_body", "pose", "velocity", "nearest_body"}
    assert set(info) == keys | {"reward_terms"}
    observation, reward, terminated, truncated, info = env.step(env.action_space.sample())
    assert env.observation_space.contains(observation)
    assert reward == pytest.approx(sum(info["reward_terms"].values()))
    assert (terminated, truncated, info["outcome"]) == (False, False, "running")
    assert info["time"] == pytest.approx(0.05)


@pytest.mark.parametrize("copied", [copy.copy, copy.deepcopy, pickle.dumps])
@pytest.mark.parametrize("steps", [0, 1, 60])
def test_copies_are_refused_before_and_after_box2d_was_needed(copied, steps):
    env = MapBenchEnv(**ROOM_OPTIONS, collision_ends_episode=False)
    if steps:
        env.reset(options={"start": (2.0, 1.5, 0.0)})
    for _ in range(steps):
        env.step((0.5, 0.0))
    with pytest.raises(TypeError, match="cannot be copied or pickled: make another one") as caught:
        copied(env)
    assert "\n" not in str(caught.value)


@settings(max_examples=15)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from(["none", "nominal", "rough"]),
    st.sampled_from(["physical", "normalized"]),
)
def test_observations_are_in_their_space(seed, noise, action):
    env = random_env(noise=noise, action=action, collision_ends_episode=False)
    observation, _ = env.reset(seed=seed)
    env.action_space.seed(seed)
    before = observation
    for _ in range(30):
        assert env.observation_space.contains(observation)
        observation, reward, *_ = env.step(env.action_space.sample())
        assert isinstance(reward, float)
        assert not any(np.shares_memory(observation[key], before[key]) for key in OBSERVATION_KEYS)
        before = observation


def test_the_observed_pose_is_the_true_one_to_the_last_bit():
    env = MapBenchEnv(**ROOM_OPTIONS, observation=("pose", "odom", "velocity"))
    observation, info = env.reset()
    for _ in range(30):
        assert (observation["pose"] == info["pose"]).all()
        assert (observation["odom"] == info["pose"]).all()
        assert (observation["velocity"] == info["velocity"]).all()
        assert observation["pose"].dtype == np.float64
        observation, _, _, _, info = env.step((0.3, 1.0))


def test_goal_and_path_are_seen_from_the_robot():
    options = {"start": (0.8, 0.8, math.pi / 2), "observation": ("goal", "path"), "path": {"points": 30}}
    env = MapBenchEnv(**{**ROOM_OPTIONS, **options})
    observation, _ = env.reset()
    assert observation["goal"] == pytest.approx([1.4, -1.4, 0.0], abs=1e-6)
    path = observation["path"].reshape(-1, 2)
    assert path.shape == (30, 2)
    assert np.hypot(*path[0]) < 0.1
    assert np.hypot(*np.diff(path, axis=0).T)[:5] == pytest.approx(0.1, abs=0.03)
    assert path[-1] == pytest.approx([1.4, -1.4], abs=1e-6)
    for _ in range(40):
        observation, *_ = env.step((0.5, -0.6))
    nearer = observation["path"].reshape(-1, 2)
    assert np.hypot(*(nearer[-1] - observation["goal"][:2])) == pytest.approx(0.0, abs=1e-6)


def test_the_costmap_is_centred_on_the_robot():
    env = MapBenchEnv(**{**ROOM_OPTIONS, "observation": ("costmap",), "costmap": {"cells": 21}})
    observation, _ = env.reset()
    window = observation["costmap"]
    assert window.shape == (1, 21, 21)
    # The robot is in cell (8, 8): the wall of row and column 0 lies 8 cells away, beyond it is nothing.
    assert (window[0, 2, 3:] == 254).all()
    assert (window[0, 3:, 2] == 254).all()
    assert (window[0, :2] == 255).all()
    assert window[0, 10, 10] == 0


def test_a_wall_ends_the_episode_unless_it_may_not():
    env = MapBenchEnv(**ROOM_OPTIONS)
    env.reset(options={"start": (2.0, 1.5, 0.0)})
    for _ in range(60):
        _, reward, terminated, truncated, info = env.step((0.5, 0.0))
        if terminated:
            break
    assert (info["outcome"], info["contact"], truncated) == ("collision", True, False)
    assert info["reward_terms"]["collision"] == -10.0
    assert reward < -9.0
    with pytest.raises(ResetNeeded):
        env.step((0.0, 0.0))
    env = MapBenchEnv(**ROOM_OPTIONS, collision_ends_episode=False)
    env.reset(options={"start": (2.0, 1.5, 0.0)})
    steps = [env.step((0.5, 0.0)) for _ in range(60)]
    assert not any(step[2] for step in steps)
    assert steps[-1][4]["contact"]
    assert sum(step[4]["reward_terms"]["collision"] for step in steps) == -10.0


def test_the_goal_ends_the_episode_unless_it_may_not():
    env = MapBenchEnv(**{**ROOM_OPTIONS, "goal": (1.6, 0.8, 0.0)})
    env.reset()
    terminated, count = False, 0
    while not terminated:
        *_, terminated, _, info = env.step((0.5, 0.0))
        count += 1
    assert info["outcome"] == "goal"
    assert info["reward_terms"]["goal"] == 10.0
    assert info["pose"][0] >= 1.35
    env = MapBenchEnv(**{**ROOM_OPTIONS, "goal": (1.6, 0.8, 0.0)}, goal_ends_episode=False)
    env.reset()
    infos = [env.step((0.5, 0.0))[4] for _ in range(count + 3)]
    assert infos[-1]["outcome"] == "running"
    assert sum(info["reward_terms"]["goal"] for info in infos) == 10.0


def test_time_runs_out_in_simulated_seconds():
    env = MapBenchEnv(**ROOM_OPTIONS, time_limit=1.0, control_hz=10)
    env.reset()
    flags = [env.step((0.0, 0.0))[2:4] for _ in range(10)]
    assert flags == [(False, False)] * 9 + [(False, True)]


def test_normalised_actions_are_shares_of_the_limits():
    physical = MapBenchEnv(**ROOM_OPTIONS)
    normalised = MapBenchEnv(**ROOM_OPTIONS, action="normalized")
    for share, command in (((1, 1), (0.5, 1.9)), ((-1, -0.5), (-0.35, -0.95)), ((0, 0), (0, 0))):
        physical.reset()
        normalised.reset()
        for _ in range(10):
            assert (physical.step(command)[0]["pose"] == normalised.step(share)[0]["pose"]).all()


def test_what_the_robot_cannot_do_is_clipped():
    env = MapBenchEnv(**ROOM_OPTIONS)
    env.reset()
    for _ in range(12):
        *_, info = env.step((9.0, 99.0))
    assert info["velocity"] == pytest.approx([0.5, 1.9])


@pytest.mark.parametrize(
    "action", [(np.nan, 0.0), (0.0, np.inf), (1.0,), (1.0, 2.0, 3.0), "go", None, [[0.1, 0.2]], 0.3, ({}, 1)]
)
def test_bad_actions_are_one_clear_line(action):
    env = MapBenchEnv(**ROOM_OPTIONS)
    env.reset()
    with pytest.raises(ConfigError, match="action: expected two") as caught:
        env.step(action)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"scenaro": 1}, r"unknown reset option 'scenaro'; did you mean 'scenario'"),
        ({"scenario": 1}, "scenario: expected a Scenario or an index below 1, got 1"),
        ({"scenario": "room"}, "scenario: expected a Scenario or an index below 1, got 'room'"),
        ({"map": ROOM}, "map: expected a GridMap, got tuple"),
        ({"map": GRID, "scenario": 0}, "either a map or a scenario"),
        ({"start": (0.05, 0.05)}, "start: expected a free cell"),
        ({"goal": (5.0, 0.5, 0.0)}, "goal: expected a point on the map"),
        ({"start": (0.3, 1.0, 0.0)}, "start: expected room for the robot"),
        ({"goal": (0.3, 1.0, 0.0)}, "goal: expected room for the robot"),
        ({"start": 3}, "start: expected .x, y. or .x, y, yaw."),
        ({"start": (1, 2, 3, 4)}, "start: expected .x, y. or .x, y, yaw."),
        ({"start": (1.0, float("nan"))}, "start: expected finite"),
        (3, "reset options: expected a mapping, got int"),
        (["scenario"], "reset options: expected a mapping, got list"),
    ],
)
def test_bad_reset_options_are_one_clear_line(options, message):
    env = MapBenchEnv(**ROOM_OPTIONS)
    with pytest.raises(ConfigError, match=message) as caught:
        env.reset(options=options)
    assert "\n" not in str(caught.value)
    with pytest.raises(ResetNeeded):
        env.step((0, 0))


NO_SCENARIOS = [
    (3, "scenarios: expected a MapSet or several Scenario values, got int"),
    (SCENARIO, "scenarios: expected a MapSet or several Scenario values, got Scenario"),
    ("office.yaml", "scenarios: expected a MapSet or several Scenario values, got str"),
    ({"map": GRID}, "scenarios: expected a MapSet or several Scenario values, got dict"),
    ([], "scenarios: expected at least one scenario, got none"),
    ([GRID], "scenarios.0: expected a Scenario, got GridMap"),
    ([SCENARIO, {"map": GRID}], "scenarios.1: expected a Scenario, got dict"),
    (("room",), "scenarios.0: expected a Scenario, got str"),
]


@pytest.mark.parametrize(("scenarios", "message"), NO_SCENARIOS)
def test_what_is_no_scenario_is_refused_when_the_env_is_made(scenarios, message):
    with pytest.raises(ConfigError) as one:
        gymnasium.make("MapBench-v0", scenarios=scenarios)
    with pytest.raises(ConfigError) as many:
        gymnasium.make_vec("MapBench-v0", num_envs=2, scenarios=scenarios)
    assert str(one.value) == str(many.value) == message


def test_scenarios_are_chosen_by_options():
    other = Scenario(GRID, Pose(*ROOM_GOAL), Pose(*ROOM_START), "back")
    env = MapBenchEnv(scenarios=MapSet((SCENARIO, other)))
    env.reset(options={"scenario": 1})
    assert env.scenario is other
    env.reset(options={"scenario": SCENARIO})
    assert env.scenario is SCENARIO
    env.reset(options={"map": GRID, "start": (1.0, 1.0), "goal": (2.0, 2.0, 1.0)})
    assert env.scenario == Scenario(GRID, Pose(1.0, 1.0), Pose(2.0, 2.0, 1.0))
    names = set()
    for seed in range(20):
        env.reset(seed=seed)
        names.add(env.scenario.name)
    assert names == {"room", "back"}


def test_a_map_without_a_task_gets_the_thesis_task():
    grid = GridMap(sample_map(np.random.default_rng(0), ShapeSettings()))
    env = MapBenchEnv()
    env.reset(options={"map": grid})
    assert env.scenario.start == pytest.approx((6.9125, 0.5625, 3 * math.pi / 4))
    env.reset(options={"map": grid, "goal": (6.6, 1.0, 0.0)})
    assert env.scenario.goal == (6.6, 1.0, 0.0)


def test_random_maps_differ_and_can_be_solved():
    env = random_env(observation=("pose",))
    digests = []
    env.reset(seed=0)
    for _ in range(5):
        env.reset()
        digests.append(env.scenario.map.digest)
        assert distance_to_goal(env.scenario, env.robot).solvable
    assert len(set(digests)) == 5


def test_maps_that_nobody_can_solve_are_refused_in_the_end(monkeypatch):
    monkeypatch.setattr("gym_mapbench.env.scenario_source.MAX_DRAWS", 2)
    barred = ShapeSettings(
        size=60, n_obstacles=(300, 300), circle_probability=0, square_probability=1, wall_probability=0
    )
    with pytest.raises(ConfigError, match="none in 2 samples"):
        MapBenchEnv(shapes=barred).reset(seed=0)


def test_no_path_is_said_so():
    rows = [row[:14] + "##" + row[16:] for row in ROOM]
    env = MapBenchEnv(**{**ROOM_OPTIONS, "maps": rows, "observation": ("path",)})
    with pytest.raises(NoPathError):
        env.reset()


def test_noise_is_drawn_from_the_env_alone_and_only_where_switched_on():
    quiet = MapBenchEnv(**ROOM_OPTIONS)
    quiet.reset(seed=3)
    state = quiet.np_random.bit_generator.state
    quiet.step((0.1, 0.0))
    assert quiet.np_random.bit_generator.state == state
    noisy = MapBenchEnv(**ROOM_OPTIONS, noise="nominal")
    observation, info = noisy.reset(seed=3)
    assert np.hypot(*(info["pose"][:2] - ROOM_START[:2])) > 1e-4
    assert np.abs(observation["pose"] - info["pose"]).max() > 1e-4
    assert np.abs(observation["velocity"] - info["velocity"]).max() > 1e-4
    again, _ = noisy.reset(seed=3)
    assert all((again[key] == observation[key]).all() for key in observation)


def test_noise_has_the_configured_spread():
    noise = {"pose_xy": 0.1, "pose_yaw": 0.05, "odometry_v": 0.02, "odometry_w": 0.03, "scan": 0.04}
    env = MapBenchEnv(**ROOM_OPTIONS, noise=noise)
    exact, _ = MapBenchEnv(**ROOM_OPTIONS).reset()
    # A robot that stands is not located anew, so every sample is the first of an episode.
    samples = [env.reset(seed=seed)[0] for seed in range(400)]
    for key, expected in (("pose", [0.1, 0.1, 0.05]), ("velocity", [0.02, 0.03])):
        errors = np.array([sample[key] - exact[key] for sample in samples])
        assert errors.std(axis=0) == pytest.approx(expected, rel=0.15)
        assert np.abs(errors.mean(axis=0)).max() < 0.03
    errors = np.array([sample["scan"] - exact["scan"] for sample in samples])
    assert errors[:, exact["scan"] < 3.5].std() == pytest.approx(0.04, rel=0.05)


def test_noisy_starts_keep_clear_of_walls():
    env = MapBenchEnv(**{**ROOM_OPTIONS, "start": (0.33, 0.33, 0.0)}, noise={"start_xy": 0.1})
    for seed in range(20):
        _, info = env.reset(seed=seed)
        assert info["pose"][:2].min() > 0.1 + 0.22
    cell = ("######", "#....#", "#....#", "#....#", "#....#", "######")
    tight = {"maps": cell, "resolution": 0.115, "start": (0.345, 0.345, 0.0), "goal": (0.345, 0.345, 1.0)}
    with pytest.raises(ConfigError, match="obstacles in 1000 samples"):
        MapBenchEnv(**tight, noise={"start_xy": 1.0}).reset(seed=0)


def test_specs_are_json():
    env = gymnasium.make("MapBench-v0", maps=ROOM, resolution=0.1, start=ROOM_START, goal=ROOM_GOAL, robot="jackal")
    again = gymnasium.make(gymnasium.envs.registration.EnvSpec.from_json(env.spec.to_json()))
    assert again.unwrapped.config == env.unwrapped.config
    assert json.loads(env.spec.to_json())["id"] == "MapBench-v0"
    with pytest.raises(ConfigError, match="did you mean 'time_limit'"):
        gymnasium.make("MapBench-v0", timelimit=3)


def test_a_yaml_file_configures_an_env(tmp_path):
    path = tmp_path / "env.yaml"
    path.write_text(f"maps: {json.dumps(ROOM)}\nresolution: 0.1\nstart: {list(ROOM_START)}\ngoal: {list(ROOM_GOAL)}\n")
    env = gymnasium.make("MapBench-v0", config=str(path))
    env.reset()
    assert env.unwrapped.scenario.map == GRID
    assert MapBenchEnv(EnvConfig.build(path)).config == env.unwrapped.config


def test_the_env_is_found_without_an_import():
    program = "import gymnasium; print(gymnasium.make('gym_mapbench:MapBench-v0').spec.id)"
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "MapBench-v0"


def test_the_entry_point_registers_the_env():
    from importlib.metadata import entry_points

    (entry,) = [entry for entry in entry_points(group="gymnasium.envs") if entry.value.startswith("gym_mapbench")]
    entry.load()()
    assert "MapBench-v0" in gymnasium.registry


def test_public_names_are_there_but_loaded_late():
    assert gym_mapbench.MapBenchEnv is MapBenchEnv
    assert all(hasattr(gym_mapbench, name) for name in gym_mapbench.__all__)
    with pytest.raises(AttributeError, match="no attribute 'MapBenchEnvy'"):
        gym_mapbench.MapBenchEnvy  # noqa: B018
    program = (
        "import sys, gym_mapbench; print([name for name in ('Box2D', 'numba', 'matplotlib') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


PROGRAM = """
import numpy as np
from gym_mapbench.env.single import MapBenchEnv
for robot in ("turtlebot3_waffle", "jackal"):
    keys = ("pose", "velocity", "goal", "scan", "path")
    env = MapBenchEnv(robot=robot, noise="nominal", collision_ends_episode=False, observation=keys)
    observation, _ = env.reset(seed=11)
    rng = np.random.default_rng(1)
    for command in np.repeat(rng.uniform([0.1, -1], [0.5, 1], (30, 2)), 10, axis=0):
        observation, reward, terminated, truncated, info = env.step(command)
        print(reward.hex(), *(value.hex() for key in keys for value in observation[key].astype(float)))
        print(info["contact"])
"""


def test_two_processes_see_the_same_to_the_last_bit():
    there = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, check=True, text=True).stdout
    with contextlib.redirect_stdout(io.StringIO()) as here:
        exec(PROGRAM, {})
    assert there == here.getvalue()
    assert len(there.splitlines()) == 1200
    assert there.count("True") > 20


def test_sb3_learns_on_it():
    from stable_baselines3 import PPO

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        env = gymnasium.make("MapBench-v0", action="normalized", lidar={"beams": 12}, **ROOM_OPTIONS)
        model = PPO("MultiInputPolicy", env, n_steps=64, batch_size=32, n_epochs=1, device="cpu", seed=0)
        model.learn(128)
        observation, _ = env.reset(seed=0)
        action, _ = model.predict(observation)
    assert action.shape == (2,)


def table_of(heading):
    """Rows of the table below a heading in the docstring of the env, without the header."""
    lines = MapBenchEnv.__doc__.partition(f"**{heading}**")[2].partition("|")[2].splitlines()
    table = itertools.takewhile(lambda line: line.strip().startswith("|"), lines[1:])
    return [[cell.strip() for cell in line.strip(" |").split(" | ")] for line in itertools.islice(table, 1, None)]


def numbers_in(cell, count):
    """The numbers of a cell; one stands for all."""
    found = [float(text.replace("pi", str(math.pi))) for text in cell.split(",")]
    return found * count if len(found) == 1 else found


def test_the_documented_spaces_are_those_of_the_env():
    env = MapBenchEnv(observation=OBSERVATION_KEYS)
    rows = table_of("Observation space")
    assert [row[0].strip("`") for row in rows] == list(OBSERVATION_KEYS)
    for key, shape, kind, low, high, _ in rows:
        space = env.observation_space[key.strip("`")]
        assert (str(space.shape), str(space.dtype)) == (shape, kind)
        for cell, bound in ((low, space.low), (high, space.high)):
            assert bound.ravel() == pytest.approx(numbers_in(cell, bound.size))
    actions = table_of("Action space")
    for column, bound in ((2, env.action_space.low), (3, env.action_space.high)):
        assert [float(row[column]) for row in actions] == pytest.approx(bound)


def test_the_documented_rewards_outcomes_and_infos_are_those_of_the_env():
    env = MapBenchEnv(**ROOM_OPTIONS)
    _, info = env.reset()
    assert [row[0].strip("`") for row in table_of("Reward")] == list(info["reward_terms"])
    weights = EnvConfig().reward
    signs = (weights.progress, -weights.time, -weights.collision, weights.goal)
    assert [float(row[2].split()[0]) for row in table_of("Reward")] == list(signs)
    assert {row[0].strip("`") for row in table_of("Info")} == set(info)
    assert ["running", *(row[0].strip("`") for row in table_of("Episode end"))] == list(OUTCOMES)
