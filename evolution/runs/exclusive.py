"""A directory of results, filled by one process at a time; nothing is lost if the directory vanishes."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from evolution.driving import WAIT_SECONDS, Evaluator, JobPlan, OnRun, Resources, ResultStore, RunJob, preparation_of
from evolution.files import DirectoryKind, locked, make_directory, write_bytes
from evolution.runs.directory import STORE
from gym_mapbench.errors import MapBenchError, RunError
from gym_mapbench.files.replacing import remove_abandoned


@contextmanager
def exclusive_store(kind: DirectoryKind, path: Path, wait_s: float = WAIT_SECONDS) -> Iterator[ResultStore]:
    """Open the store of a directory for this process alone, inside the ``with`` block.

    What killed processes have left of files that they were writing there is removed.

    If the directory is deleted or moved meanwhile, its options and all results are written to a new directory, which
    ``--resume`` continues: everything else follows from them.

    Args:
        kind: Kind of the directory.
        path: The directory.
        wait_s: Longest wait for another process that has locked the directory or its store, s.

    Raises:
        RunError: If another process keeps the lock, the store cannot be read, or the directory is gone; then the
            message names the new directory.
    """
    with (
        locked(path / kind.mark, wait_s),
        ResultStore(path / STORE, wait_s=wait_s) as store,
        _rescued(kind, path, store),
    ):
        remove_abandoned(path)
        yield store
        kind.check_there(path)


@contextmanager
def exclusive_evaluator(
    kind: DirectoryKind,
    path: Path | None,
    resources: Resources,
    run_job: RunJob,
    plans: Iterable[JobPlan],
    on_run: OnRun | None = None,
    evaluator_kind: type[Evaluator] = Evaluator,
) -> Iterator[Evaluator]:
    """Yield an evaluator that keeps its results in the store of a directory, opened for this process alone.

    Args:
        kind: Kind of the directory.
        path: The directory; None keeps the results in memory.
        resources: Workers, executor and time limits.
        run_job: Drives one job in a worker process.
        plans: The runs whose kernels the workers load first.
        on_run: Called after each run with its job, its result, and the number of remaining runs of its batch.
        evaluator_kind: The evaluator's class.

    Raises:
        RunError: As by :func:`exclusive_store`.
    """
    with (
        ResultStore() if path is None else exclusive_store(kind, path, resources.wait_s) as store,
        resources.evaluator(run_job, store, preparation_of(plans), evaluator_kind, on_run=on_run) as evaluator,
    ):
        if path is not None and kind.remade and kind.take_code(path):
            store.forget_errors()
        yield evaluator


@contextmanager
def _rescued(kind: DirectoryKind, path: Path, store: ResultStore) -> Iterator[None]:
    """Write all results to a new directory if the directory vanishes."""
    begun_with = (path / kind.mark).read_bytes()
    try:
        yield
    except (MapBenchError, OSError) as error:
        if kind.holds(path):
            raise
        place = _elsewhere(path)
        write_bytes(place / kind.mark, begun_with)
        store.copy_to(place / STORE)
        what = f"was deleted or moved while results were written ({error})"
        raise RunError(f"{path}: {what}; all results so far are in {place}: continue with --resume there") from None


def _elsewhere(path: Path) -> Path:
    """Make a directory beside the vanished one, or among the temporary files, and return its path."""
    place = path.with_name(f"{path.name}-rescued-{os.getpid()}")
    try:
        make_directory(place)
    except RunError:
        place = Path(tempfile.mkdtemp(prefix=f"{path.name}-rescued-"))
    return place
