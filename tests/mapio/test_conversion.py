from __future__ import annotations

import itertools

import numpy as np
import pytest

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import TaskedMap, load_maps
from gym_mapbench.mapio.conversion import write_map_file, write_maps
from gym_mapbench.mapio.formats import WRITTEN
from gym_mapbench.mapio.output import write_new_folder
from gym_mapbench.mapio.tasked_map import group_scenarios, name_tasks
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

ROWS = ["######", "#....#", "#.##.#", "#....#", "######"]
TASKS = [(Pose(1.5, 1.5, 0.5), Pose(4.5, 3.5, 1.0)), (Pose(4.5, 3.5, 2.0), Pose(1.5, 1.5, 0.0))]
MAP = TaskedMap("office", GridMap.from_rows(ROWS, 1.0), name_tasks("office", TASKS))
BARE = TaskedMap("bare", GridMap.from_rows(ROWS, 1.0))


def contents(folder):
    return {path.name: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("form", ["map_server", "mapset", "movingai"])
def test_tasks_and_cells_survive_every_format_that_has_room_for_them(tmp_path, form):
    write_maps([MAP], tmp_path / "out", form)
    back = load_maps(tmp_path / "out")
    scenarios = [scenario for tasked in back for scenario in tasked.scenarios()]
    assert [scenario.name for scenario in scenarios] == ["office_0", "office_1"]
    assert all(scenario.map == MAP.grid for scenario in scenarios)
    assert [scenario.start[:2] for scenario in scenarios] == [start[:2] for start, _ in TASKS]


@pytest.mark.parametrize("suffixes", list(itertools.permutations([".yaml", ".map", ".json", ".png"], 2)))
def test_one_map_through_two_formats(tmp_path, suffixes):
    first, second = (tmp_path / f"m{index}{suffix}" for index, suffix in enumerate(suffixes))
    write_map_file([BARE], first)
    write_map_file(load_maps(first), second)
    (back,) = load_maps(second)
    assert (back.grid.occupancy == BARE.grid.occupancy).all()
    assert back.name == ("m1" if second.suffix != ".json" else "m0")


@pytest.mark.parametrize("form", WRITTEN)
def test_nothing_is_overwritten(tmp_path, form):
    (tmp_path / "mine.txt").write_text("keep")
    with pytest.raises(ConfigError, match="expected a new or empty folder; nothing was written"):
        write_maps([MAP], tmp_path, form)
    assert contents(tmp_path) == {"mine.txt": b"keep"}


@pytest.mark.parametrize("suffix", [".yaml", ".map", ".json", ".png"])
def test_no_file_is_replaced(tmp_path, suffix):
    write_map_file([BARE], tmp_path / f"m{suffix}")
    before = contents(tmp_path)
    with pytest.raises(ConfigError, match="expected no such file; nothing was written"):
        write_map_file([BARE], tmp_path / f"m{suffix}")
    assert contents(tmp_path) == before


@pytest.mark.parametrize("name", ["../up", "a/b", "", "..", "con\0", "my map"])
@pytest.mark.parametrize("form", ["map_server", "image", "movingai"])
def test_names_stay_in_the_folder(tmp_path, name, form):
    with pytest.raises(
        ConfigError, match=r"expected a name of up to 100 letters.*; rename its file, or the map in its map-set file"
    ):
        write_maps([TaskedMap(name, BARE.grid)], tmp_path / "out", form)
    assert not (tmp_path / "out").exists()


def test_what_does_not_fit_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="holds one map, got 1 with 2 tasks"):
        write_map_file([MAP], tmp_path / "m.yaml")
    with pytest.raises(ConfigError, match="holds one map, got 2"):
        write_map_file([BARE, BARE], tmp_path / "m.png")
    with pytest.raises(ConfigError, match="expected a name that ends in one of"):
        write_map_file([BARE], tmp_path / "m.bmp")
    with pytest.raises(ConfigError, match="did you mean 'map_server'"):
        write_maps([BARE], tmp_path / "out", "mapserver")
    with pytest.raises(ConfigError, match="every name once"):
        write_maps([BARE, BARE], tmp_path / "out", "map_server")
    (tmp_path / "file").write_text("")
    with pytest.raises(ConfigError, match="cannot be written"):
        write_map_file([BARE], tmp_path / "file" / "m.png")


def test_movingai_needs_a_path(tmp_path):
    grid = GridMap.from_rows([".#."], 1.0)
    walled = group_scenarios([Scenario(grid, Pose(0.5, 0.5), Pose(2.5, 0.5), "walled")])
    with pytest.raises(ConfigError, match="task 'walled': has no path"):
        write_maps(walled, tmp_path / "out", "movingai")


def test_unknown_cells_survive_where_the_format_knows_them(tmp_path):
    grid = GridMap.from_rows(["#?.", "..#"], 0.25, origin=(1.0, -3.5))
    for suffix in (".yaml", ".json"):
        write_map_file([TaskedMap("m", grid)], tmp_path / f"m{suffix}")
        assert load_maps(tmp_path / f"m{suffix}")[0].grid == grid
    write_map_file([TaskedMap("m", grid)], tmp_path / "m.map")
    blocked = load_maps(tmp_path / "m.map")[0].grid.occupancy
    assert (blocked == np.array([[0, 0, 1], [1, 1, 0]], bool)).all()


def test_nothing_is_written_that_would_not_be_read(tmp_path, monkeypatch):
    monkeypatch.setattr("gym_mapbench.mapio.map_set_file.MAX_JSON_BYTES", 400)
    with pytest.raises(ConfigError, match="expected fewer cells: the map-set file would have"):
        write_map_file([BARE, MAP], tmp_path / "m.json")
    assert not contents(tmp_path)


def test_a_set_of_files_is_written_whole_or_not_at_all(tmp_path):
    """A set without its last files would be read as a smaller one, with tasks at its corners."""
    whole = {"a.pgm": b"cells", "inner/deep/b.yaml": "image: a.pgm"}
    with pytest.raises(ConfigError, match=r"cannot be written \(File name too long\); nothing was written"):
        write_new_folder({**whole, "n" * 300: ""}, tmp_path)
    assert not list(tmp_path.iterdir())
    assert len(write_new_folder(whole, tmp_path)) == 2
