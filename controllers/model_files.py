"""Files of learned policies: what can be known about one before anything in it is unpickled."""

from __future__ import annotations

import zipfile
from collections.abc import Container
from io import BytesIO
from pathlib import Path
from typing import Any

from gym_mapbench.errors import ConfigError
from gym_mapbench.files.bounded import open_zip
from gym_mapbench.files.documents import parse_json

MAX_MODEL_BYTES = 500_000_000
MAX_DATA_BYTES = 20_000_000
"""Largest text of a model's attributes; Stable-Baselines3 writes some 30 000 bytes."""


def model_data(path: str | Path) -> dict[str, Any]:
    """Read the attributes of the model in a Stable-Baselines3 file, as far as they are plain JSON.

    Args:
        path: The file.

    Raises:
        ConfigError: If there is no such file, or it is damaged, encrypted, too large when unpacked, or no such model.
    """
    with open_zip(path, MAX_MODEL_BYTES, ConfigError) as archive:
        if "data" not in archive.namelist():
            raise ConfigError(f"{path} is not a Stable-Baselines3 model (there is no 'data' in it)")
        if (size := archive.getinfo("data").file_size) > MAX_DATA_BYTES:
            raise ConfigError(f"{path}: data: expected at most {MAX_DATA_BYTES} bytes, got {size}")
        text = archive.read("data").decode("utf-8")
    data = parse_json(text, f"{path} is not a Stable-Baselines3 model: data", ConfigError)
    if not isinstance(data, dict):
        raise ConfigError(f"{path} is not a Stable-Baselines3 model (data: expected an object)")
    return data


def uncompressed(path: str | Path, but: Container[str] = ()) -> BytesIO:
    """Return a model file in memory, its parts uncompressed.

    PyTorch reads a part from many places. Going back in a compressed part means to unpack it from its beginning again,
    which takes longer than all other work of loading.

    Args:
        path: The file.
        but: Names of parts to leave out.

    Raises:
        ConfigError: As :func:`model_data`.
    """
    copy = BytesIO()
    with open_zip(path, MAX_MODEL_BYTES, ConfigError) as archive, zipfile.ZipFile(copy, "w") as unpacked:
        for name in (name for name in archive.namelist() if name not in but):
            unpacked.writestr(name, archive.read(name))
    copy.seek(0)
    return copy
