"""Filling a directory with results: nobody else does so meanwhile, and nothing is lost if it vanishes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from evolution.driving import WAIT_SECONDS, ResultStore
from evolution.files import DirectoryKind, locked, make_directory, write_bytes
from evolution.runs.directory import STORE
from gym_mapbench.errors import MapBenchError, RunError


@contextmanager
def filling(kind: DirectoryKind, path: Path, wait_s: float = WAIT_SECONDS) -> Iterator[ResultStore]:
    """Open the results of a directory that is filled inside the ``with`` block, by this process alone.

    All results are kept if the directory is deleted or moved meanwhile. What it was begun with and the results of its
    runs are all that is needed to continue it: everything else follows from them.

    Args:
        kind: What the directory holds.
        path: The directory.
        wait_s: How long to wait for another process that fills it or has locked its results, s.

    Raises:
        RunError: If another process goes on filling it, its results cannot be read, or it is gone: then with the place
            where the results are.
    """
    with (
        locked(path / kind.mark, wait_s),
        ResultStore(path / STORE, wait_s=wait_s) as store,
        _rescued(kind, path, store),
    ):
        yield store


@contextmanager
def _rescued(kind: DirectoryKind, path: Path, store: ResultStore) -> Iterator[None]:
    """Keep all results elsewhere if a directory vanishes."""
    begun_with = (path / kind.mark).read_bytes()
    try:
        yield
    except (MapBenchError, OSError) as error:
        if kind.holds(path):
            raise
        place = _elsewhere(path)
        write_bytes(place / kind.mark, begun_with)
        store.copy_to(place / STORE)
        what = f"was deleted or moved while it was being filled ({error})"
        raise RunError(f"{path}: {what}; all results so far are in {place}: continue with --resume there") from None


def _elsewhere(path: Path) -> Path:
    """Make a new directory beside a vanished one, or where temporary files are kept."""
    place = path.with_name(f"{path.name}-rescued-{os.getpid()}")
    try:
        make_directory(place)
    except RunError:
        place = Path(tempfile.mkdtemp(prefix=f"{path.name}-rescued-"))
    return place
