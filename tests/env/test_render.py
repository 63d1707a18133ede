from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from gym_mapbench.costmap import Costmap
from gym_mapbench.env.render import (
    FREE,
    GOAL,
    PATH,
    ROBOT,
    START,
    TRAIL,
    UNKNOWN,
    WALL,
    Canvas,
    SeenCostmap,
    Snapshot,
    draw,
)
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import ROBOTS, RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from tests.worlds import ROOM, ROOM_GOAL, ROOM_OPTIONS, ROOM_START

SCENARIO = Scenario(GridMap.from_rows(ROOM, 0.1), Pose(*ROOM_START), Pose(*ROOM_GOAL))


def pixel(frame, x, y, width=3.0):
    scale = frame.shape[1] / width
    return tuple(frame[int(frame.shape[0] - y * scale), int(x * scale)])


def colour(value):
    return tuple(value.astype(np.uint8))


def snapshot(**changes):
    fields = {"scenario": SCENARIO, "robot": RobotSpec(), "pose": Pose(1.5, 1.5, 0.0), "trail": np.array([[0.8, 0.8]])}
    return Snapshot(**{**fields, **changes})


def test_things_are_where_they_are():
    trail, path = np.array([[0.8, 0.8], [0.8, 1.5], [1.5, 1.5]]), np.array([[0.8, 0.8, 0.0], [2.2, 0.8, 0.0]])
    frame = draw(snapshot(trail=trail, path=path))
    assert frame.shape == (600, 600, 3)
    assert frame.dtype == np.uint8
    assert pixel(frame, 0.05, 1.5) == colour(WALL)
    assert pixel(frame, 2.5, 0.5) == colour(FREE)
    assert pixel(frame, 1.4, 1.45) == colour(ROBOT)
    assert pixel(frame, 0.8, 1.2) == colour(TRAIL)
    ring = pixel(frame, 0.8 - 0.22, 0.8), pixel(frame, 2.2 + 0.22, 2.2)
    assert np.abs(np.subtract(ring, (colour(START), colour(GOAL)), dtype=int)).max() < 80
    assert np.abs(np.subtract(pixel(frame, 1.5, 0.8), colour(PATH), dtype=int)).max() < 60


def test_beams_start_at_the_scanner():
    beams = np.stack([np.linspace(-0.5, 0.5, 50), np.full(50, 0.5)], axis=1)
    centred = draw(snapshot(robot=RobotSpec(radius=0.05), scan=beams))
    aside = draw(snapshot(robot=RobotSpec(radius=0.05), scan=beams, sensor=Pose(1.5, 2.0, 0.0)))
    assert pixel(centred, 1.8, 1.5) == pixel(aside, 1.8, 2.0) != colour(FREE)
    assert pixel(centred, 1.8, 2.0) == pixel(aside, 1.8, 1.5) == colour(FREE)


def test_the_env_draws_its_beams_where_its_scanner_is():
    env = MapBenchEnv(**ROOM_OPTIONS, lidar={"x": -0.1, "yaw": 0.5, "beams": 8})
    env.reset()
    shown = env.snapshot()
    assert shown.sensor == pytest.approx((0.7, 0.8, 0.5))
    assert shown.scan[:, 0] == pytest.approx(0.5 + np.arange(8) * np.pi / 4)
    assert shown.scan[4, 1] == pytest.approx(0.6 / np.cos(0.5))


def test_polygons_lie_as_they_are_turned():
    robot = ROBOTS["jackal"]
    frame = draw(snapshot(robot=robot, pose=Pose(1.5, 1.5, np.pi / 2)))
    assert pixel(frame, 1.5, 1.32) == colour(ROBOT)
    assert pixel(frame, 1.68, 1.5) != colour(ROBOT)
    mirrored = robot.replace(footprint=robot.footprint[::-1])
    assert (draw(snapshot(robot=mirrored, pose=Pose(1.5, 1.5, np.pi / 2))) == frame).all()


def test_edges_are_smooth():
    canvas = Canvas(SCENARIO.map)
    canvas.disc(Pose(1.5, 1.5), 0.5, ROBOT)
    area = (FREE[0] - canvas.frame()[..., 0].astype(float)[100:500, 100:500]).sum() / (FREE[0] - ROBOT[0])
    assert area == pytest.approx(np.pi * 100**2, rel=1e-3)


def test_the_scan_fills_what_is_seen():
    angles = np.linspace(-0.5, 0.5, 30)
    frame = draw(snapshot(scan=np.stack([angles, np.full(30, 1.0)], axis=1)))
    blank = draw(snapshot())
    changed = (frame != blank).any(axis=2)
    assert changed[300, 400]
    assert not changed[300, 520]
    assert not changed[300, 150]
    full = draw(snapshot(scan=np.stack([np.linspace(0, 2 * np.pi, 90, endpoint=False), np.full(90, 1.0)], axis=1)))
    assert (full != blank).any(axis=2)[300, 150]


def test_unknown_cells_and_large_maps():
    rows = ["?" * 30, *ROOM[1:]]
    frame = draw(snapshot(scenario=Scenario(GridMap.from_rows(rows, 0.1), Pose(*ROOM_START), Pose(*ROOM_GOAL))))
    assert pixel(frame, 1.0, 2.95) == colour(UNKNOWN)
    cells = np.zeros((1300, 700), bool)
    cells[:3, :3] = True
    scenario = Scenario(GridMap(cells, 0.01), Pose(3.0, 3.0), Pose(4.0, 4.0))
    frame = draw(snapshot(scenario=scenario, pose=Pose(3.0, 3.0)))
    assert frame.shape == (434, 234, 3)
    assert tuple(frame[-1, 0]) == colour(WALL)
    assert tuple(frame[0, 0]) == colour(FREE)


def test_an_env_draws_itself():
    env = gymnasium.make("MapBench-v0", render_mode="rgb_array", observation=("scan", "path"), **ROOM_OPTIONS)
    env.reset()
    first = env.render()
    for _ in range(10):
        env.step((0.5, 0.0))
    assert (env.render() != first).any()
    assert env.metadata["render_fps"] == 20
    assert MapBenchEnv.metadata["render_fps"] == 20


@pytest.mark.parametrize(("control_hz", "fps"), [(5.0, 5), (12.5, 12), (0.4, 1)])
def test_films_run_in_real_time(control_hz, fps):
    options = {**ROOM_OPTIONS, "control_hz": control_hz}
    assert gymnasium.make("MapBench-v0", **options).metadata["render_fps"] == fps
    assert gymnasium.make_vec("MapBench-v0", num_envs=2, **options).metadata["render_fps"] == fps


def test_rendering_changes_nothing():
    plain, drawn = MapBenchEnv(**ROOM_OPTIONS), MapBenchEnv(**ROOM_OPTIONS, render_mode="rgb_array")
    plain.reset(seed=0)
    drawn.reset(seed=0)
    for _ in range(20):
        drawn.render()
        assert (plain.step((0.3, 0.3))[0]["pose"] == drawn.step((0.3, 0.3))[0]["pose"]).all()


def test_before_the_first_reset_there_is_nothing_to_draw():
    with pytest.raises(ResetNeeded):
        MapBenchEnv(render_mode="rgb_array").render()
    env = MapBenchEnv(**ROOM_OPTIONS)
    env.reset()
    assert env.render() is None


def test_every_env_has_a_window_that_shows_the_whole_of_every_map(monkeypatch):
    monkeypatch.setenv("MPLBACKEND", "agg")
    import matplotlib.pyplot as plt

    plt.switch_backend("agg")
    before = set(plt.get_fignums())
    envs = [MapBenchEnv(**ROOM_OPTIONS, render_mode="human") for _ in range(2)]
    for env in envs:
        env.reset()
        env.step((0.3, 0.0))
    windows = [plt.figure(number) for number in sorted(set(plt.get_fignums()) - before)]
    assert [window.canvas.manager.get_window_title() for window in windows] == ["MapBench"] * 2

    wide = GridMap(np.zeros((40, 120), dtype=bool), 0.05)
    envs[0].reset(options={"map": wide, "start": (1.0, 1.0), "goal": (5.0, 1.0)})
    axes = windows[0].axes[0]
    height, width = axes.images[-1].get_size()
    assert width == 3 * height
    assert (*axes.get_xlim(), *axes.get_ylim()) == (-0.5, width - 0.5, height - 0.5, -0.5)
    for env in (*envs, envs[0]):
        env.close()
    assert set(plt.get_fignums()) == before


def test_a_costmap_lies_where_its_frame_is():
    grid = GridMap(np.zeros((40, 40), dtype=bool), 0.05)
    costs = np.zeros((10, 10), dtype=np.uint8)
    costs[2, 7] = 254
    # The frame is turned by a quarter: a step along its x is one along the map's y.
    seen = SeenCostmap(Costmap(costs, 0.05, 0.0, 0.0), Pose(1.0, 0.5, np.pi / 2), Pose(1.0, 1.0, 0.0))
    canvas = Canvas(grid, 400)
    before = canvas.frame().astype(int)
    canvas.costmap(seen)
    changed = np.argwhere((canvas.frame() != before).any(axis=2))
    x, y = (changed[:, 1] + 0.5) / 200, (400 - changed[:, 0] - 0.5) / 200
    assert (x.min(), x.max()) == pytest.approx((1.0 - 0.15, 1.0 - 0.10), abs=0.006)
    assert (y.min(), y.max()) == pytest.approx((0.5 + 0.35, 0.5 + 0.40), abs=0.006)
