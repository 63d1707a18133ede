"""Settings of the whole test suite."""

from __future__ import annotations

import os
import sys

from hypothesis import HealthCheck, settings

from evolution.one_thread import use_one_thread

# A kernel compiles at its first call, which no deadline per example can know of; nor is a busy machine a fault of the
# examples, whose making has a deadline, too. CI tries the same examples every time, so that a change is judged by
# itself; everybody else keeps looking for new ones.
settings.register_profile(
    "mapbench", deadline=None, suppress_health_check=[HealthCheck.too_slow], derandomize="CI" in os.environ
)
settings.load_profile("mapbench")

# Commands and examples run in processes of their own. Without bytecode files, each of them compiles 500 modules, and
# each worker of pytest compiles all tests.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Two workers of pytest, and the processes that they start, share the cores.
use_one_thread()


def pytest_sessionstart() -> None:
    """Let the workers of pytest compile each kernel of a run once, as workers of a search do: in a fresh clone.

    Both would otherwise compile whatever each of them calls first.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        from evolution.driving import warmup

        if not warmup.is_compiled():
            for release in warmup.PRESET_OF:
                warmup.warm_up(("dwb", "mppi", "rpp", "graceful"), release)
