"""Directories of results: the table of their kinds, by which every command recognises a directory and reads it.

A kind is a :class:`~evolution.files.DirectoryKind`, with which its room begins (``begin``), recognises (``holds``),
opens (``open``) and continues (``check_resumed``) its directories, and the function here that reads one back. A new
kind is a line in :data:`KINDS`; if it has a page, also one in ``PAGES`` of :mod:`evolution.report.writing`.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from evolution.arguments import path_from
from evolution.benchmark import BENCH, BENCHMARK, Benchmark, ParameterComparison, read_bench
from evolution.files import DirectoryKind
from evolution.minimizing import MINIMIZATION, Minimized, load_minimized
from evolution.quality_diversity import ATLAS, Atlas, load_atlas
from evolution.runs import RUN, LoadedRun, load_run
from evolution.studies import STUDY, SWEEP, StudyResults, SweepResults, load_results, load_sweep
from evolution.training import TRAINING, Training, load_training
from evolution.tuning import TUNING, Tuning, load_tuning
from gym_mapbench.errors import RunError
from gym_mapbench.mapio.gazebo_package import RUNNER

Results = (
    LoadedRun | StudyResults | SweepResults | Benchmark | ParameterComparison | Training | Tuning | Minimized | Atlas
)


class ResultKind(NamedTuple):
    """A kind of directory of results.

    Args:
        directory: Begins, recognises, opens and continues a directory.
        load: Reads a directory.
        whole: Name of a file that holds all results, so that a directory with that file alone is of this kind, too.
    """

    directory: DirectoryKind
    load: Callable[[Path], Results]
    whole: str = ""

    def holds(self, path: Path) -> bool:
        """Whether a path is a directory of this kind."""
        return self.directory.holds(path) or bool(self.whole and (path / self.whole).is_file())


KINDS = (
    ResultKind(RUN, load_run),
    ResultKind(STUDY, load_results),
    ResultKind(SWEEP, load_sweep),
    ResultKind(TRAINING, load_training),
    ResultKind(TUNING, load_tuning),
    ResultKind(MINIMIZATION, load_minimized),
    ResultKind(ATLAS, load_atlas),
    ResultKind(BENCHMARK, read_bench, BENCH),
)


def recognise(path: str | Path) -> ResultKind | None:
    """Return the kind of a directory of results; None for every other path."""
    path = Path(path)
    if (path / RUNNER).is_file():  # a ROS 2 package of an earlier version holds a file benchmark.json as well
        return None
    return next((kind for kind in KINDS if kind.holds(path)), None)


def kind_of(path: str | Path) -> ResultKind:
    """Return the kind of a directory of results.

    Raises:
        RunError: If it is a directory of another kind, or none.
    """
    kind = recognise(path)
    if kind is not None:
        return kind
    if (Path(path) / RUNNER).is_file():
        raise RunError(f"{path}: expected a directory of results, got a ROS 2 package for Gazebo, which holds none")
    *others, last = (f"{kind.directory.what} ({kind.directory.mark})" for kind in KINDS)
    raise RunError(f"{path}: expected the directory of a {', '.join(others)} or {last}")


def load(path: str | Path) -> Results:
    """Return the results in a directory, or in a file that ``mapbench bench --format json`` printed.

    Args:
        path: The directory of a run, a study, a sweep, a training, a tuning, a minimization, an atlas or a
            benchmark; or the file.

    Raises:
        ConfigError: If it is no path.
        RunError: If it is none of these, has nothing finished, or is damaged.
    """
    path = path_from("path", path)
    return read_bench(path) if path.is_file() else kind_of(path).load(path)


def run_with_maps(path: str | Path) -> LoadedRun | None:
    """Return the run in a directory, for its best maps; None if the path is no directory of results.

    Raises:
        RunError: If it holds results of another kind, which have no maps of their own, or is damaged.
    """
    kind = recognise(path)
    if kind is None:
        return None
    if kind.directory != RUN:
        raise RunError(f"{path}: expected maps or the directory of a run, got the directory of a {kind.directory.what}")
    return load_run(path)
