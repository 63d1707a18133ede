"""Writes the report of a directory: draws its figures and tables, and re-runs the best maps for the replays."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from evolution.benchmark import BENCHMARK
from evolution.files import DirectoryKind, counted, temporary_directory, write_text
from evolution.minimizing import MINIMIZATION
from evolution.pictures import FIGURES, FORMATS, drive_best, recorded_maps, write_run_figures
from evolution.quality_diversity import ATLAS
from evolution.report.page import Report, render_page
from evolution.report.run_page import report_of_run
from evolution.report.sections import SECTIONS
from evolution.report.study_page import refused_replays, report_of_study
from evolution.report.tuning_page import report_of_tuning
from evolution.results import kind_of
from evolution.runs import RUN, load_run
from evolution.studies import (
    STUDY,
    SWEEP,
    StudyAnalysis,
    analyse,
    drive_best_sets,
    load_results,
    write_study_figures,
    write_tables,
)
from evolution.training import TRAINING
from evolution.tuning import TUNING, load_tuning
from gym_mapbench.errors import ConfigError, RunError, UntrustedError

REPORT = "report.html"
STANDARD_OUTPUT = "-"
"""What many programs take for standard output."""


def write_report(
    path: str | Path,
    out: str | Path | None = None,
    *,
    analysis: StudyAnalysis | None = None,
    sections: Sequence[str] = (),
    on_step: Callable[[str], object] = lambda _: None,
) -> Path:
    """Write the report of a run, a study or a tuning as one HTML file that needs no network.

    Args:
        path: Directory of a run or of a study, finished or not, or of a finished tuning.
        out: The file; nothing is then written into the directory. If None, ``report.html`` in the directory, which
            replaces an earlier one, like the figures and tables beside it.
        analysis: For a study, its comparisons, if they are there already.
        sections: For a run, names of sections to show in addition to those on every page.
        on_step: Called before each long step, with a line that describes it.

    Returns:
        The file.

    Raises:
        ConfigError: If ``out`` exists and is not the directory's own report, its directory does not exist, or a
            section is unknown.
        RunError: If the directory is neither, has nothing to report, or the file cannot be written.
    """
    path = Path(path)
    kind = kind_of(path).directory
    if kind not in PAGES:
        raise RunError(f"{path}: expected a run, a study or a tuning; {NO_PAGE[kind]}")
    if sections and kind != RUN:
        raise ConfigError(f"sections: expected only of a run, got {path}")
    for name in sections:
        SECTIONS.get(name)
    own = path / REPORT
    target = new_page(own if out is None else out, own)
    with nullcontext(path) if out is None else TemporaryDirectory(dir=temporary_directory()) as folder:
        formats = FORMATS if out is None else ("png",)
        report = PAGES[kind](_Request(path, Path(folder), formats, on_step, sections, analysis))
    write_text(target, render_page(report))
    return target


def new_page(path: str | Path, own: Path | None = None) -> Path:
    """Return the file of a page, checked.

    Args:
        path: The file.
        own: The page that may be replaced.

    Raises:
        ConfigError: If the file exists and is not ``own``, its directory does not exist or cannot be written, or it is
            ``-``.
    """
    if str(path) == STANDARD_OUTPUT:
        raise ConfigError(f"{path}: expected the name of a file; a page is not written to standard output")
    target = Path(path)
    if target.is_dir() or (target.exists() and (own is None or target.resolve() != own.resolve())):
        raise ConfigError(f"{target}: exists already; nothing is overwritten")
    if not target.parent.is_dir():
        raise ConfigError(f"{target}: there is no directory {target.parent}")
    if not os.access(target.parent, os.W_OK):
        raise ConfigError(f"{target}: expected a directory that can be written; --out names another")
    return target


@dataclass(frozen=True)
class _Request:
    """What a page is made from.

    Args:
        path: Directory of the results.
        folder: Directory of the figures and tables that are written.
        formats: Formats of the figures, PNG first.
        on_step: Called before each long step.
        sections: For a run, names of further sections.
        analysis: For a study, its comparisons if they are known.
    """

    path: Path
    folder: Path
    formats: Sequence[str]
    on_step: Callable[[str], object]
    sections: Sequence[str]
    analysis: StudyAnalysis | None


def _run_report(request: _Request) -> Report:
    run = replace(load_run(request.path), figures=request.folder / FIGURES)
    request.on_step("re-running the best map set for the replays")
    missing = []
    try:
        driven = drive_best(run)
    except UntrustedError as error:
        driven, missing = recorded_maps(run), [f"There are no replays: {error}"]
        request.on_step(missing[0])
    write_run_figures(run, driven, request.formats)
    return report_of_run(run, driven, request.sections, missing)


def _study_report(request: _Request) -> Report:
    analysis = request.analysis or analyse(load_results(request.path))
    results = analysis.results
    write_tables(analysis, request.folder)
    request.on_step(
        f"re-running the best map set of {counted(len(results.by_configuration), 'configuration')} for the replays"
    )
    best_sets = drive_best_sets(results)
    for line in refused_replays(best_sets):
        request.on_step(line)
    figures = write_study_figures(analysis, best_sets, request.folder, request.formats)
    return report_of_study(analysis, best_sets, figures)


def _tuning_report(request: _Request) -> Report:
    tuning = load_tuning(request.path)
    request.on_step("re-running the own and the tuned values on test maps for the replays")
    return report_of_tuning(tuning)


PAGES: dict[DirectoryKind, Callable[[_Request], Report]] = {
    RUN: _run_report,
    STUDY: _study_report,
    TUNING: _tuning_report,
}
"""By kind of directory, the function that makes its page."""
NO_PAGE = {
    ATLAS: "report.html in the directory is its page",
    BENCHMARK: "the page of a benchmark is written by its own command, with --resume --html FILE",
    MINIMIZATION: "report.html in the directory is its page",
    SWEEP: "effects.csv and figures/ show a sweep",
    TRAINING: "curve.csv and figures/ show a training",
}
"""By kind of directory without a page, where its results are shown."""
