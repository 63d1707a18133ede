from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.world import World
from tests.worlds import ROOM_OPTIONS


def distance_to_squares(grid, x, y, angle, range_max):
    """The plain twin: the ray against every occupied square and the map's edge, by the slab method."""
    direction = np.array([math.cos(angle), math.sin(angle)])
    x0, y0, x1, y1 = grid.bounds
    boxes = [(x0 - 1, y0 - 1, x0, y1 + 1), (x1, y0 - 1, x1 + 1, y1 + 1)]
    boxes += [(x0 - 1, y0 - 1, x1 + 1, y0), (x0 - 1, y1, x1 + 1, y1 + 1)]
    for row, col in zip(*np.nonzero(grid.occupancy), strict=True):
        left, bottom = x0 + col * grid.resolution, y0 + row * grid.resolution
        boxes.append((left, bottom, left + grid.resolution, bottom + grid.resolution))
    nearest = range_max
    for box in boxes:
        with np.errstate(divide="ignore", invalid="ignore"):
            t0 = (np.array(box[:2]) - (x, y)) / direction
            t1 = (np.array(box[2:]) - (x, y)) / direction
        enter, leave = np.minimum(t0, t1).max(), np.maximum(t0, t1).min()
        if enter <= leave and leave > 0:
            nearest = min(nearest, max(enter, 0.0))
    return nearest


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.4), st.floats(0.02, 0.5))
def test_ranges_are_those_of_exact_geometry(seed, share, resolution):
    rng = np.random.default_rng(seed)
    cells = rng.random(tuple(rng.integers(2, 20, 2))) < share
    grid = GridMap(cells, resolution, tuple(rng.uniform(-5, 5, 2)))
    settings = LidarSettings(beams=13, range_max=3.5, angle_min=rng.uniform(-3, 3))
    x0, y0, x1, y1 = grid.bounds
    pose = Pose(rng.uniform(x0, x1), rng.uniform(y0, y1), rng.uniform(-3, 3))
    ranges = Lidar(settings, World(grid)).scan(pose)
    expected = [distance_to_squares(grid, pose.x, pose.y, pose.yaw + angle, 3.5) for angle in settings.angles]
    assert ranges == pytest.approx(expected, abs=1e-5)


def test_beams_go_counter_clockwise_from_the_first_angle():
    grid = GridMap.from_rows(["#####", "#...#", "#...#", "#...#", "#####"], 1.0)
    lidar = Lidar(LidarSettings(beams=4), World(grid))
    assert lidar.scan(Pose(3.5, 2.0, 0.0)).tolist() == [0.5, 2.0, 2.5, 1.0]
    assert lidar.scan(Pose(3.5, 2.0, math.pi / 2)) == pytest.approx([2.0, 2.5, 1.0, 0.5])
    aside = Lidar(LidarSettings(beams=2, angle_min=-math.pi / 2, angle_increment=math.pi), World(grid))
    assert aside.scan(Pose(3.5, 2.0, 0.0)) == pytest.approx([1.0, 2.0])


def test_beams_start_at_the_scanner_and_turn_with_it():
    grid = GridMap.from_rows(["#####", "#...#", "#...#", "#...#", "#####"], 1.0)
    ahead = Lidar(LidarSettings(beams=4, x=0.5, y=-0.25), World(grid))
    assert ahead.scan(Pose(2.0, 2.0, 0.0)).tolist() == [1.5, 2.25, 1.5, 0.75]
    assert ahead.scan(Pose(2.0, 2.0, math.pi / 2)) == pytest.approx([1.5, 1.25, 1.5, 1.75])
    turned = Lidar(LidarSettings(beams=4, yaw=math.pi / 2), World(grid))
    assert turned.scan(Pose(3.5, 2.0, 0.0)) == pytest.approx([2.0, 2.5, 1.0, 0.5])
    settings = LidarSettings(x=0.1, y=0.2, yaw=0.3)
    assert settings.sensor_pose(Pose(1.0, 1.0, math.pi / 2)) == pytest.approx((0.8, 1.1, 0.3 + math.pi / 2))
    assert LidarSettings().sensor_pose(Pose(1.0, 1.0, 1.0)) == (1.0, 1.0, 1.0)


def test_the_place_is_the_lidars_own_or_the_robots_or_the_centre():
    centred, mounted = EnvConfig().mounted_lidar, EnvConfig(noise="nominal").mounted_lidar
    assert (centred.x, centred.y, centred.yaw, centred.range_min) == (0.0, 0.0, 0.0, 0.0)
    assert (mounted.x, mounted.y, mounted.yaw, mounted.range_min) == (-0.064, 0.0, 0.0, 0.12)
    own = EnvConfig(noise="nominal", lidar={"x": 0.1}, robot="turtlebot3_burger").mounted_lidar
    assert (own.x, own.range_min) == (0.1, 0.12)
    assert EnvConfig(lidar={"x": 0.1}).mounted_lidar.place == Pose(0.1, 0.0, 0.0)


@pytest.mark.parametrize(("no_reading", "expected"), [("range_max", 3.5), ("zero", 0.0)])
def test_what_is_too_near_is_not_measured(no_reading, expected):
    options = {**ROOM_OPTIONS, "start": (0.33, 1.5, 0.0), "observation": ("scan",)}
    exact = MapBenchEnv(**options).reset()[0]["scan"]
    blind = MapBenchEnv(**options, lidar={"range_min": 0.3, "no_reading": no_reading}).reset()[0]["scan"]
    near = exact < 0.3
    assert near.sum() > 30
    assert (blind[near] == np.float32(expected)).all()
    assert (blind[~near] == exact[~near]).all()


@pytest.mark.parametrize("heading", [0.0, math.pi / 2, math.pi, -math.pi / 2])
def test_a_scanner_beyond_the_wall_around_a_map_measures_nothing(heading):
    walls = World(GridMap(np.zeros((100, 100), bool), 0.01))
    place = Pose(0.5 + 0.4 * math.cos(heading), 0.5 + 0.4 * math.sin(heading), heading)
    assert not Lidar(LidarSettings(beams=8, x=0.2), walls).scan(place).any()


def test_what_is_out_of_range_says_the_range():
    grid = GridMap(np.zeros((200, 200), bool))
    assert (Lidar(LidarSettings(range_max=2.0), World(grid)).scan(Pose(5.0, 5.0)) == np.float32(2.0)).all()


def test_no_ray_slips_between_cells_that_touch_at_a_corner():
    cells = np.eye(20, dtype=bool)
    grid = GridMap(cells, 1.0)
    scan = Lidar(LidarSettings(beams=1, range_max=30.0), World(grid)).scan(Pose(15.0, 5.0, 3 * math.pi / 4))
    assert scan[0] == pytest.approx(5 * math.sqrt(2), abs=0.8)


def test_every_scan_is_a_new_array():
    lidar = Lidar(LidarSettings(), World(GridMap(np.zeros((50, 50), bool))))
    assert not np.shares_memory(lidar.scan(Pose(1, 1)), lidar.scan(Pose(1, 1)))


def test_bad_settings_are_refused():
    with pytest.raises(ConfigError, match="beams"):
        LidarSettings(beams=0)
    with pytest.raises(ConfigError, match=r"did you mean 'range_max'\?"):
        LidarSettings(max_range=3.0)


def test_a_slow_scanner_repeats_its_last_scan():
    fast, slow = (MapBenchEnv(**ROOM_OPTIONS, lidar={"scan_rate": rate}, observation=["scan"]) for rate in (None, 5.0))
    seen = []
    for env in (fast, slow):
        scans = [env.reset(seed=0)[0]["scan"]]
        scans += [env.step((0.2, 0.5))[0]["scan"] for _ in range(8)]
        seen.append(scans)
    for step, (every, held) in enumerate(zip(*seen, strict=True)):
        assert (held == seen[0][step - step % 4]).all()
        assert step % 4 == 0 or (held != every).any()
    assert not np.shares_memory(seen[1][0], seen[1][1])
