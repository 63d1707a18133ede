from __future__ import annotations

import math

import pytest
from hypothesis import given, settings

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio import load_maps, load_scenarios
from gym_mapbench.mapio.movingai import ScenTask, map_text, read_map_file, read_scen_file, scen_text
from gym_mapbench.world.gridmap import GridMap
from tests.mapio.samples import MOVINGAI_MAP, MOVINGAI_SCEN, grids


@pytest.fixture
def tiny(tmp_path):
    (tmp_path / "tiny.map").write_text(MOVINGAI_MAP)
    (tmp_path / "tiny.map.scen").write_text(MOVINGAI_SCEN)
    return tmp_path


@pytest.mark.parametrize("name", ["tiny.map", "tiny.map.scen"])
def test_cells_and_tasks_have_y_down(tiny, name):
    first, second = load_scenarios(tiny / name)
    assert first.map == GridMap.from_rows(["#####", "#..##", "#...#", "#####"], 1.0)
    assert first.start == (1.5, 2.5, pytest.approx(math.atan2(-1, 2)))
    assert first.goal[:2] == (3.5, 1.5)
    assert [first.name, second.name] == ["tiny_0", "tiny_1"]
    assert first.map is second.map


def test_the_name_of_a_map_may_hold_spaces(tiny):
    (tiny / "tiny.map").rename(tiny / "my tiny.map")
    scen = tiny / "tiny.map.scen"
    scen.write_text(MOVINGAI_SCEN.replace("maps/tiny.map", "maps/my tiny.map"))
    assert [scenario.name for scenario in load_scenarios(scen)] == ["my tiny_0", "my tiny_1"]


def test_tasks_on_several_maps_are_refused(tiny):
    first, _, second = MOVINGAI_SCEN.rpartition("maps/tiny.map")
    (tiny / "tiny.map.scen").write_text(f"{first}maps/other.map{second}")
    with pytest.raises(MapFormatError, match=r"line 3: expected tasks on one map, 'tiny\.map', got 'other\.map'"):
        load_maps(tiny / "tiny.map.scen")


def test_resolution_scales_the_world(tiny):
    (scenario, _) = load_scenarios(tiny / "tiny.map", resolution=0.5)
    assert scenario.start[:2] == (0.75, 1.25)


@given(grid=grids())
@settings(max_examples=40, deadline=None)
def test_written_maps_come_back_with_unknown_as_blocked(tmp_path_factory, grid):
    path = tmp_path_factory.getbasetemp() / "drawn.map"
    path.write_text(map_text(grid))
    blocked = grid.occupancy if grid.unknown is None else grid.occupancy | grid.unknown
    assert read_map_file(path, grid.resolution) == GridMap(blocked, grid.resolution)


def test_written_tasks_come_back(tmp_path):
    tasks = [ScenTask((0, 1), (3, 4), 4.24264069), ScenTask((2, 2), (2, 2), 0.0)]
    (tmp_path / "m.scen").write_text(scen_text("m.map", (4, 5), tasks))
    assert read_scen_file(tmp_path / "m.scen", (4, 5)) == tasks


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "header of an octile map"),
        (MOVINGAI_MAP.replace("octile", "hex"), "header of an octile map"),
        (MOVINGAI_MAP.replace("octile", "octile-corner"), "an octile-corner map"),
        (MOVINGAI_MAP.replace("height 4", "height 5"), "expected 5 rows of 5 cells"),
        (MOVINGAI_MAP.replace("width 5", "width 40000"), "expected 4 rows of 40000 cells"),
        (MOVINGAI_MAP.replace("width 5", "width 999999"), "at most 50000 cells a side"),
        (MOVINGAI_MAP + "x " * 100_000, "expected 4 rows of 5 cells"),
        (MOVINGAI_MAP.replace("width 5", "width 999999999"), "expected a map of 1 to"),
        (MOVINGAI_MAP.replace("G", "?"), "got '?'".replace("?", "[?]")),
        (MOVINGAI_MAP[:-8], "expected 4 rows"),
    ],
)
def test_bad_maps(tmp_path, text, words):
    (tmp_path / "m.map").write_text(text)
    with pytest.raises(MapFormatError, match=words):
        load_maps(tmp_path / "m.map")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("version 1", "version 7", "expected 'version 1'"),
        ("maps/tiny.map", "../../..", "expected a file inside"),
        ("maps/tiny.map", "other.map", "expected its map other.map beside it"),
        ("5\t4\t1\t1", "6\t4\t1\t1", "on a map of 5 x 4 cells, got 6 x 4"),
        ("1\t1\t3\t2", "1\t1\t5\t2", "expected cells on the map"),
        ("1\t1\t3\t2", "1\t-1\t3\t2", "expected cells on the map"),
        ("1\t1\t3\t2", "1\tx\t3\t2", "expected a whole number, got 'x'"),
        ("2.41421356", "far", "optimum: expected a number, got 'far'"),
        ("\t2.41421356", "", "expected 9 fields"),
        ("\n", "\n" * 600_000, "at most 500000 tasks"),
    ],
)
def test_bad_tasks(tiny, old, new, words):
    path = tiny / "tiny.map.scen"
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(MapFormatError, match=words):
        load_maps(path)
