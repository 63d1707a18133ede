from __future__ import annotations

import json
import math

import numpy as np
import pytest

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, default_task, sample_map
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.noise import NOISES
from gym_mapbench.world.robot import ROBOTS
from gym_mapbench.world.scenario import MapSet, Pose, Scenario
from tests.worlds import ROOM, ROOM_GOAL, ROOM_START


def test_defaults_are_the_thesis_world():
    config = EnvConfig()
    assert (config.shapes.size, config.shapes.resolution, config.time_limit) == (150, 0.05, 150.0)
    assert (config.physics_hz, config.control_hz, config.ticks, config.max_steps) == (100, 20, 5, 3000)
    assert (config.lidar.beams, config.lidar.range_max) == (360, 3.5)
    assert config.robot == ROBOTS["turtlebot3_waffle"]
    assert config.noise == NOISES["none"]
    assert config.load_scenarios() is None


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"max_episode_steps": 3}, r"unknown key 'max_episode_steps'; expected 'time_limit', in s, got 3"),
        ({"tiem_limit": 3}, r"unknown key 'tiem_limit'; did you mean 'time_limit'\?, got 3"),
        ({"time_limit": -1}, r"time_limit: expected greater than 0, got -1"),
        ({"robot": "jakal"}, r"robot: unknown robot 'jakal'; did you mean 'jackal'\?"),
        ({"robot": {"radius": 0.1, "colour": 1}}, r"robot: unknown key 'colour'"),
        ({"robot": {"raduis": 0.1}}, r"robot: unknown key 'raduis'; did you mean 'radius'\?"),
        ({"noise": "nominall"}, r"noise: unknown noise 'nominall'; did you mean 'nominal'\?"),
        ({"observation": ("pose", "scna")}, r"observation: unknown observation key 'scna'; did you mean 'scan'\?"),
        ({"observation": ()}, r"observation: expected at least one key"),
        ({"observation": ("pose", "pose")}, r"observation: expected at least one key, each once"),
        ({"physics_hz": 50, "control_hz": 20}, r"physics_hz: expected a multiple of control_hz 20, got 50"),
        ({"physics_hz": 10, "control_hz": 20}, r"physics_hz: expected a multiple of control_hz 20, got 10"),
        ({"physics_hz": 5, "control_hz": 5}, r"physics_hz: expected at least 10 for this robot, got 5"),
        ({"action": "discrete"}, r"action: expected 'physical' or 'normalized', got 'discrete'"),
        ({"maps": []}, r"maps: expected a file name, text rows"),
        ({"maps": 3}, r"maps: expected a file name, text rows"),
        ({"start": (1, 2)}, r"^start: expected 3 entries, got \(1, 2\)$"),
        ({"start": []}, r"^start: expected 3 entries, got \[\]$"),
        ({"start": (1, 2, 3, 4)}, r"^start: expected at most 3 entries, got \(1, 2, 3, 4\)$"),
        ({"family": ""}, r"^family.name: expected at least 1 character, got ''$"),
        ({"lidar": {"beams": 1.5}}, r"lidar.beams: expected a valid integer"),
        ({"lidar": {"range_min": -1}}, r"lidar.range_min: expected greater than or equal to 0, got -1"),
        ({"lidar": {"range_min": 4}}, r"lidar: range_min: expected less than range_max 3.5, got 4"),
        ({"lidar": {"range_max": 0.1}, "noise": "nominal"}, r"range_min: expected less than range_max 0.1, got 0.12"),
        ({"lidar": {"x": 0.3}}, r"lidar: expected a place on the robot, within 0.22 m of its centre, got 0.3 m"),
        ({"lidar": {"no_reading": "nan"}}, r"lidar.no_reading: expected 'range_max' or 'zero', got 'nan'"),
    ],
)
def test_errors_are_one_clear_line(options, message):
    with pytest.raises(ConfigError, match=message) as caught:
        EnvConfig.build(None, **options)
    assert "\n" not in str(caught.value)


def test_built_from_mapping_yaml_or_config_with_options_on_top(tmp_path):
    path = tmp_path / "env.yaml"
    path.write_text("time_limit: 12\nrobot: jackal\nlidar: {beams: 8}\n")
    from_file = EnvConfig.build(path, time_limit=3)
    assert (from_file.time_limit, from_file.robot.name, from_file.lidar.beams) == (3, "jackal", 8)
    assert EnvConfig.build(str(path), time_limit=3) == from_file
    assert EnvConfig.build({"time_limit": 12, "robot": "jackal", "lidar": {"beams": 8}}, time_limit=3) == from_file
    assert EnvConfig.build(from_file) == from_file
    path.write_text("time_limti: 12\n")
    with pytest.raises(ConfigError, match=r"env\.yaml: unknown key 'time_limti'; did you mean 'time_limit'"):
        EnvConfig.build(path)


def test_json_holds_a_config():
    config = EnvConfig(maps=ROOM, robot="jackal", noise="nominal", observation=("pose", "path"))
    assert EnvConfig.build(json.loads(json.dumps(config.model_dump(mode="json")))) == config


def test_text_rows_are_one_map_and_rows_of_rows_are_several():
    one = EnvConfig(maps=ROOM, resolution=0.1, start=ROOM_START, goal=ROOM_GOAL).load_scenarios()
    two = EnvConfig(maps=(ROOM, list(ROOM)), resolution=0.1, start=ROOM_START, goal=ROOM_GOAL).load_scenarios()
    assert one is not None
    assert two == (*one, *one)
    assert one[0].map == GridMap.from_rows(ROOM, 0.1)
    assert (one[0].start, one[0].goal) == (Pose(*ROOM_START), Pose(*ROOM_GOAL))


def test_a_map_may_be_drawn_as_one_text():
    options = {"resolution": 0.1, "start": ROOM_START, "goal": ROOM_GOAL}
    rows = EnvConfig(maps=ROOM, **options)
    assert EnvConfig(maps="\n".join(ROOM), **options) == rows
    assert EnvConfig(maps="\n    " + "\n    ".join(ROOM) + "\n    ", **options) == rows
    with pytest.raises(ConfigError, match="got lengths"):
        EnvConfig(maps="####\n#.#\n####", **options).load_scenarios()


def test_maps_without_a_task_get_the_thesis_task():
    rows = GridMap(sample_map(np.random.default_rng(0), ShapeSettings())).to_rows()
    (scenario,) = EnvConfig(maps=rows).load_scenarios() or ()
    assert (scenario.start, scenario.goal) == default_task(scenario.map)
    (moved,) = EnvConfig(maps=rows, goal=(6.6, 0.9, 0.0)).load_scenarios() or ()
    assert (moved.start, moved.goal) == (scenario.start, Pose(6.6, 0.9, 0.0))
    with pytest.raises(ConfigError, match="more than 22 cells"):
        EnvConfig(maps=[row[:20] for row in ROOM], start=ROOM_START).load_scenarios()


def test_map_sets_survive_with_their_tasks():
    grid = GridMap.from_rows(ROOM, 0.1, origin=(3.0, -2.0))
    shifted = [Pose(x + 3.0, y - 2.0, yaw) for x, y, yaw in (ROOM_START, ROOM_GOAL)]
    map_set = MapSet((Scenario(grid, *shifted, "a"), Scenario(grid, *shifted[::-1], "b")))
    config = EnvConfig(robot="turtlebot3_burger").with_maps(map_set)
    assert config.load_scenarios() == map_set.scenarios
    again = EnvConfig.build(json.loads(json.dumps(config.model_dump(mode="json"))))
    assert again.load_scenarios() == map_set.scenarios


def test_files_are_read(tmp_path):
    from PIL import Image

    grid = GridMap.from_rows(ROOM[:-1], 0.1)
    Image.fromarray(np.where(grid.to_image_array(), 0, 255).astype(np.uint8)).save(tmp_path / "room.png")
    (tmp_path / "room.yaml").write_text(
        "image: room.png\nresolution: 0.1\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    options = {"start": ROOM_START, "goal": ROOM_GOAL}
    for maps in (str(tmp_path / "room.yaml"), [str(tmp_path / "room.yaml")], tmp_path / "room.yaml"):
        (scenario,) = EnvConfig(maps=maps, **options).load_scenarios() or ()
        assert (scenario.map.occupancy == grid.occupancy).all()
    with pytest.raises(ConfigError, match="no task is known"):
        EnvConfig(maps=str(tmp_path / "room.yaml")).load_scenarios()


def test_a_faster_robot_needs_faster_physics():
    with pytest.raises(ConfigError, match="physics_hz: expected at least 40 for this robot, got 20"):
        EnvConfig(robot="jackal", physics_hz=20)
    fast = {"max_angular_velocity": 100 * math.pi}
    with pytest.raises(ConfigError, match="physics_hz: expected at least 200 for this robot, got 100"):
        EnvConfig(robot=fast)


def test_a_render_mode_that_is_not_there():
    with pytest.raises(ConfigError, match=r"unknown render mode 'rgb'; did you mean 'rgb_array'\?"):
        MapBenchEnv(render_mode="rgb")


def test_an_option_replaces_the_whole_group_of_the_config(tmp_path):
    (tmp_path / "mine.yaml").write_text("reward: {goal: 3.0}\nlidar: {beams: 64}\n")
    built = EnvConfig.build(tmp_path / "mine.yaml", reward={"collision": 5.0})
    assert (built.reward.goal, built.reward.collision, built.lidar.beams) == (10.0, 5.0, 64)
