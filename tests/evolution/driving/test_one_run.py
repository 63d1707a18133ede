from __future__ import annotations

import random
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from controllers.base import STOP
from controllers.registry import CONTROLLERS
from controllers.rl import as_controller
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, RunResult, check_room, drive
from evolution.driving.one_run import environment_for, run_episode
from evolution.driving.pool import attempt
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import measure
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MOTIONS
from gym_mapbench.world.scenario import Pose, Scenario
from tests.worlds import ROOM, among, line

SCENARIO = Scenario(GridMap.from_rows(ROOM, 0.1), Pose(0.8, 0.8), Pose(2.2, 2.2), "room")


class Bystander:
    """Stands, and keeps what it is told."""

    observation_keys = ("pose", "odom", "velocity", "scan")

    def reset(self, context):
        self.context, self.seen = context, []

    def act(self, observation):
        self.seen.append(observation)
        return STOP


def watch(**options):
    bystander = Bystander()
    env = environment_for(EnvConfig(time_limit=0.5, **options), bystander)
    return bystander, run_episode(env, bystander, SCENARIO, name="bystander", seed=3, noise_seed=5)


def test_a_body_that_comes_while_the_robot_touches_a_wall_is_a_contact():
    scenario = among(line((2.6, 2.5), (2.6, 1.0), 0.3), start=(2.4, 0.8, 0.0))
    pushing = Bystander()
    pushing.act = lambda observation: (0.3, 0.0)
    env = environment_for(EnvConfig(time_limit=6.0, collision_ends_episode=False), pushing)
    episode = run_episode(env, pushing, scenario, name="pushing", seed=3)
    assert [(event.kind, event.detail) for event in episode.events] == [("contact", ""), ("contact", "body")]
    found = measure(episode)
    assert [found[name] for name in ("n_contacts", "n_contacts_by_people", "n_collisions_with_walls")] == [2, 1, 1]


def test_controllers_are_told_where_the_scanner_sits():
    for options, place, range_min in (
        ({}, (0.0, 0.0, 0.0), 0.0),
        ({"noise": "nominal"}, (-0.064, 0.0, 0.0), 0.12),
        ({"lidar": {"y": 0.1, "yaw": 1.0}}, (0.0, 0.1, 1.0), 0.0),
    ):
        lidar = watch(**options)[0].context.lidar
        assert lidar.place == place
        assert lidar.range_min == range_min


def test_controllers_are_told_the_task_not_the_true_start():
    bystander, episode = watch(noise="rough")
    assert bystander.context.start == SCENARIO.start
    assert tuple(episode.trajectory[0, :3]) != SCENARIO.start
    assert (bystander.seen[0]["pose"] != episode.trajectory[0, :3]).all()


def test_the_noise_belongs_to_its_own_seed():
    one, other = watch(noise="rough")[0], watch(noise="rough")[0]
    for first, second in zip(one.seen, other.seen, strict=True):
        assert all(np.array_equal(first[key], second[key]) for key in first)


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"observation_keys": None}, "observation_keys of a controller: expected a tuple of names, got None"),
        ({"observation_keys": "goal"}, "observation_keys of a controller: expected a tuple of names, got 'goal'"),
        ({"fit": lambda config: None}, "fit of a controller: expected an EnvConfig, got None"),
        ({"act": lambda observation: "ab"}, "action: expected two numbers, got 'ab'"),
        ({"act": lambda observation: None}, "action: expected two numbers, got None"),
        ({"status": "done"}, "status of a controller: expected running, succeeded or failed, got 'done'"),
        ({"status": "failed", "failure_kind": "goal"}, "failure_kind of a controller: expected one of .*, got 'goal'"),
    ],
)
def test_what_a_controller_says_wrongly_is_one_line(attributes, message):
    wrong = Bystander()
    vars(wrong).update(attributes)
    with pytest.raises(ConfigError, match=f"^{message}$"):
        run_episode(environment_for(EnvConfig(time_limit=0.5), wrong), wrong, SCENARIO, name="wrong", seed=0)


def test_a_motion_that_workers_cannot_find_is_refused(monkeypatch):
    monkeypatch.setitem(MOTIONS._entries, "mine", lambda: SimpleNamespace(at=lambda times: np.zeros((len(times), 3))))
    walked = Scenario(SCENARIO.map, SCENARIO.start, SCENARIO.goal, "room", (Body(motion={"name": "mine"}),))
    with pytest.raises(ConfigError, match="motion 'mine': is registered in this process alone"):
        check_room([walked], DriveSettings(navigation="thesis"))


def test_a_policy_whose_path_cannot_be_planned_ends_as_nav2_s_controllers_do():
    halves = GridMap.from_rows(["#" * 80, *["#" + "." * 38 + "##" + "." * 38 + "#"] * 20, "#" * 80])
    apart = Scenario(halves, Pose(1.0, 0.5), Pose(3.0, 0.5))
    policy = as_controller(lambda observation: (0.1, 0.0), "policy", ("path",))
    episode = run_episode(environment_for(EnvConfig(), policy), policy, apart, name="policy", seed=0)
    assert (episode.outcome, episode.time, len(episode.commands)) == ("planner_failure", 0.0, 0)
    assert "not connected" in episode.reason
    assert measure(episode)["spl"] == 0.0


def test_global_generators_start_from_the_seed_of_a_job():
    def run(job):
        return RunResult("goal", time_s=random.random(), path_length_m=float(np.random.random()))  # noqa: NPY002

    first, second, other = (attempt(run, SimpleNamespace(seed=seed)) for seed in (2**63 - 1, 2**63 - 1, 4))
    assert first == second != other


def test_a_policy_that_samples_with_pytorch_drives_the_same_way_by_the_same_seed(monkeypatch):
    torch = pytest.importorskip("torch")
    sampling = as_controller(lambda observation: (0.1 * float(torch.rand(1)), 0.0), "sampling", ("goal",))
    monkeypatch.setitem(CONTROLLERS._entries, "sampling", lambda: sampling)
    settings = DriveSettings(environment={"time_limit": 0.5}, navigation="thesis")
    (job,) = JobPlan((ControllerSpec(name="sampling"),), settings).jobs(SCENARIO)
    first, second, other = (drive(each).trajectory[-1].tolist() for each in (job, job, replace(job, seed=4)))
    assert first == second != other
