from __future__ import annotations

import io
import struct
import zlib

import numpy as np
import pytest
from hypothesis import given, settings
from PIL import Image

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.mapio import TaskedMap, load_maps
from gym_mapbench.mapio.conversion import write_map_file
from gym_mapbench.mapio.image import encode_image, image_files
from gym_mapbench.mapio.output import write_files
from gym_mapbench.world.gridmap import GridMap
from tests.mapio.samples import grids

PIXELS = np.array([[0, 100, 255], [200, 127, 128]], np.uint8)


PNG_MODES = [(mode, ".png") for mode in ("L", "RGB", "RGBA", "P", "LA", "I;16")]


@pytest.mark.parametrize(("mode", "suffix"), [*PNG_MODES, ("L", ".bmp"), ("RGB", ".bmp"), ("P", ".bmp")])
def test_darker_than_the_threshold_is_a_wall(tmp_path, mode, suffix):
    image = Image.fromarray(PIXELS.astype(np.uint16) * 257) if mode == "I;16" else Image.fromarray(PIXELS).convert(mode)
    image.save(tmp_path / f"plan{suffix}")
    (tasked,) = load_maps(tmp_path / f"plan{suffix}", resolution=0.2)
    assert tasked.grid == GridMap.from_rows(["##.", ".#."], 0.2)
    (darker,) = load_maps(tmp_path / f"plan{suffix}", threshold=0.3)
    assert darker.grid == GridMap.from_rows(["#..", "..."], 0.05)
    assert tasked.name == "plan"
    assert tasked.tasks == ()


def test_transparent_pixels_are_paper(tmp_path):
    alpha = np.array([[255, 0, 255], [0, 100, 200]], np.uint8)
    Image.fromarray(np.dstack([PIXELS * 0, alpha]), "LA").save(tmp_path / "plan.png")
    (tasked,) = load_maps(tmp_path / "plan.png")
    assert tasked.grid == GridMap.from_rows(["#.#", "..#"])


def test_a_picture_of_a_map_server_map_is_read_with_a_warning(tmp_path, caplog):
    write_map_file([TaskedMap("plan", GridMap.from_rows(["#.", ".#"], 0.2))], tmp_path / "plan.yaml")
    assert load_maps(tmp_path / "plan.yaml")[0].grid.resolution == 0.2
    assert not caplog.text
    assert load_maps(tmp_path / "plan.pgm")[0].grid.resolution == 0.05
    assert f"0.05 m a pixel and the origin 0, 0; for the map give {tmp_path / 'plan.yaml'}" in caplog.text


@given(grid=grids(unknown=False))
@settings(max_examples=40, deadline=None)
def test_png_written_and_read_by_pillow(grid):
    pixels = np.asarray(Image.open(io.BytesIO(encode_image(grid))))
    assert ((pixels < 128) == grid.to_image_array()).all()


def test_files_are_named_after_the_map(tmp_path):
    grid = GridMap.from_rows(["#?", ".#"])
    (file,) = write_files(image_files([TaskedMap("m", grid)]), tmp_path)
    assert file == tmp_path / "m.png"
    assert (np.asarray(Image.open(file)) == [[0, 205], [254, 0]]).all()
    assert (load_maps(file)[0].grid.occupancy == grid.occupancy).all()


def bomb(width, height):
    """A PNG that claims a huge size and holds almost nothing."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(bytes(9))) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    "data", [b"", b"GIF89a", bomb(30_000, 30_000), bomb(1_000_000, 1_000), bomb(20, 20)[:60], bomb(20, 20), b"P5"]
)
def test_bad_pictures_are_refused_in_one_line(tmp_path, data):
    (tmp_path / "plan.png").write_bytes(data)
    with pytest.raises(MapFormatError) as failure:
        load_maps(tmp_path / "plan.png")
    assert len(str(failure.value).splitlines()) == 1


@pytest.mark.parametrize("options", [{"threshold": 0}, {"threshold": 2}, {"resolution": 0}, {"resolution": -1}])
def test_bad_options(tmp_path, options):
    Image.fromarray(PIXELS).save(tmp_path / "plan.png")
    with pytest.raises(ConfigError):
        load_maps(tmp_path / "plan.png", **options)
