"""Writing files so that nothing is ever overwritten: formats give contents by name, this puts them on disk."""

from __future__ import annotations

import logging
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path

from gym_mapbench.errors import ConfigError

LOG = logging.getLogger(__name__)

Files = dict[str, str | bytes]
"""Contents by path below the folder they belong in."""

PROGRAM, DOCUMENT = 0o777, 0o666
"""Modes of new files, before the user's mask."""
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,99}")
_RENAMING = {"map": "; rename its file, or the map in its map-set file"}
"""What to do about a name that cannot be a file name, by what has it."""


def check_names(what: str, names: Sequence[str], reserved: Sequence[str] = ()) -> None:
    """Refuse names that cannot be file names everywhere, come twice, or are reserved.

    Raises:
        ConfigError: Naming the first such name.
    """
    if not names:
        raise ConfigError(f"{what}: expected at least one, got none")
    seen, hint = set[str](), _RENAMING.get(what, "")
    for name in names:
        if not _NAME.fullmatch(name):
            rule = "a name of up to 100 letters, digits, '_', '-' and '.', a letter or digit first"
            raise ConfigError(f"{what} {name!r:.120}: expected {rule}{hint}")
        if name in reserved:
            raise ConfigError(f"{what} {name!r}: expected another name, as another file or model has this one{hint}")
        if name in seen:
            raise ConfigError(f"{what} {name!r}: expected every name once, got it again{hint}")
        seen.add(name)


def write_new_folder(files: Mapping[str, str | bytes], folder: Path) -> list[Path]:
    """Write files into a folder that is new or empty, and return them.

    Raises:
        ConfigError: If the folder holds anything, or cannot be made; nothing was written then.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        occupied = any(folder.iterdir())
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be made ({error.strerror})") from None
    if occupied:
        raise ConfigError(f"{folder}: expected a new or empty folder; nothing was written")
    return write_files(files, folder)


def write_files(files: Mapping[str, str | bytes], folder: Path) -> list[Path]:
    """Write files into an existing folder, and return them; a file that begins with ``#!`` becomes executable.

    Raises:
        ConfigError: If one of them is there already (nothing was written then), or cannot be written.
    """
    paths = [folder / name for name in files]
    for path in paths:
        if os.path.exists(path):
            raise ConfigError(f"{path}: expected no such file; nothing was written")
    try:
        with _all_or_none(folder) as begun:
            for path, content in zip(paths, files.values(), strict=True):
                path.parent.mkdir(parents=True, exist_ok=True)
                data = content if isinstance(content, bytes) else content.encode()
                mode = PROGRAM if data.startswith(b"#!") else DOCUMENT
                with open(path, "xb", opener=partial(os.open, mode=mode)) as file:
                    begun.append(path)
                    file.write(data)
    except OSError as error:
        raise ConfigError(f"{folder}: cannot be written ({error.strerror}); nothing was written") from None
    for path in paths:
        LOG.info("%s: written", path)
    return paths


@contextmanager
def _all_or_none(folder: Path) -> Iterator[list[Path]]:
    """Delete the files that a ``with`` block has begun, and their folders below ``folder``, if it ends in an error."""
    begun: list[Path] = []
    try:
        yield begun
    except BaseException:
        for path in reversed(begun):
            with suppress(OSError):
                path.unlink()
                for inner in path.relative_to(folder).parents[:-1]:
                    (folder / inner).rmdir()
        raise
