"""Driving: from map sets to the results of runs on them.

In: scenarios, controllers and a world (:class:`JobPlan`). Out: a :class:`RunResult` for every job, in the order of the
jobs, in whichever order the worker processes finish; known results come from the :class:`ResultStore`.
"""

from __future__ import annotations

from evolution.driving.calibration import calibration_loop
from evolution.driving.evaluator import RUN_TIMEOUT_SECONDS, Evaluator, OnRun
from evolution.driving.executors import EXECUTORS
from evolution.driving.jobs import (
    RESULT_FIELDS,
    RUN_COLUMNS,
    TIME,
    ControllerSpec,
    Job,
    JobPlan,
    RunResult,
    SetResults,
    check_controllers,
    check_metric,
    model_digest,
    models_of,
)
from evolution.driving.kernel_archive import export_kernels, import_kernels
from evolution.driving.kernel_files import clear_kernels, compiled_kernels
from evolution.driving.one_run import environment_for, run_episode
from evolution.driving.pool import RunJob, WorkerSetup, available_cores, copy_for_workers
from evolution.driving.resources import DEFAULT_RESOURCES, Resources
from evolution.driving.seeds import derive_seed
from evolution.driving.settings import (
    DriveSettings,
    ParameterFile,
    chosen_robot,
    take_shape_of_robot,
    with_parameters,
    with_robot,
)
from evolution.driving.store import WAIT_SECONDS, ResultStore
from evolution.driving.warmup import is_compiled, preparation_of, warm_up
from evolution.driving.worker import check_room, drive, record, run_job, try_controllers

__all__ = [
    "DEFAULT_RESOURCES",
    "EXECUTORS",
    "RESULT_FIELDS",
    "RUN_COLUMNS",
    "RUN_TIMEOUT_SECONDS",
    "TIME",
    "WAIT_SECONDS",
    "ControllerSpec",
    "DriveSettings",
    "Evaluator",
    "Job",
    "JobPlan",
    "OnRun",
    "ParameterFile",
    "Resources",
    "ResultStore",
    "RunJob",
    "RunResult",
    "SetResults",
    "WorkerSetup",
    "available_cores",
    "calibration_loop",
    "check_controllers",
    "check_metric",
    "check_room",
    "chosen_robot",
    "clear_kernels",
    "compiled_kernels",
    "copy_for_workers",
    "derive_seed",
    "drive",
    "environment_for",
    "export_kernels",
    "import_kernels",
    "is_compiled",
    "model_digest",
    "models_of",
    "preparation_of",
    "record",
    "run_episode",
    "run_job",
    "take_shape_of_robot",
    "try_controllers",
    "warm_up",
    "with_parameters",
    "with_robot",
]
