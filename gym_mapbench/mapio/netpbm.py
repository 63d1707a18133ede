"""PGM pictures (P2 and P5), read without trusting their header, and written as Nav2's map saver does.

Source: the pgm(5) format description of Netpbm.
"""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.source import check_size

# White space and comments between two fields; exactly one white space byte ends the header.
_GAP = rb"(?:[ \t\r\n\v\f]|#[^\r\n]*[\r\n])+"
_HEADER = re.compile(rb"(P[25])" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})" + _GAP + rb"(\d{1,9})[ \t\r\n\v\f]")
MAX_HEADER_BYTES = 65536
_COMMENT = re.compile(rb"#[^\r\n]*")
_DIGITS_AND_SPACE = b"0123456789 \t\r\n\v\f"


def decode_pgm(data: bytes, where: Path) -> tuple[NDArray[np.unsignedinteger], int]:
    """Decode a P2 or P5 picture.

    Args:
        data: The file's bytes.
        where: Its name, for messages.

    Returns:
        ``(rows, cols)`` grey values, row 0 at the top, and the value of white.

    Raises:
        MapFormatError: If it is no PGM, or its data disagree with its header.
    """
    header = _HEADER.match(data[:MAX_HEADER_BYTES])
    if header is None:
        raise MapFormatError(f"{where}: expected a PGM picture (P2 or P5 with width, height and white value)")
    cols, rows, white = (int(field) for field in header.groups()[1:])
    check_size(where, rows, cols)
    if not 1 <= white <= 65535:
        raise MapFormatError(f"{where}: expected a white value of 1 to 65535, got {white}")
    body = memoryview(data)[header.end() :]
    values = _binary(body, rows * cols, white, where) if header[1] == b"P5" else _plain(bytes(body), rows * cols, where)
    if values.max() > white:
        raise MapFormatError(f"{where}: expected grey values up to {white}, got {values.max()}")
    levels: NDArray[np.unsignedinteger] = values.astype("u1" if white < 256 else "u2", copy=False)
    return levels.reshape(rows, cols), white


def encode_pgm(grey: NDArray[np.uint8]) -> bytes:
    """Encode ``(rows, cols)`` grey values, row 0 at the top, as P5."""
    rows, cols = grey.shape
    return b"P5\n%d %d\n255\n" % (cols, rows) + grey.tobytes()


def _binary(body: memoryview, cells: int, white: int, where: Path) -> NDArray[np.unsignedinteger]:
    """Read P5 data: one byte a cell, two (high byte first) where white is above 255."""
    dtype = np.dtype(np.uint8) if white < 256 else np.dtype(">u2")
    expected = cells * dtype.itemsize
    if len(body) < expected or bytes(body[expected:]).strip():
        raise MapFormatError(f"{where}: its header announces {expected} bytes of data, got {len(body)}")
    return np.frombuffer(body, dtype, count=cells)


def _plain(body: bytes, cells: int, where: Path) -> NDArray[np.int64]:
    """Read P2 data: decimal numbers and white space."""
    text = _COMMENT.sub(b"", body)
    if text.translate(None, _DIGITS_AND_SPACE):
        raise MapFormatError(f"{where}: expected decimal numbers and white space after the header of a P2 picture")
    # A number takes two bytes at least, so this bounds the array by the file.
    values = np.fromstring(text, dtype=np.int64, sep=" ") if text.strip() else np.empty(0, np.int64)
    if len(values) != cells:
        raise MapFormatError(f"{where}: its header announces {cells} numbers, got {len(values)}")
    return values
