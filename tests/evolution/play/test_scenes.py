"""Scenes: maps to the page and back, dropped files, random maps."""

from __future__ import annotations

import base64

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from evolution.play.messages.requests import AskOpen, AskRandom
from evolution.play.scenes import changed_name, map_files, opened, sampled, scenario_of, scene_of
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError, MapBenchError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario


def dropped(files):
    content = {name: base64.b64encode(text).decode() for name, text in files.items()}
    return AskOpen.from_mapping({"files": [{"name": name, "content": text} for name, text in content.items()]}, "open")


@given(
    arrays(np.int8, array_shapes(min_dims=2, max_dims=2, min_side=2, max_side=20), elements=st.integers(0, 2)),
    st.floats(0.01, 1.0),
    st.tuples(st.floats(-50, 50), st.floats(-50, 50)),
)
def test_a_map_comes_back_as_it_was(cells, resolution, origin):
    cells[0, 0] = 0
    grid = GridMap(cells == 1, resolution, origin, cells == 2)
    pose = Pose(*grid.cell_to_world(0, 0), 0.3)
    assert scenario_of(scene_of(Scenario(grid, pose, pose, "a map"))).digest == Scenario(grid, pose, pose).digest


def test_saved_files_give_the_same_map_when_they_are_dropped(room):
    (scene,) = opened(dropped(map_files(room)))
    assert scenario_of(scene).digest == room.digest


def test_a_picture_alone_gets_a_task(room):
    files = {name: text for name, text in map_files(room).items() if name.endswith(".pgm")}
    (scene,) = opened(dropped(files))
    assert np.hypot(scene.goal[0] - scene.start[0], scene.goal[1] - scene.start[1]) > 2.0


@pytest.mark.parametrize("name", ["../up.yaml", "a/b.json", "os:system", "/etc/passwd"])
def test_names_of_dropped_files_are_no_paths(name):
    with pytest.raises(ConfigError, match=r"name: expected a text that matches \^"):
        dropped({name: b""})


@pytest.mark.parametrize("name", ["a b (1)", "Büro+2"])
def test_a_file_may_have_the_name_that_a_user_gave_it(name, room):
    files = {key.replace("room", name): text.replace(b"room", name.encode()) for key, text in map_files(room).items()}
    (scene,) = opened(dropped(files))
    assert scenario_of(scene).digest == room.digest


@pytest.mark.parametrize(("name", "changed"), [("a", "a_why"), ("a_why", "a_why"), (60 * "a", 56 * "a" + "_why")])
def test_a_changed_map_has_another_name_that_a_scene_may_have(name, changed):
    assert changed_name(name, "_why") == changed


@pytest.mark.parametrize("name", ["a.json", "a.yaml", "a.png", "a.map", "a.world", "a.txt"])
def test_a_damaged_file_is_one_line_without_a_path_of_the_server(name):
    with pytest.raises(MapBenchError) as found:
        opened(dropped({name: b"\x00\xff no map"}))
    assert "\n" not in str(found.value)
    assert "/tmp" not in str(found.value)


@pytest.mark.parametrize("beside", [{}, {"tasks.json": b'{".": []}'}])
def test_a_dropped_map_cannot_name_a_picture_of_the_server(room, tmp_path, beside):
    files = map_files(room)
    (tmp_path / "secret.pgm").write_bytes(files["room.pgm"])
    named = files["room.yaml"].replace(b"room.pgm", str(tmp_path / "secret.pgm").encode())
    with pytest.raises(MapBenchError, match="image: expected a file inside"):
        opened(dropped({"map.yaml": named, **beside}))


@pytest.mark.parametrize("folder", ["/home/me/maps/", "../", "maps/"])
def test_a_dropped_picture_counts_in_whatever_folder_the_file_names_it(room, folder):
    files = map_files(room)
    named = files["room.yaml"].replace(b"room.pgm", f"{folder}room.pgm".encode())
    (scene,) = opened(dropped({**files, "room.yaml": named}))
    assert scenario_of(scene).digest == room.digest
    with pytest.raises(MapBenchError, match=r"room\.yaml: 'resolution': expected the key once, got it 2 times"):
        opened(dropped({**files, "room.yaml": named + b"resolution: 0.1\n"}))


def test_cells_of_another_size_are_refused(room):
    scene = scene_of(room)
    with pytest.raises(ConfigError, match="cells: expected 2501 cells"):
        scenario_of(scene.replace(height=41, width=61))


def test_a_random_map_keeps_the_genes_that_are_given():
    asked = AskRandom(family="doors", seed=3, genes={"walls": 2.0, "gap": 0.9})
    assert sampled(asked, EnvConfig()) == sampled(asked, EnvConfig())
    assert sampled(asked, EnvConfig()) != sampled(asked.replace(seed=4), EnvConfig())


@pytest.mark.parametrize("family", ["nothing", "os.path", "doorss"])
def test_unknown_families_are_refused(family):
    with pytest.raises(ConfigError, match="unknown family"):
        sampled(AskRandom(family=family), EnvConfig())
