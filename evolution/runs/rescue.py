"""What is done when a directory of results vanishes while it is being filled: what is in memory is kept elsewhere."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from evolution.driving import ResultStore
from evolution.files import DirectoryKind, make_directory, write_bytes
from evolution.runs.directory import STORE
from gym_mapbench.errors import MapBenchError, RunError


@contextmanager
def rescuing(kind: DirectoryKind, path: Path, store: ResultStore) -> Iterator[None]:
    """Keep all results if the directory that is filled inside the ``with`` block is deleted or moved.

    What a directory was begun with and the results of its runs are all that is needed to continue it: everything else
    follows from them.

    Args:
        kind: What the directory holds.
        path: The directory.
        store: Its results.

    Raises:
        RunError: Instead of the error that shows that the directory is gone, with the place where the results are.
    """
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
