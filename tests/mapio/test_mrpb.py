from __future__ import annotations

import json

import numpy as np
import pytest

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.world.scenario import wrap_angle
from tests.mapio.samples import MRPB_CONFIG, map_server_files

TESTS = {"start": [-0.85, 2.15, 1.571], "goal": [-0.75, 2.25, -3.142], "clear_start": 1.3}


@pytest.fixture
def maze(tmp_path):
    """A benchmark folder with one map of 6 x 6 free cells."""
    folder = tmp_path / "maze"
    folder.mkdir()
    return map_server_files(folder, np.full((6, 6), 254), name="map")


def expected(scenario):
    assert scenario.start == (-0.85, 2.15, 1.571)
    assert scenario.goal == (-0.75, 2.25, wrap_angle(-3.142))


def test_published_configuration(maze):
    maze.with_name("config.txt").write_text(MRPB_CONFIG)
    for path in (maze, maze.parent):
        (scenario,) = load_scenarios(path)
        expected(scenario)
        assert scenario.name == "maze"


def test_one_file_of_tests_for_many_maps(maze):
    folder = maze.parent.parent
    entry = {"map": "x", "tests": [TESTS, TESTS]}
    (folder / "tasks.json").write_text(json.dumps({"gone": entry, "maze": entry}))
    for path in (maze, maze.parent, folder, folder / "tasks.json"):
        first, second = load_scenarios(path)
        expected(first)
        assert [first.name, second.name] == ["maze_0", "maze_1"]


def test_maps_of_others_are_not_given_tests(maze):
    (maze.parent.parent / "tasks.json").write_text(json.dumps({"else": {"tests": [TESTS]}}))
    assert load_maps(maze)[0].tasks == ()


@pytest.mark.parametrize("text", [MRPB_CONFIG, "robot=waffle"])
def test_a_map_of_another_name_is_not_mrpbs(maze, text):
    maze.with_name("config.txt").write_text(text)
    other = maze.rename(maze.with_name("office.yaml"))
    (tasked,) = load_maps(other)
    assert (tasked.name, tasked.tasks) == ("office", ())


@pytest.mark.parametrize(
    "text",
    [
        "",
        "# nothing",
        MRPB_CONFIG.replace("goal_pose_x", "goal_pose_y"),
        MRPB_CONFIG[:-60],
        MRPB_CONFIG + MRPB_CONFIG[:80],
    ],
)
def test_bad_configurations(maze, text):
    maze.with_name("config.txt").write_text(text)
    with pytest.raises(MapFormatError, match="of every test"):
        load_maps(maze)


@pytest.mark.parametrize(
    "entry",
    [
        None,
        [],
        {"tests": {}},
        {"tests": []},
        {"tests": [3]},
        {"tests": [{}]},
        {"tests": [TESTS | {"goal": [1, "x", 2]}]},
    ],
)
def test_bad_tests(maze, entry):
    (maze.parent / "tasks.json").write_text(json.dumps({"maze": entry}))
    with pytest.raises(MapFormatError):
        load_maps(maze)


@pytest.mark.parametrize("text", ["", "[]", "{}", "[" * 99_999, json.dumps({"../../etc": {}})])
def test_other_files_are_refused(tmp_path, text):
    (tmp_path / "tasks.json").write_text(text)
    with pytest.raises(MapFormatError):
        load_maps(tmp_path)
