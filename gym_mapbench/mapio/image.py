"""Plain pictures (PNG, BMP, JPEG, PGM): brightness as Nav2 reads it; the caller gives threshold and resolution."""

from __future__ import annotations

import io
import logging
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.mapio.netpbm import decode_pgm
from gym_mapbench.mapio.output import Files, check_names
from gym_mapbench.mapio.source import check_size, read_bytes
from gym_mapbench.mapio.tasked_map import TaskedMap
from gym_mapbench.world.gridmap import GridMap

LOG = logging.getLogger(__name__)

IMAGE_SUFFIXES = frozenset({".png", ".pgm", ".bmp", ".jpg", ".jpeg"})
DEFAULT_RESOLUTION = 0.05
DEFAULT_THRESHOLD = 0.5

_PILLOW_FORMATS = ("PNG", "BMP", "JPEG")


Scalar = TypeVar("Scalar", bound=np.generic)


class Picture(NamedTuple):
    """A decoded picture, row 0 at the top.

    ``total`` is the sum of each pixel's ``channels`` values, each up to ``white``; ``alpha`` may be None.
    """

    total: NDArray[np.unsignedinteger]
    channels: int
    white: int
    alpha: NDArray[np.uint8] | None

    def on_white(self) -> Picture:
        """Return the picture as it looks on white paper, without alpha."""
        if self.alpha is None:
            return self
        alpha, full = self.alpha.astype(np.uint32), self.channels * self.white
        total = (self.total * alpha + full * (self.white - alpha)) // self.white
        return Picture(total, self.channels, self.white, None)

    def levels(self, with_alpha: bool) -> tuple[NDArray[np.unsignedinteger], NDArray[np.float64]]:
        """Return every pixel's level and, for each level, its brightness in 0..1.

        Args:
            with_alpha: Average alpha in as one more channel, as Nav2 does in trinary mode.
        """
        mixed = with_alpha and self.alpha is not None
        total = self.total + self.alpha if mixed and self.alpha is not None else self.total
        full = (self.channels + mixed) * self.white
        return total, np.arange(full + 1) / full


def look_up(values: NDArray[Scalar], levels: NDArray[np.unsignedinteger]) -> NDArray[Scalar]:
    """Return the value of every pixel's level; row by row, for NumPy makes eight bytes of every index."""
    found = np.empty(levels.shape, values.dtype)
    for row, of_row in zip(found, levels, strict=True):
        row[:] = values[of_row]
    return found


def read_picture(path: Path) -> Picture:
    """Decode a picture file.

    Raises:
        MapFormatError: If it is missing, too large, truncated or no picture.
    """
    data = read_bytes(path)
    if data[:2] in (b"P2", b"P5"):
        grey, white = decode_pgm(data, path)
        return Picture(grey, 1, white, None)
    return _split_channels(_decode(data, path))


def read_image(
    path: Path, resolution: float = DEFAULT_RESOLUTION, threshold: float = DEFAULT_THRESHOLD
) -> list[TaskedMap]:
    """Read a plain picture: pixels darker than ``threshold`` (0 black to 1 white) are walls; transparent is white.

    A warning names the YAML file of the same name beside it, since the picture is part of a map_server map then.

    Args:
        path: The picture.
        resolution: Side of a pixel, m.
        threshold: Brightness below which a pixel is occupied.

    Raises:
        MapFormatError: If the file is no picture.
        ConfigError: If resolution or threshold is out of range.
    """
    if not 0 < threshold <= 1:
        raise ConfigError(f"threshold: expected a brightness above 0 and up to 1, got {threshold}")
    total, brightness = read_picture(path).on_white().levels(with_alpha=False)
    described = path.with_suffix(".yaml")
    if os.path.isfile(described):
        said = "%s: read as a picture, with dark pixels as walls, %g m a pixel and the origin 0, 0; for the map give %s"
        LOG.warning(said, path, resolution, described)
    return [TaskedMap(path.stem, GridMap.from_image_array(look_up(brightness < threshold, total), resolution))]


def encode_image(grid: GridMap) -> bytes:
    """Encode a map as PNG with the grey values of Nav2's map saver."""
    buffer = io.BytesIO()
    Image.fromarray(grey_levels(grid)).save(buffer, format="PNG")
    return buffer.getvalue()


def grey_levels(grid: GridMap) -> NDArray[np.uint8]:
    """Return ``(rows, cols)`` uint8, row 0 at the top: 0 occupied, 254 free, 205 unknown (Nav2's map saver)."""
    grey = np.where(grid.occupancy, 0, 254).astype(np.uint8)
    if grid.unknown is not None:
        grey[grid.unknown] = 205
    return grey[::-1].copy()


def image_files(maps: Sequence[TaskedMap]) -> Files:
    """Return one PNG per map; a picture cannot hold tasks.

    Raises:
        ConfigError: If a name cannot be a file name or comes twice.
    """
    check_names("map", [tasked.name for tasked in maps])
    return {f"{tasked.name}.png": encode_image(tasked.grid) for tasked in maps}


def _decode(data: bytes, path: Path) -> Image.Image:
    """Let Pillow decode the bytes, once the size that they announce is known to be sane."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            image = Image.open(io.BytesIO(data), formats=_PILLOW_FORMATS)
            check_size(path, image.height, image.width)
            image.load()
    except MapFormatError:
        raise
    except Exception as error:  # Pillow's decoders raise nearly anything on damaged bytes.
        raise MapFormatError(f"{path}: not a readable PNG, BMP, JPEG or PGM picture ({type(error).__name__})") from None
    return image


def _split_channels(image: Image.Image) -> Picture:
    """Sum the colours of each pixel and set alpha apart."""
    transparent = "A" in image.getbands() or "transparency" in image.info
    if image.mode.startswith("I"):
        return Picture(np.asarray(image).astype(np.uint16), 1, 65535, None)
    if image.mode not in ("L", "LA", "RGB", "RGBA") or transparent:
        image = image.convert("RGBA" if transparent else "RGB")
    pixels = np.asarray(image).reshape(image.height, image.width, -1)
    colours = pixels.shape[2] - transparent
    total = pixels[:, :, 0].astype(np.uint16)
    for colour in range(1, colours):
        total += pixels[:, :, colour]
    return Picture(total, colours, 255, pixels[:, :, -1] if transparent else None)
