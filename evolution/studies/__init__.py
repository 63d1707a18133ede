"""Studies: several configurations with several seeds each, with baselines, re-evaluation and statistics.

In: :class:`StudySettings`, from a file or by the name of a study of the package. Out: a directory of runs, and
:class:`StudyResults` with tables, tests and figures.

::

    from evolution.studies import load_study, run_study

    results = run_study(load_study("quick"), "runs/quick", workers=2)
    results.to_pandas()                # one row per run; needs pandas
    results.rows("reevaluation")       # one row for every run on held-out seeds, without pandas
"""

from __future__ import annotations

from evolution.studies.analysis.comparisons import Comparison, StudyAnalysis, analyse
from evolution.studies.analysis.figures import BestSet, StudyFigure, drive_best_sets, write_study_figures
from evolution.studies.analysis.held_out import held_out_rows
from evolution.studies.analysis.loading import load_results
from evolution.studies.analysis.reported_fitness import reported_fitness_rows
from evolution.studies.analysis.results import StudyResults, StudyRun
from evolution.studies.analysis.tables import (
    map_rows,
    measure_rows,
    pair_rows,
    rank_rows,
    summary_rows,
    test_rows,
    write_tables,
)
from evolution.studies.analysis.verdict import verdict_of
from evolution.studies.directory import STUDY
from evolution.studies.kinds import AnyStudy, load_definition, study_in
from evolution.studies.running import StudyProgress, run_study
from evolution.studies.settings import Configuration, StudySettings, load_study, study_names
from evolution.studies.sweep.running import SWEEP, SweepResults, load_sweep, run_sweep
from evolution.studies.sweep.settings import SweepSettings

__all__ = [
    "STUDY",
    "SWEEP",
    "AnyStudy",
    "BestSet",
    "Comparison",
    "Configuration",
    "StudyAnalysis",
    "StudyFigure",
    "StudyProgress",
    "StudyResults",
    "StudyRun",
    "StudySettings",
    "SweepResults",
    "SweepSettings",
    "analyse",
    "drive_best_sets",
    "held_out_rows",
    "load_definition",
    "load_results",
    "load_study",
    "load_sweep",
    "map_rows",
    "measure_rows",
    "pair_rows",
    "rank_rows",
    "reported_fitness_rows",
    "run_study",
    "run_sweep",
    "study_in",
    "study_names",
    "summary_rows",
    "test_rows",
    "verdict_of",
    "write_study_figures",
    "write_tables",
]
