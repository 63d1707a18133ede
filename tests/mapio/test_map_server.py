from __future__ import annotations

import io
import tempfile
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from PIL import Image

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.mapio import TaskedMap, load_maps, load_scenarios
from gym_mapbench.mapio.conversion import write_maps
from gym_mapbench.mapio.map_server import map_server_pgm, map_server_yaml
from gym_mapbench.mapio.netpbm import decode_pgm
from gym_mapbench.mapio.tasked_map import group_scenarios
from tests.mapio.samples import YAML, grids, map_server_files, scenario_on

RAMP = np.arange(256).reshape(8, 32)


def changed(path, **keys):
    """Change keys of a YAML file and return its path."""
    path.write_text(yaml.safe_dump(yaml.safe_load(path.read_text()) | keys))
    return path


def nav2_value(grey, mode, negate, alpha=None, occupied=0.65, free=0.196):
    """One pixel as map_io.cpp reads it."""
    shade = grey / 255 if alpha is None or mode != "trinary" else (grey + alpha) / (2 * 255)
    occ = shade if negate else 1.0 - shade
    if mode == "raw":
        percent = int(np.floor(shade * 255 + 0.5))
        return percent if percent <= 100 else -1
    if mode == "scale" and alpha is not None and alpha < 255:
        return -1
    if occ > occupied:
        return 100
    if occ < free:
        return 0
    return -1 if mode == "trinary" else int(np.rint((occ - free) / (occupied - free) * 100.0))


@pytest.mark.parametrize("negate", [0, 1])
@pytest.mark.parametrize("mode", ["trinary", "scale", "raw"])
def test_every_grey_value_is_read_as_nav2_does(tmp_path, mode, negate):
    grid = load_maps(map_server_files(tmp_path, RAMP, mode=mode, negate=negate))[0].grid
    expected = np.array([[nav2_value(grey, mode, negate) for grey in row] for row in RAMP])[::-1]
    assert (grid.occupancy == (expected == 100)).all()
    unknown = np.zeros(RAMP.shape, bool) if grid.unknown is None else grid.unknown
    assert (unknown == (expected == -1)).all()
    assert grid.resolution == 0.1
    assert grid.origin == (-1.0, 2.0)


@pytest.mark.parametrize("mode", ["trinary", "raw"])
def test_one_threshold_for_free_and_occupied_is_read_as_nav2_does(tmp_path, mode):
    path = changed(map_server_files(tmp_path, RAMP, mode=mode), free_thresh=0.4, occupied_thresh=0.4)
    grid = load_maps(path)[0].grid
    values = np.array([[nav2_value(one, mode, 0, occupied=0.4, free=0.4) for one in row] for row in RAMP])[::-1]
    assert (grid.occupancy == (values == 100)).all()
    assert (grid.unknown == (values == -1)).all()
    assert (values == -1).sum() == {"trinary": 1, "raw": 155}[mode]


@pytest.mark.parametrize("absolute", [False, True])
def test_a_picture_in_another_folder_is_read_as_by_nav2(tmp_path, absolute):
    (tmp_path / "pictures").mkdir()
    (tmp_path / "maps").mkdir()
    path = map_server_files(tmp_path / "pictures", RAMP)
    name = str(tmp_path / "pictures" / "office.pgm") if absolute else "../pictures/office.pgm"
    elsewhere = tmp_path / "maps" / "office.yaml"
    elsewhere.write_text(changed(path, image=name).read_text())
    assert load_maps(elsewhere)[0].grid == load_maps(tmp_path / "pictures" / "office.yaml")[0].grid


def test_the_yaw_of_the_origin_is_ignored_as_in_nav2_and_a_warning_says_so(tmp_path, caplog):
    path = map_server_files(tmp_path, RAMP)
    straight = load_maps(path)[0].grid
    assert not caplog.messages
    assert load_maps(changed(path, origin=[-1.0, 2.0, 0.3]))[0].grid == straight
    assert caplog.messages == [f"{path}: origin: the yaw 0.3 is ignored, as in Nav2's costmaps"]


@pytest.mark.parametrize(("mode", "count"), [("trinary", 0), ("scale", 115), ("raw", 99)])
def test_a_warning_counts_the_values_between_free_and_occupied(tmp_path, caplog, mode, count):
    load_maps(map_server_files(tmp_path, RAMP, mode=mode))
    said = f"{count} cells have values of 1 to 99 and are free here; Nav2 differs with lethal_cost_threshold below 100"
    assert [said in message for message in caplog.messages] == [True] * bool(count)


def test_a_key_given_twice_is_refused_as_nav2_takes_the_other_value(tmp_path):
    path = map_server_files(tmp_path, RAMP)
    path.write_text(path.read_text() + "negate: 1\n")
    with pytest.raises(MapFormatError, match=r"office\.yaml: 'negate': expected the key once, got it 2 times"):
        load_maps(path)


@pytest.mark.parametrize(("written", "mode"), [("Trinary", "trinary"), ("SCALE", "scale"), ("Raw", "raw")])
def test_capitals_in_a_mode_do_not_count_as_in_nav2(tmp_path, written, mode):
    grids = [load_maps(map_server_files(tmp_path, RAMP, mode=word))[0].grid for word in (written, mode)]
    assert grids[0] == grids[1]


@pytest.mark.parametrize("mode", ["trinary", "scale"])
def test_alpha_counts_as_nav2_counts_it(tmp_path, mode):
    pixels = np.stack([np.tile(np.arange(256), (4, 1)), np.repeat([[0], [90], [200], [255]], 256, axis=1)], axis=2)
    Image.fromarray(pixels.astype(np.uint8), mode="LA").save(tmp_path / "m.png")
    (tmp_path / "m.yaml").write_text(YAML.format(image="m.png", mode=mode, negate=0))
    grid = load_maps(tmp_path / "m.yaml")[0].grid
    # Magick has no grey-with-alpha pixels: it averages red, green, blue and alpha.
    expected = np.array([[nav2_la(grey, alpha, mode) for grey, alpha in row] for row in pixels])[::-1]
    assert (grid.occupancy == (expected == 100)).all()
    assert (grid.unknown == (expected == -1)).all()


def nav2_la(grey, alpha, mode):
    shade_as_one_channel = (3 * grey + alpha) / 4 if mode == "trinary" else grey
    return nav2_value(shade_as_one_channel, mode, 0, alpha=None if mode == "trinary" else alpha)


def test_plain_binary_and_16_bit_pictures_agree(tmp_path):
    binary = load_maps(map_server_files(tmp_path, RAMP))[0].grid
    (tmp_path / "office.pgm").write_text("P2 # comment\n32\t8\n255\n" + " ".join(map(str, RAMP.ravel())))
    assert load_maps(tmp_path / "office.yaml")[0].grid == binary
    assert load_maps(map_server_files(tmp_path, RAMP * 257, white=65535))[0].grid == binary


def test_poses_beside_the_map_or_in_params(tmp_path):
    path = map_server_files(tmp_path, np.full((10, 10), 254))
    with pytest.raises(ConfigError, match=r"as x,y,yaw, or write office_poses\.yaml beside it"):
        load_scenarios(path)
    (tmp_path / "office_poses.yaml").write_text("- [-0.95, 2.05, 0.5]\n- [-0.15, 2.95, 7e-1]\n")
    (scenario,) = load_scenarios(path)
    assert scenario.start == (-0.95, 2.05, 0.5)
    assert scenario.goal == (-0.15, 2.95, 0.7)
    assert scenario.name == "office"
    (moved,) = load_scenarios(path, goal=(-0.5, 2.5, 0))
    assert moved.start == scenario.start
    assert moved.goal == (-0.5, 2.5, 0.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"image": None}, "image: expected a file name"),
        ({"image": "gone.pgm"}, "cannot be read"),
        ({"image": "nul\0.pgm"}, "image: expected a file name"),
        ({"origin": [0, 0]}, "origin: expected a list of 3 numbers"),
        ({"origin": [0, float("nan"), 0]}, "origin: expected a number"),
        ({"resolution": 0}, "resolution: expected metres per cell > 0"),
        ({"resolution": "small"}, "resolution: expected a number, got 'small'"),
        ({"resolution": True}, "resolution: expected a number"),
        ({"negate": 2}, "negate: expected 0 or 1"),
        ({"mode": "binary"}, "mode: expected one of trinary, scale, raw"),
        ({"mode": ["raw"]}, "mode: expected one of trinary, scale, raw"),
        ({"free_thresh": [1]}, "free_thresh: expected a number"),
        ({"occupied_thresh": 65}, r"office\.yaml: occupied_thresh: expected 0\.\.1, got 65"),
        ({"free_thresh": -0.1}, r"free_thresh: expected 0\.\.1, got -0\.1"),
        ({"free_thresh": 0.7}, r"free_thresh: expected at most occupied_thresh 0\.65, got 0\.7"),
        ({"free_thresh": 0.65, "mode": "scale"}, r"free_thresh: expected less than occupied_thresh 0\.65, got 0\.65"),
    ],
)
def test_bad_keys_are_named(tmp_path, change, words):
    path = map_server_files(tmp_path, RAMP)
    document = yaml.safe_load(path.read_text()) | change
    path.write_text(yaml.safe_dump(document))
    with pytest.raises(MapFormatError, match=words) as failure:
        load_maps(path)
    assert "\n" not in str(failure.value)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "[]",
        "{}",
        "image: [",
        "image: !!python/object/apply:os.system [id]",
        "image: !!bool foo",
        "image: !!timestamp foo",
        "resolution: " + "1" * 5000,
        "a: " + "[" * 1200,
        "image: 2020-13-45",
        "x" * 200_000,
    ],
)
def test_other_yaml_is_refused_in_one_line(tmp_path, text):
    (tmp_path / "m.yaml").write_text(text)
    with pytest.raises(MapFormatError) as failure:
        load_maps(tmp_path / "m.yaml")
    assert len(str(failure.value).splitlines()) == 1


def test_yaml_alias_bomb_costs_nothing(tmp_path):
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 9)}]" for n in range(1, 12)]
    lines += ["image: *a11", "resolution: 0.1", "origin: *a11", "negate: 0", "occupied_thresh: 1", "free_thresh: 0"]
    (tmp_path / "m.yaml").write_text("\n".join(lines))
    with pytest.raises(MapFormatError, match="aliases unfolded, got more") as failure:
        load_maps(tmp_path / "m.yaml")
    assert len(str(failure.value)) < 300


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", "not a readable"),
        (b"P6 2 2 255\n" + bytes(12), "not a readable"),
        (b"P5 2 2", "expected a PGM picture"),
        (b"P5 2 2 255\n" + bytes(3), "announces 4 bytes of data, got 3"),
        (b"P5 2 2 255\n" + b"\x01" * 5, "announces 4 bytes of data, got 5"),
        (b"P5 2 2 100\n" + b"\xff" * 4, "grey values up to 100, got 255"),
        (b"P5 " + b"#\n" * 100_000, "expected a PGM picture"),
        (b"P5 2 2 0\n" + bytes(4), "white value of 1 to 65535"),
        (b"P5 0 2 255\n", "expected a map of 1 to"),
        (b"P5 100000 100000 255\n" + bytes(9), "got 100000 x 100000"),
        (b"P2 2 2 255\n1 2 3", "announces 4 numbers, got 3"),
        (b"P2 2 2 255\n1 2 3 -4", "decimal numbers"),
        (b"P2 2 2 255\n1 2 3 99999999999999999999999", "grey values up to 255"),
    ],
)
def test_pictures_that_disagree_with_their_header(tmp_path, data, words):
    (tmp_path / "m.pgm").write_bytes(data)
    (tmp_path / "m.yaml").write_text(YAML.format(image="m.pgm", mode="trinary", negate=0))
    with pytest.raises(MapFormatError, match=words):
        load_maps(tmp_path / "m.yaml")


@given(grid=grids())
@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_written_maps_come_back(tmp_path, grid):
    scenario = scenario_on(grid)
    folder = Path(tempfile.mkdtemp(dir=tmp_path))
    write_maps(group_scenarios([scenario]), folder, "map_server")
    (back,) = load_scenarios(folder / "drawn.yaml")
    assert back.digest == scenario.digest
    assert back.name == scenario.name


@given(grid=grids())
@settings(max_examples=40, deadline=None)
def test_others_read_what_is_written(grid):
    info = yaml.safe_load(map_server_yaml(grid, "m.pgm"))
    assert info["resolution"] == grid.resolution
    assert info["origin"] == [*grid.origin, 0.0]
    pixels = np.asarray(Image.open(io.BytesIO(map_server_pgm(grid))))
    assert set(np.unique(pixels)) <= {0, 205, 254}
    assert ((pixels == 0) == grid.to_image_array()).all()
    assert (decode_pgm(map_server_pgm(grid), "m.pgm")[0] == pixels).all()


def test_a_map_with_many_tasks_is_written_once_a_task(tmp_path):
    grid = load_maps(map_server_files(tmp_path, np.full((6, 6), 254)))[0].grid
    scenarios = [scenario_on(grid, "a"), scenario_on(grid, "b")]
    files = write_maps(group_scenarios(scenarios), tmp_path / "out", "map_server")
    assert {file.name for file in files} == {
        f"{name}{end}" for name in "ab" for end in (".pgm", ".yaml", "_poses.yaml")
    }
    assert [s.digest for s in load_scenarios(tmp_path / "out")] == [s.digest for s in scenarios]
    bare = write_maps([TaskedMap("bare", grid)], tmp_path / "bare", "map_server")
    assert [file.name for file in bare] == ["bare.pgm", "bare.yaml"]


@pytest.mark.parametrize("what", ["poses", "people"])
def test_no_map_is_named_as_a_file_beside_another(tmp_path, what):
    grid = load_maps(map_server_files(tmp_path, np.full((6, 6), 254)))[0].grid
    maps = [*group_scenarios([scenario_on(grid, "a")]), TaskedMap(f"a_{what}", grid)]
    with pytest.raises(ConfigError, match=f"'a_{what}': expected another name"):
        write_maps(maps, tmp_path / "out", "map_server")
