"""The local costmap's frame: shifted, turned and moving against the map, without any effect of its own."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.base import Context, ControllerError, FollowerSetup, PathFollower, Twist
from controllers.dwb.controller import DwbFollower
from controllers.dwb.params import DwbParams
from controllers.mppi.controller import MppiFollower
from controllers.mppi.params import MppiParams
from controllers.nav2_params import load_preset
from controllers.navigator.navigator import Navigator
from controllers.rpp.controller import RppFollower
from evolution.driving.one_run import environment_for, run_episode
from gym_mapbench.costmap import Costmap, CostmapParams
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.clearance import measure_clearance
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import IDENTITY, compose, relate, transform_path
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario, wrap_angle
from tests.controllers.plain_follower import PERIOD, Drive, PlainFollower, context, plain_navigation

FRAMES = st.builds(
    Pose, st.floats(-1, 1), st.floats(-1, 1), st.floats(-math.pi, math.pi, exclude_min=True).map(wrap_angle)
)
EMPTY_WINDOW = CostmapParams.example_local(plugins=("inflation_layer",))
PLAN = np.column_stack([np.linspace(0, 3, 121), 0.3 * np.sin(np.linspace(0, 3, 121)), np.zeros(121)])
MAKERS = {
    "rpp": RppFollower,
    "dwb": lambda: DwbFollower(DwbParams(**load_preset("thesis").controller("dwb").params)),
    "mppi": lambda: MppiFollower(MppiParams(batch_size=200, noise="nav2", enforce_path_inversion=True)),
}


def made(name: str) -> PathFollower:
    follower = MAKERS[name]()
    footprint = Footprint.from_radius(0.22, 0.01)
    follower.reset(FollowerSetup(footprint, PERIOD, 0.25, 0.25, 0.55, 3.0, np.random.default_rng(0)))
    follower.set_plan(PLAN)
    return follower


def free_window(pose: Pose) -> Costmap:
    """A free costmap of 4 m x 4 m around a pose, its cells of 1/16 m on whole multiples."""
    x, y = (math.floor(value * 16) / 16 - 2.0 for value in pose[:2])
    return Costmap(np.zeros((64, 64), dtype=np.uint8), 0.0625, x, y)


def drive(follower: PathFollower, frame_at, cycles: int = 40) -> np.ndarray:
    """Let a follower drive in a frame that may move, and give it the plan where it lies in each cycle."""
    pose, commands = Pose(0.013, 0.021, 0.1), []
    velocity = Twist(0.0, 0.0)
    for cycle in range(cycles):
        frame = frame_at(cycle)
        if frame is not None:
            follower.move_plan(transform_path(frame, PLAN))
        here = pose if frame is None else compose(frame, pose)
        command = follower.compute_velocity_commands(here, velocity, free_window(here), cycle * PERIOD)
        velocity = Twist(*command)
        pose = compose(pose, Pose(command.v * PERIOD, 0.0, command.w * PERIOD))
        commands.append(command)
    return np.array(commands)


class TestFollowers:
    @pytest.mark.parametrize("name", MAKERS)
    def test_moving_the_plan_by_nothing_changes_nothing(self, name):
        assert np.array_equal(drive(made(name), lambda cycle: IDENTITY), drive(made(name), lambda cycle: None))

    @pytest.mark.parametrize("name", MAKERS)
    def test_plans_move_by_whole_cells(self, name):
        """Whole cells, so that what follows cells (DWB's map grids) sees the same; each cycle another few."""
        cycles, tolerance = (40, 1e-4) if name == "mppi" else (240, 1e-9)  # MPPI computes in float32
        moved = drive(made(name), lambda cycle: Pose(0.5 * (cycle % 3) - 2.0, 1.0 + 0.25 * (cycle % 5), 0.0), cycles)
        assert moved == pytest.approx(drive(made(name), lambda cycle: None, cycles), abs=tolerance)

    @settings(max_examples=20)
    @given(FRAMES, FRAMES)
    def test_rpp_drives_the_same_in_any_moving_frame(self, one, other):
        moved = drive(made("rpp"), lambda cycle: one if cycle % 4 else other)
        assert moved == pytest.approx(drive(made("rpp"), lambda cycle: None), abs=1e-9)

    @settings(max_examples=5, deadline=None)
    @given(FRAMES)
    def test_mppi_drives_the_same_in_any_frame(self, frame):
        """In float32, and without critics that look at cells: there are none but free ones."""
        moved = drive(made("mppi"), lambda cycle: frame)
        assert moved == pytest.approx(drive(made("mppi"), lambda cycle: None), abs=2e-3)


def navigate(follower, map_in_odom=IDENTITY, recoveries=False, steps=600) -> Drive:
    params = plain_navigation(recoveries, local_costmap=EMPTY_WINDOW)
    navigator = Navigator(follower, params, "plain")
    navigator.reset(context())
    return Drive(navigator, map_in_odom=map_in_odom).run(steps)


class TestNavigator:
    @settings(max_examples=10, deadline=None)
    @given(FRAMES)
    def test_the_way_on_the_map_does_not_depend_on_the_odom_frame(self, frame):
        for make in (PlainFollower, RppFollower):
            aligned, turned = navigate(make()), navigate(make(), frame)
            assert turned.navigator.status == aligned.navigator.status == "succeeded"
            assert turned.navigator.events == aligned.navigator.events
            assert np.array(turned.commands) == pytest.approx(np.array(aligned.commands), abs=1e-9)
            assert turned.pose == pytest.approx(aligned.pose, abs=1e-9)

    @settings(max_examples=5, deadline=None)
    @given(FRAMES)
    def test_recoveries_drive_the_same_in_any_frame(self, frame):
        runs = [navigate(PlainFollower(_fails_until(2.0)), each, recoveries=True) for each in (IDENTITY, frame)]
        kinds = [[event.kind for event in run.navigator.events] for run in runs]
        assert kinds[0] == kinds[1]
        assert {"spin", "backup", "wait"} & set(kinds[0])
        assert np.array(runs[1].commands) == pytest.approx(np.array(runs[0].commands), abs=1e-9)

    def test_an_aligned_frame_never_moves_the_plan(self):
        run = navigate(PlainFollower())
        assert not run.navigator.follower.calls("move_plan")

    def test_the_follower_sees_the_path_where_the_newest_transform_puts_it(self):
        frame = Pose(0.3, -0.4, 2.0)
        run = navigate(PlainFollower(), frame, steps=5)
        follower = run.navigator.follower
        assert follower.path == pytest.approx(transform_path(frame, run.navigator.path), abs=1e-9)
        assert len(follower.calls("set_plan")) == 1
        # The localisation corrects itself by 10 cm; the odom pose does not jump.
        run.map_in_odom = compose(frame, Pose(0.1, 0.0, 0.0))
        run.pose = compose(Pose(-0.1, 0.0, 0.0), run.pose)
        run.step()
        assert follower.path == pytest.approx(transform_path(run.map_in_odom, run.navigator.path), abs=1e-9)
        assert len(follower.calls("set_plan")) == 1

    def test_a_copy_of_the_whole_map_stays_on_the_map(self):
        navigator = Navigator(PlainFollower(), plain_navigation(), "plain")
        navigator.reset(context())
        Drive(navigator, map_in_odom=Pose(0.5, 0.5, 1.0)).step()
        assert not navigator.follower.calls("move_plan")
        assert navigator.follower.calls("compute")[0][2] == context().start


def _fails_until(end: float):
    def answer(now: float) -> None:
        if now < end:
            raise ControllerError("not yet")

    return answer


ROOM = GridMap.from_rows(("#" * 90, *["#" + "." * 88 + "#"] * 58, "#" * 90), 0.05)


@settings(max_examples=6, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_in_the_env_a_random_odom_frame_alone_changes_nothing_where_nothing_is_seen(seed):
    scenario = Scenario(ROOM, Pose(0.8, 0.8, 0.5), Pose(3.4, 2.0, 0.0), "room")
    trajectories = []
    for odom_frame in ("aligned", "random"):
        params = plain_navigation(local_costmap=EMPTY_WINDOW)
        navigator = Navigator(RppFollower(), params, "rpp")
        env = environment_for(EnvConfig(noise={"odom_frame": odom_frame}), navigator)
        episode = run_episode(env, navigator, scenario, name="rpp", seed=seed)
        assert episode.outcome == "goal"
        trajectories.append(episode.trajectory)
    assert trajectories[0] == pytest.approx(trajectories[1], abs=1e-9)


WALLED = GridMap.from_rows(("#" * 90, *["#" + "." * 60 + "##" + "." * 26 + "#"] * 58, "#" * 90), 0.05)


def marked_on_the_map(costmap: Costmap, odom_in_map: Pose) -> np.ndarray:
    """Centres of the lethal cells, ``(n, 2)`` m on the map."""
    rows, cols = np.nonzero(costmap.costs == 254)
    x, y = costmap.origin_x + (cols + 0.5) * 0.05, costmap.origin_y + (rows + 0.5) * 0.05
    return transform_path(odom_in_map, np.column_stack([x, y, np.zeros(len(x))]))[:, :2]


@settings(max_examples=8, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["static_layer", "voxel_layer"]))
def test_walls_are_marked_where_they_are_whatever_the_odom_frame(seed, layer):
    """By the map in a rolling window, and by the scan, wherever the scanner sits and looks."""
    params = plain_navigation(local_costmap=CostmapParams.example_local(plugins=(layer,)))
    navigator = Navigator(PlainFollower(), params, "plain")
    scenario = Scenario(WALLED, Pose(2.3, 1.5, 0.5), Pose(1.0, 1.5, 0.0), "walled")
    config = EnvConfig(noise={"odom_frame": "random"}, lidar={"x": -0.1, "y": 0.05, "yaw": 1.0})
    env = environment_for(config, navigator)
    observation, _ = env.reset(seed=seed, options={"scenario": scenario})
    rng = np.random.default_rng(0)
    robot, period = config.robot, 1.0 / config.control_hz
    lidar = config.mounted_lidar
    navigator.reset(Context(robot, WALLED, scenario.start, scenario.goal, period, rng, lidar))
    navigator.act(observation)
    odom_in_map = relate(Pose(*observation["odom"]), Pose(*observation["pose"]))
    points = marked_on_the_map(navigator.follower.costmap, odom_in_map)
    assert len(points) > 40
    # A turned cell that holds a piece of a wall has its centre within half its diagonal of it.
    away = measure_clearance(WALLED, RobotSpec(radius=1e-9), np.column_stack([points, np.zeros(len(points))]))
    assert away.max() < 0.05 * math.sqrt(0.5) + 1e-3
