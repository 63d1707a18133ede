"""The jobs of a study: most are driven, and those of the baseline ``path_length`` are planned."""

from __future__ import annotations

from evolution.driving import Job, RunResult, run_job
from evolution.studies.baselines.path_length import PLANNER, plan_job


def run_study_job(job: Job) -> RunResult:
    """Return the result of a job: of a run, or of a planned path where the job asks for a path only."""
    return plan_job(job) if job.controller == PLANNER else run_job(job)
