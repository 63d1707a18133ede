"""Resources: worker processes, executor and time limits of the runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Self

from evolution.driving.evaluator import RUN_TIMEOUT_SECONDS, Evaluator, OnRun
from evolution.driving.pool import RunJob, available_cores
from evolution.driving.store import WAIT_SECONDS, ResultStore
from gym_mapbench.quantities import Count, NonNegative, Positive
from gym_mapbench.settings import Settings


class Resources(Settings):
    """Worker processes, executor and time limits of the runs; the results do not depend on them.

    Args:
        workers: Number of worker processes; None for one per core.
        executor: Name of the executor (:mod:`evolution.driving.executors`), or ``NAME=ADDRESS`` with the address of a
            scheduler, as in ``dask=tcp://HOST:PORT``.
        wait_s: Longest wait for another process that has locked the results, s.
        run_timeout_s: Wall-clock seconds after which a run ends in an error.
    """

    workers: Count | None = None
    executor: str = "processes"
    wait_s: NonNegative = WAIT_SECONDS
    run_timeout_s: Positive = RUN_TIMEOUT_SECONDS

    def taking(self, options: Mapping[str, Any]) -> tuple[Self, dict[str, Any]]:
        """Return a copy with the fields that some options hold, and the other options.

        Args:
            options: Keyword arguments of a function.

        Raises:
            ConfigError: If a field cannot have such a value.
        """
        ours = {name: value for name, value in options.items() if name in type(self).model_fields}
        return self.replace(**ours), {name: options[name] for name in options if name not in ours}

    def evaluator(
        self,
        run_job: RunJob,
        store: ResultStore | None = None,
        warm_up: Callable[[], object] | None = None,
        kind: type[Evaluator] = Evaluator,
        retries: int = 1,
        on_run: OnRun | None = None,
    ) -> Evaluator:
        """Return an evaluator of a class, ``kind``, that uses these resources; arguments as for :class:`Evaluator`."""
        return kind(
            run_job,
            store,
            workers=self.workers or available_cores(),
            warm_up=warm_up,
            executor=self.executor,
            timeout_s=self.run_timeout_s,
            retries=retries,
            on_run=on_run,
        )


DEFAULT_RESOURCES = Resources()
