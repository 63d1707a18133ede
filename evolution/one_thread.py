"""One thread for OpenMP and OpenBLAS, in a process beside which others drive.

These libraries use a thread for each core, whose threads wait for each other actively. Where every core has a worker,
each of them waits for the others' time: beside one busy process, runs of a policy took 2.6 times as long, and equations
of 250 unknowns 37 times. A library reads the variables when it is loaded; what the user has set stays.
"""

from __future__ import annotations

import os

ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
"""Environment variables by which each library knows the number of its threads."""


def use_one_thread() -> None:
    """Have the libraries that this process has not loaded yet use one thread, unless the user says otherwise."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
