"""The process pool: runs each job in a worker process, so that a job that crashes or hangs costs no other job.

loky 3.7.0 and pebble 5.2.3 were tried instead: the 38 faulty controllers of ``tests/faults``, and a parent that is
killed or gets Ctrl-C in 3 situations (44 cases). This pool loses none.

- loky, one pool: 16 lost. A worker that dies or has to be killed ends the runs of all others (12), workers outlive a
  killed parent (3), and an answer may have any size (1).
- pebble, one pool: 8 lost. What a run has started outlives it (4), workers outlive a killed parent (2), garbage in the
  pipe stops the pool for ever (1), and an answer may have any size (1).
- One pool for each worker, with this package's threads, limits and process groups around it: loky 1 lost (the size),
  pebble 2 (the size; a program outlives the command). In both, a child that a run leaves lives as long as its worker.
  A further worker costs 1.3 s (loky) and 2.7 s (pebble) of processor time and 77 MB and 142 MB; here 0.02 s and 30 MB.

``python -m tests.faults --parts workers --executor MODULE:ATTRIBUTE`` tries any executor.
"""

from __future__ import annotations

from evolution.driving.pool.process_start import available_cores, copy_for_workers
from evolution.driving.pool.processes import Processes, WorkerDiedError
from evolution.driving.pool.worker_loop import Answer, NotStartedError, loaded
from evolution.driving.pool.worker_setup import (
    RunJob,
    WarmUp,
    WorkerSetup,
    attempt,
    error_result,
    one_line,
    prepare_worker,
    shows_tracebacks,
)

__all__ = [
    "Answer",
    "NotStartedError",
    "Processes",
    "RunJob",
    "WarmUp",
    "WorkerDiedError",
    "WorkerSetup",
    "attempt",
    "available_cores",
    "copy_for_workers",
    "error_result",
    "loaded",
    "one_line",
    "prepare_worker",
    "shows_tracebacks",
]
