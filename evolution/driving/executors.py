"""Executors: what jobs run on.

By default these are worker processes of this machine. Anything else with the interface of
:class:`concurrent.futures.Executor` is made by a factory that is registered in :data:`EXECUTORS`, or named
``module:attribute``.

The default kills a run that takes too long, loses no more than one run when a process dies, and leaves no process
behind; so does ``dask`` on each machine of its cluster. A plain ``Executor`` can do none of this: a run that hangs
stops the search, and a worker that dies may break its pool, whose unfinished runs are then tried again in a new one.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor

from evolution.driving.pool import Processes, WorkerSetup
from gym_mapbench.errors import ConfigError
from gym_mapbench.registry import Registry, must_be_callable


def _processes(setup: WorkerSetup) -> Executor:
    """Make worker processes of this machine."""
    if setup.scheduler:
        raise ConfigError(f"executor 'processes': takes no scheduler, got {setup.scheduler!r}; 'dask' does")
    return Processes(setup.workers, setup.timeout_s, setup.prepare)


def _dask(setup: WorkerSetup) -> Executor:
    """Connect to a Dask cluster, or start one on this machine."""
    try:
        import distributed  # noqa: F401
    except ModuleNotFoundError as error:
        raise ConfigError(
            f"executor 'dask': needs dask and distributed ({error}); install them with "
            "pip install 'gym-mapbench[distributed]'"
        ) from None
    from evolution.driving.cluster import connect

    return connect(setup)


EXECUTORS: Registry[Callable[[WorkerSetup], Executor]] = Registry(
    "executor", "executors", {"processes": _processes, "dask": _dask}, check=must_be_callable
)
"""Factories that make an executor for a :class:`WorkerSetup`, by name."""
