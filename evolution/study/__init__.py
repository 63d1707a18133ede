"""Studies: configurations x seeds x budget, with baselines, re-evaluation and statistics.

::

    from evolution.study import load_study, run_study

    results = run_study(load_study("quick"), "runs/quick", workers=2)
    results.dataframe()                # one row a run; needs pandas
    results.rows("reevaluation")       # one row for every run on fresh seeds, without pandas
"""

from __future__ import annotations

from evolution.study.engine import Engine
from evolution.study.loading import load_results
from evolution.study.results import StudyResults, StudyRun
from evolution.study.runner import StudyProgress, run_study
from evolution.study.settings import Configuration, ReevaluationSettings, StudySettings, load_study, study_names

__all__ = [
    "Configuration",
    "Engine",
    "ReevaluationSettings",
    "StudyProgress",
    "StudyResults",
    "StudyRun",
    "StudySettings",
    "load_results",
    "load_study",
    "run_study",
    "study_names",
]
