from __future__ import annotations

import numpy as np
import pytest

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.generator import ShapeSettings, default_task, sample_map
from gym_mapbench.gridmap import GridMap
from gym_mapbench.mapio import load_map_set, load_maps, load_scenarios
from gym_mapbench.mapio.image import encode_image
from gym_mapbench.mapio.loading import has_thesis_layout
from tests.mapio.samples import map_server_files
from tests.oracle_data import DATA, needs_data


@pytest.fixture
def thesis_map(tmp_path):
    grid = GridMap(sample_map(np.random.default_rng(1), ShapeSettings()))
    (tmp_path / "drawn.png").write_bytes(encode_image(grid))
    return tmp_path / "drawn.png", grid


def test_a_map_of_the_thesis_gets_its_task(thesis_map):
    path, grid = thesis_map
    (scenario,) = load_scenarios(path)
    assert scenario.map == grid
    assert (scenario.start, scenario.goal) == default_task(grid)
    assert load_map_set(path, start=scenario.start).digest == load_map_set(path).digest


@pytest.mark.parametrize("cell", [(0, 70), (12, 138)])
def test_other_layouts_get_none(thesis_map, cell):
    cells = thesis_map[1].occupancy.copy()
    cells[cell] = not cells[cell]
    assert not has_thesis_layout(GridMap(cells))
    assert not has_thesis_layout(GridMap(cells[:, :-1]))
    assert has_thesis_layout(thesis_map[1])


def test_missing_and_unusable_poses(tmp_path):
    path = map_server_files(tmp_path, np.full((6, 6), 254))
    with pytest.raises(ConfigError, match="give --goal as x,y,yaw"):
        load_scenarios(path, start=(-0.9, 2.1, 0))
    with pytest.raises(ConfigError, match="goal: expected a point on the map"):
        load_scenarios(path, start=(-0.9, 2.1, 0), goal=(9, 9, 9))
    with pytest.raises(ConfigError, match="start: expected x, y, yaw"):
        load_scenarios(path, start="here", goal=(1, 2, 3))
    with pytest.raises(ConfigError, match="says its own"):
        load_scenarios(path, resolution=0.1)


@pytest.mark.parametrize(
    "name", ["gone", "gone.yaml", "gone.json", "gone.png", "gone.map", "gone.scen", "gone.world", ""]
)
def test_what_is_not_there(tmp_path, name):
    with pytest.raises(MapFormatError) as failure:
        load_maps(tmp_path / name)
    assert len(str(failure.value).splitlines()) == 1


def test_what_is_no_map(tmp_path):
    (tmp_path / "notes.txt").write_text("hello")
    with pytest.raises(MapFormatError, match="no map format known by this name"):
        load_maps(tmp_path / "notes.txt")
    (tmp_path / "folder.yaml").mkdir()
    with pytest.raises(MapFormatError):
        load_maps(tmp_path / "folder.yaml")


@needs_data
@pytest.mark.parametrize(
    ("name", "maps", "tasks"),
    [
        ("map_server", 1, 0),
        ("map_server/100by100_15.yaml", 1, 0),
        ("map_server/100by100_15.pgm", 1, 0),
        ("mrpb", 3, 9),
        ("mrpb/tasks.json", 3, 9),
        ("mrpb/maze/map.yaml", 1, 3),
        ("movingai", 1, 160),
        ("movingai/arena.map", 1, 160),
        ("movingai/arena.map.scen", 1, 160),
        ("barn", 4, 4),
        ("barn/world_299.world", 1, 1),
    ],
)
def test_everything_at_hand_loads(name, maps, tasks):
    loaded = load_maps(DATA / name)
    assert len(loaded) == maps
    assert sum(len(tasked.scenarios()) for tasked in loaded) == tasks
