"""The jobs of a study: runs, and planned paths for the baseline ``path_length``."""

from __future__ import annotations

from evolution.driving import Job, RunResult, run_job
from evolution.studies.baselines.path_length import PLANNER, plan_job


def run_study_job(job: Job) -> RunResult:
    """Return the result of a job: of a run, or of a planned path."""
    return plan_job(job) if job.controller == PLANNER else run_job(job)
