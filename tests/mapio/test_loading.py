from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from gym_mapbench.errors import ConfigError, MapFormatError, PluginError
from gym_mapbench.generator import ShapeSettings, default_task, sample_map
from gym_mapbench.mapio import TaskedMap, load_map_set, load_maps, load_scenarios, write_maps
from gym_mapbench.mapio.formats import FORMATS, MapFormat
from gym_mapbench.mapio.image import encode_image
from gym_mapbench.mapio.loading import has_thesis_layout
from gym_mapbench.mapio.map_server import map_server_pgm, map_server_yaml
from gym_mapbench.mapio.movingai import map_text
from gym_mapbench.world.gridmap import GridMap
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
    with pytest.raises(ConfigError, match="give goal as x,y,yaw"):
        load_scenarios(path, start=(-0.9, 2.1, 0))
    with pytest.raises(ConfigError, match="goal: expected a point on the map"):
        load_scenarios(path, start=(-0.9, 2.1, 0), goal=(9, 9, 0))
    with pytest.raises(ConfigError, match="start: expected x, y, yaw"):
        load_scenarios(path, start="here", goal=(1, 2, 3))
    with pytest.raises(ConfigError, match="says its own"):
        load_scenarios(path, resolution=0.1)


def test_a_yaw_in_degrees_is_refused(tmp_path):
    path = map_server_files(tmp_path, np.full((6, 6), 254))
    with pytest.raises(ConfigError, match=r"goal: expected a yaw of -6\.3 to 6\.3 rad, got -90"):
        load_scenarios(path, start=(-0.9, 2.1, 6.28), goal=(-0.7, 2.3, -90))
    (tmp_path / "office_poses.yaml").write_text("- [-0.9, 2.1, 90]\n- [-0.7, 2.3, 0]\n")
    with pytest.raises(MapFormatError, match=r"office_poses\.yaml: pose 0: expected a yaw of .* rad, got 90"):
        load_scenarios(path)


@pytest.mark.parametrize(
    "name", ["gone", "gone.yaml", "gone.json", "gone.png", "gone.map", "gone.scen", "gone.world", ""]
)
def test_what_is_not_there(tmp_path, name):
    with pytest.raises(MapFormatError) as failure:
        load_maps(tmp_path / name)
    assert len(str(failure.value).splitlines()) == 1


@pytest.mark.parametrize("names", [("a.yaml", "B.YAML", "c.yml"), ("a.map", "B.MAP")])
def test_a_folder_is_read_whole_however_its_names_end(tmp_path, names):
    grid = GridMap.from_rows(("#..",))
    texts = {".map": map_text(grid), ".yaml": map_server_yaml(grid, "a.pgm")}
    (tmp_path / "a.pgm").write_bytes(map_server_pgm(grid))
    for name in names:
        (tmp_path / name).write_text(texts[Path(names[0]).suffix])
    assert sorted(one.name for one in load_maps(tmp_path)) == sorted(Path(name).stem for name in names)


def test_an_empty_name_is_not_the_present_folder(tmp_path, monkeypatch):
    """Such as that of a variable of the shell which is not set."""
    map_server_files(tmp_path, np.full((5, 5), 255, np.uint8))
    monkeypatch.chdir(tmp_path)
    assert len(load_maps(".")) == 1
    with pytest.raises(MapFormatError, match="expected the name of a map, got ''"):
        load_maps("")


def test_a_folder_or_a_broken_link_in_place_of_a_file_beside_the_map_is_refused(tmp_path):
    path = map_server_files(tmp_path, np.full((5, 5), 255, np.uint8))
    for name in ("poses", "people"):
        beside = path.with_name(f"{path.stem}_{name}.yaml")
        beside.unlink(missing_ok=True)
        beside.mkdir()
        with pytest.raises(MapFormatError, match=f"{name}.yaml: cannot be read .Is a directory"):
            load_maps(path)
        beside.rmdir()
        beside.symlink_to(tmp_path / "nowhere")
        with pytest.raises(MapFormatError, match=f"{name}.yaml: cannot be read .No such file"):
            load_maps(path)
        beside.unlink()
        beside.write_text("- [0.1, 0.1, 0]\n- [0.2, 0.2, 0]\n")


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


def read_rows(path):
    return [TaskedMap(path.stem, GridMap.from_rows(path.read_text().splitlines(), 0.5))]


def read_nothing(path):
    return None


def read_no_map(path):
    return []


def read_bare(path):
    return [TaskedMap(path.stem, np.zeros((3, 3), bool))]


def read_badly(path):
    return int(path.read_text())


HERE = "tests.mapio.test_loading"


@pytest.fixture
def rows(tmp_path):
    (tmp_path / "room.rows").write_text("###\n#.#\n###\n")
    return tmp_path / "room.rows"


def test_a_path_may_say_who_reads_it(rows, thesis_map):
    (room,) = load_maps(f"{HERE}:read_rows:{rows}")
    assert (room.name, room.grid.resolution, int(room.grid.occupancy.sum())) == ("room", 0.5, 8)
    path, grid = thesis_map
    strange = path.rename(path.with_name("drawn.picture"))
    assert load_maps(f"image:{strange}")[0].grid == grid
    with pytest.raises(MapFormatError, match="no map format known by this name"):
        load_maps(strange)


def test_a_file_with_a_colon_in_its_name_is_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "image:a.png").write_bytes(encode_image(GridMap.from_rows(("##", "#."))))
    assert load_maps("image:a.png")[0].name == "image:a"


def test_a_registered_format_is_known_by_its_suffix(rows, monkeypatch):
    monkeypatch.setattr(FORMATS, "_entries", dict(FORMATS._entries))
    form = MapFormat(read_rows, suffixes=(".rows",), files_in=lambda folder: sorted(folder.glob("*.rows")))
    FORMATS.register("rows", form)
    for path in (rows, rows.parent, f"rows:{rows}"):
        assert [tasked.name for tasked in load_maps(path)] == ["room"]
    with pytest.raises(ConfigError, match="is only read"):
        write_maps(load_maps(rows), rows.parent / "out", "rows")


def test_readers_that_fail_say_so(rows):
    with pytest.raises(PluginError, match="read_nothing': expected a list of TaskedMap, got None"):
        load_maps(f"{HERE}:read_nothing:{rows}")
    with pytest.raises(PluginError, match=r"read_badly': ValueError: .*, test_loading.py line \d+"):
        load_maps(f"{HERE}:read_badly:{rows}")
    with pytest.raises(MapFormatError, match=r"expected at least one map in format '.*read_no_map', got none"):
        load_maps(f"{HERE}:read_no_map:{rows}")
    with pytest.raises(ConfigError, match=r"grid of a map: expected GridMap, got array\("):
        load_maps(f"{HERE}:read_bare:{rows}")
    with pytest.raises(ConfigError, match=r"resolution: .* says its own"):
        load_maps(f"{HERE}:read_rows:{rows}", resolution=0.1)
    with pytest.raises(MapFormatError, match="no mapset maps found in this folder"):
        load_maps(f"mapset:{rows.parent}")


@pytest.mark.parametrize("name", ["x" * 5000, "a/" * 3000 + "b.yaml", "image:" + "x" * 5000 + ".png", "nul\0.png"])
def test_a_name_that_no_file_can_have_is_refused(name):
    with pytest.raises(MapFormatError):
        load_maps(name)
