"""Job: one controller, one scenario, one repeat; and its result.

A job is plain, frozen data, so that it can be sent to a worker, looked up in a store and repeated on another machine.
:class:`JobPlan` makes jobs; a callable ``run_job(job) -> RunResult`` runs them.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Annotated, ClassVar

from pydantic import AfterValidator, ConfigDict, Field, JsonValue, TypeAdapter

from evolution.arguments import names_from, whole_number
from evolution.driving.seeds import ALL_CONTROLLERS, derive_seed
from evolution.driving.settings import DriveSettings
from evolution.files import PACKAGE_VERSION, code_of
from gym_mapbench.errors import ConfigError, unknown_name, visible
from gym_mapbench.metrics import ALWAYS, METRICS
from gym_mapbench.metrics.episode import Outcome
from gym_mapbench.settings import Settings
from gym_mapbench.world.scenario import Scenario

TIME = "time"
"""Name of the simulated seconds until the end, which may be compared like a metric."""

RESULT_FIELDS = ("outcome", "time_s", "path_length_m", "reason")
"""The fields of a result that the same seed reproduces, without the metrics and the seed itself."""

RUN_COLUMNS = frozenset({"generation", "map", "controller", "repeat", "seed", "noise_seed", "attempts", *RESULT_FIELDS})
"""The columns of a table of runs besides the metrics."""


MAX_REPEATS = 10_000


class ControllerSpec(Settings):
    """A controller under comparison.

    Args:
        name: Name in every table and figure; unique within an experiment.
        kind: Name it is registered under; ``name`` if empty.
        params: Its parameters, JSON-able.
    """

    name: Annotated[str, Field(min_length=1), AfterValidator(visible)]
    kind: str = ""
    params: dict[str, JsonValue] = Field(default_factory=dict)

    @property
    def registered_name(self) -> str:
        """Name to look the controller up under."""
        return self.kind or self.name


@dataclass(frozen=True)
class RunResult:
    """The stored result of one run; repeating the job with its seed gives the trajectory.

    Args:
        outcome: How the run ended; ``error`` if the controller raised, hung, or killed its worker.
        time_s: Simulated seconds until the end.
        path_length_m: Driven distance, m.
        reason: One line on why it did not reach the goal; empty if it did.
        attempts: How often the run was tried; a worker that something else has killed makes it differ, so that it stays
            out of reproducible files, like ``timings``.
        metrics: Further measures by name; the same for the same seed.
        timings: Wall-clock measures by name; they differ between runs and stay out of reproducible files.
        seed: Seed of the run.
    """

    __pydantic_config__: ClassVar = ConfigDict(extra="forbid")

    outcome: Outcome
    time_s: float
    path_length_m: float
    reason: str = ""
    attempts: int = 1
    metrics: Mapping[str, int | float] = field(default_factory=dict)
    timings: Mapping[str, float] = field(default_factory=dict)
    seed: int = 0

    @property
    def success(self) -> bool:
        """Whether the goal was reached."""
        return self.outcome == "goal"

    def value(self, metric: str) -> float:
        """Return one measure: ``time``, ``path_length``, or any of :attr:`metrics` and :attr:`timings`.

        Raises:
            ConfigError: If the run has no such measure.
        """
        own = {"time": self.time_s, "path_length": self.path_length_m}
        for values in (own, self.metrics, self.timings):
            if metric in values:
                return float(values[metric])
        raise unknown_name("metric", metric, {**self.timings, **self.metrics, **own})

    def to_json(self) -> str:
        """Return the JSON text that :meth:`from_json` reads."""
        return json.dumps(vars(self), default=dict, separators=(",", ":"))

    @classmethod
    def from_json(cls, text: str) -> RunResult:
        """Read what :meth:`to_json` wrote; raises ``ValueError`` if it is something else."""
        return _RESULT.validate_json(text, strict=True)


_RESULT = TypeAdapter(RunResult)

SetResults = tuple[tuple[tuple[RunResult, ...], ...], ...]
"""Results of one map set: ``results[map][controller][repeat]``."""


@dataclass(frozen=True)
class Job:
    """One run to do; made by :class:`JobPlan`.

    Args:
        scenario: Map, start and goal.
        controller: The controller.
        settings: World and robot.
        repeat: Number of the repetition, from 0.
        seed: Seed of the controller's randomness; different for every controller.
        noise_seed: Seed of the world's noise; the same for all controllers (common random numbers).
        metrics: Further metrics, besides the project's own.
        key: Digest of all of the above, of the code that is named there, and of this package's version: the identity of
            the run.
    """

    scenario: Scenario
    controller: ControllerSpec
    settings: DriveSettings
    repeat: int
    seed: int
    noise_seed: int
    metrics: tuple[str, ...]
    key: str


@dataclass(frozen=True)
class JobPlan:
    """Which runs a scenario needs: every controller, every repeat.

    Args:
        controllers: The compared controllers.
        settings: World and robot of every run.
        root_seed: Seed of the whole experiment.
        repeats: Runs of each controller on each map.
        metrics: Further metrics of every run, besides the project's own.

    Raises:
        ConfigError: If there is no controller, a name occurs twice, seed or repeats are no such number, or a metric is
            unknown.
    """

    controllers: tuple[ControllerSpec, ...]
    settings: DriveSettings
    root_seed: int = 0
    repeats: int = 1
    metrics: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "controllers", tuple(self.controllers))
        object.__setattr__(self, "metrics", asked_for(names_from("metrics", self.metrics)))
        object.__setattr__(self, "root_seed", whole_number("seed", self.root_seed, 0))
        object.__setattr__(self, "repeats", whole_number("repeats", self.repeats, 1, MAX_REPEATS))
        check_controllers(self.controllers)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the controllers, in order."""
        return tuple(spec.name for spec in self.controllers)

    def jobs(self, scenario: Scenario) -> list[Job]:
        """Return the jobs of one scenario, controller by controller, repeat by repeat."""
        return [
            self.job(scenario, number, repeat)
            for number in range(len(self.controllers))
            for repeat in range(self.repeats)
        ]

    @cached_property
    def _setups(self) -> tuple[str, ...]:
        """For each controller, the digest of everything but scenario and seed, its model and its code included."""
        of_all = PACKAGE_VERSION, self.settings.model_dump(mode="json")
        code = code_of([*of_all, *self.metrics])
        return tuple(
            digest_of([*of_all, document, *self.metrics, *filter(None, [model_digest(spec), code | code_of(document)])])
            for spec, document in ((spec, spec.model_dump(mode="json")) for spec in self.controllers)
        )

    def job(self, scenario: Scenario, number: int, repeat: int) -> Job:
        """Return one job of a scenario.

        Args:
            scenario: Map, start and goal.
            number: Position of the controller.
            repeat: Number of the repetition, from 0; it may be beyond :attr:`repeats`.
        """
        spec, setup = self.controllers[number], self._setups[number]
        seed = derive_seed(self.root_seed, scenario.world_digest, spec.name, repeat)
        noise_seed = derive_seed(self.root_seed, scenario.world_digest, ALL_CONTROLLERS, repeat)
        key = digest_of([setup, scenario.digest, seed, noise_seed, repeat])
        return Job(scenario, spec, self.settings, repeat, seed, noise_seed, self.metrics, key)


def model_digest(spec: ControllerSpec) -> str | None:
    """Return the content hash of a controller's model: another model in the same file is another controller.

    None for controllers without a file, and for a file that cannot be read, which whoever runs it reports.
    """
    path = Path(spec.registered_name)
    if path.suffix != ".zip" or not path.is_file():
        return None
    return hashlib.blake2b(path.read_bytes(), digest_size=16).hexdigest()


def models_of(specs: Iterable[ControllerSpec]) -> dict[str, str]:
    """Return the content hashes of the models among some controllers, by file."""
    found = {spec.registered_name: model_digest(spec) for spec in specs}
    return {name: digest for name, digest in sorted(found.items()) if digest is not None}


def check_metric(name: str) -> str:
    """Return the name of a metric, checked.

    Raises:
        ConfigError: If there is no such metric, or tables of runs already have a column of that name.
    """
    if name in RUN_COLUMNS:
        raise ConfigError(f"metric {name!r}: expected another name, it is a column of every table of runs")
    if name != TIME:
        METRICS.get(name, others=(TIME,))
    return name


def asked_for(names: Iterable[str]) -> tuple[str, ...]:
    """Return those of the named metrics that are not measured on every run, each once.

    Raises:
        ConfigError: If a metric is unknown, or workers cannot find it.
    """
    checked = dict.fromkeys(METRICS.for_workers(check_metric(name)) for name in names)
    return tuple(name for name in checked if name not in (TIME, *ALWAYS))


def check_controllers(controllers: tuple[ControllerSpec, ...]) -> None:
    """Refuse an empty comparison and names that occur twice.

    Raises:
        ConfigError: Naming what is wrong.
    """
    names = [spec.name for spec in controllers]
    twice = sorted({name for name in names if names.count(name) > 1})
    if not names:
        raise ConfigError("controllers: expected at least one, got none")
    if twice:
        raise ConfigError(f"controllers: expected different names, got {twice[0]!r} twice")


def digest_of(document: object) -> str:
    """Return the content hash (hex, 32 characters) of a JSON-able document."""
    text = json.dumps(document, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
