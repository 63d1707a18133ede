"""The options of the search, and the experiment they belong to. The defaults are those of the thesis."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Protocol, Self

from pydantic import (
    AfterValidator,
    Field,
    SerializerFunctionWrapHandler,
    field_validator,
    model_serializer,
    model_validator,
)

from evolution.driving import TIME, ControllerSpec, JobPlan, RunSettings, check_controllers, check_metric
from evolution.search.judging.patterns import FITNESSES
from evolution.search.operators.changes import OPERATORS
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import FamilySpecs, ShapeSettings
from gym_mapbench.metrics import METRICS
from gym_mapbench.metrics.episode import Outcome
from gym_mapbench.quantities import Count, Fraction, NonNegative, Positive
from gym_mapbench.settings import Settings

Few = Annotated[Count, Field(le=10_000)]
Budget = Annotated[Count, Field(le=10**9)]


def _fitness(name: str) -> str:
    """Refuse an unknown fitness."""
    FITNESSES.get(name)
    return name


FitnessName = Annotated[str, AfterValidator(_fitness)]

METRIC_NAMES = (TIME, *METRICS.built_in)
"""The quantities that can be compared between controllers, without third-party metrics."""


class MutationSettings(Settings):
    """How mutation changes the obstacles of a map (thesis, section 4.1.5). Ranges include both ends.

    Args:
        probability: Probability that an individual is mutated (p_m).
        shapes_per_map: Smallest and largest number of obstacles changed on each map (k).
        move_probability: Probability that a chosen obstacle is moved.
        scale_probability: Probability that it is enlarged or reduced.
        remove_probability: Probability that it is deleted.
        add_probability: Probability that it stays and a new one is drawn as in sampling.
        move_distance: Farthest move along each axis, cells.
        scale_factor: Smallest and largest factor of an obstacle's height and width.
        connectivity: Neighbours of a cell that belong to the same obstacle, 4 (SciPy's default) or 8.
        maps: Whether ``all`` maps of an individual are mutated, as in the thesis, or ``one``.
        drivable: Whether a mutation must leave a way that Nav2 can plan; it is drawn anew where it does not, 20 times
            at most.
        adaptive: Whether operators that improve sets are used more (:mod:`evolution.search.operators.adaptive`); only
            where one map is mutated at a time, so that it is known which change did it.
        operators: Further operators by name, with the probability that each is applied to a chosen obstacle (see
            :mod:`evolution.search.operators.changes`): ``nudge``, ``near_way``, ``door`` and ``redraw``, which look at
            the way that Nav2 plans or draw the map anew, or a third party's.
    """

    probability: Fraction = 0.5
    maps: Literal["all", "one"] = "all"
    drivable: bool = False
    adaptive: bool = False
    shapes_per_map: tuple[Few, Few] = (1, 3)
    move_probability: Fraction = 0.25
    scale_probability: Fraction = 0.25
    remove_probability: Fraction = 0.25
    add_probability: Fraction = 0.25
    move_distance: Few = 15
    scale_factor: tuple[Positive, Positive] = (0.5, 1.5)
    connectivity: Literal[4, 8] = 4
    operators: dict[str, Fraction] = Field(default_factory=dict)

    @field_validator("operators")
    @classmethod
    def _known(cls, value: dict[str, float]) -> dict[str, float]:
        for name in value:
            if f"{name}_probability" in cls.model_fields:
                raise ConfigError(f"expected other operators, got {name!r}, which has a probability of its own")
            OPERATORS.get(name)
        return value

    @model_serializer(mode="wrap")
    def _without_none(self, dump: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave ``operators`` out if it is empty, so that such a run is written as before the option existed."""
        values: dict[str, Any] = dump(self)
        return {name: value for name, value in values.items() if name != "operators" or value}

    @field_validator("shapes_per_map", "scale_factor")
    @classmethod
    def _ordered(cls, value: tuple[float, float]) -> tuple[float, float]:
        if value[0] > value[1]:
            raise ConfigError(f"expected (smallest, largest), got {value}")
        return value

    @model_validator(mode="after")
    def _consistent(self) -> MutationSettings:
        if not math.isclose(sum(self.probabilities.values()), 1.0, abs_tol=1e-9):
            chances = ", ".join(f"{name} {chance:g}" for name, chance in self.probabilities.items())
            raise ConfigError(f"probabilities: expected a sum of 1, got {chances}")
        if self.adaptive and self.maps != "one":
            raise ConfigError(f"adaptive: expected maps 'one' beside it, got {self.maps!r}")
        return self

    @property
    def probabilities(self) -> dict[str, float]:
        """Probabilities of all operators by name: move, scale, remove and add, then the others."""
        named = {name: getattr(self, f"{name}_probability") for name in ("move", "scale", "remove", "add")}
        return named | self.operators


class ConfirmationSettings(Settings):
    """How the maps that could end in the best set are driven again before one is named.

    Args:
        seeds: New seeds that every candidate is driven with, which the search has not used, until it fails once; those
            of the chosen set are driven with as many again.
        candidates: Maps that never failed with them, at most.
        claim_seeds: Further new seeds that the chosen set is driven with; they alone say what it is worth.
        reliability: Share of single drives that reach at least the value by which a set is chosen.
    """

    seeds: Annotated[int, Field(ge=2)] = 5
    candidates: Few = 9
    claim_seeds: Annotated[int, Field(ge=2)] = 10
    reliability: Annotated[float, Field(gt=0, lt=1)] = 0.9

    @property
    def seeds_of_set(self) -> int:
        """New seeds for which runs of a whole set are kept back: twice, as the choice may change, and for the claim."""
        return 2 * self.seeds + self.claim_seeds


class EvolveSettings(Settings):
    """All options of one search.

    Args:
        fitness: ``gini`` (Alg. 1 and 2), ``cluster`` (Alg. 3 and 4), ``roles``, ``pairs``, or a third-party fitness
            (see :mod:`evolution.search.judging.patterns`).
        algorithm: ``ga``, or the baseline ``random``, which samples every generation anew.
        pop_size: Individuals in the population, and offspring per generation.
        evaluations: Individuals evaluated in total, including the first population.
        runs: Runs of controllers in total, including those of the confirmation; None for no limit. The search ends
            where either limit is reached.
        archive: Whether the best set of all maps driven so far joins the population after every generation.
        elite_seeds: Further runs of each controller, each with a new seed, on the maps of that set before it joins; one
            more after every generation that a map stays in it, up to four times as many.
        drive_last: Controllers, by kind, that drive a map only where all others have reached the goal; their missing
            runs count as failed. Names of controllers that are not compared are ignored.
        confirmation: How the best maps are driven again before the best set is named; None to trust the search.
        maps_per_set: Maps in an individual.
        seed: Root of all randomness.
        repeats: Runs of each controller on each map.
        aggregate: How the repeats of a controller on a map become one value.
        caution: Standard deviations of single runs by which the extreme readings of a set count as less extreme, where
            its maps were driven more than once; for fitnesses that judge by readings.
        metric: Quantity compared between controllers: one of ``METRIC_NAMES``, or a third-party metric.
        failures: How a failed run counts: ``exclude`` (as in the thesis, its map has no value), ``censor`` (as the
            time limit) or ``par2`` (as twice the time limit).
        timeout_outcomes: Outcomes that count as timeouts in Eq. 4.5.
        base_cost: C_b of Eq. 4.5.
        timeout_cost: C_t of Eq. 4.5.
        pattern_weight: w_p of Eq. 4.5.
        epsilon: Smallest difference between two Gini coefficients (Alg. 2).
        unevenness_weight: lambda of Alg. 2.
        cluster_scale: Scale of Alg. 3, in units of ``metric``; if None, the median gap over the first population.
        crossover: ``pool`` (the maps of both parents are distributed at random) or ``position`` (maps at the same
            position are exchanged).
        crossover_probability: Probability that two parents are crossed (p_c).
        mutation: How obstacles change.
        families: Families that new maps, and the pieces that mutation adds, are drawn from with equal probability:
            names of :data:`gym_mapbench.generator.FAMILIES`, or mappings of ``name`` and ``options``. If empty, random
            shapes, as in the thesis.
        shapes: Size of the maps, and the options of random shapes.
    """

    fitness: FitnessName = "gini"
    algorithm: Literal["ga", "random"] = "ga"
    pop_size: Annotated[int, Field(ge=2, le=100_000)] = 40
    evaluations: Budget = 600
    runs: Budget | None = None
    archive: bool = False
    elite_seeds: Annotated[int, Field(ge=0, le=100_000)] = 0
    drive_last: tuple[str, ...] = ()
    confirmation: ConfirmationSettings | None = None
    maps_per_set: Few = 3
    seed: Annotated[int, Field(ge=0)] = 0
    repeats: Few = 1
    aggregate: Literal["mean", "median"] = "mean"
    caution: NonNegative = 0.0
    metric: str = "time"
    failures: Literal["exclude", "censor", "par2"] = "exclude"
    timeout_outcomes: tuple[Outcome, ...] = ("timeout",)
    base_cost: NonNegative = 100.0
    timeout_cost: NonNegative = 10.0
    pattern_weight: NonNegative = 20.0
    epsilon: NonNegative = 1e-8
    unevenness_weight: NonNegative = 1.0
    cluster_scale: Positive | None = None
    crossover: Literal["pool", "position"] = "pool"
    crossover_probability: Fraction = 1.0
    mutation: MutationSettings = MutationSettings()
    families: FamilySpecs = ()
    shapes: ShapeSettings = ShapeSettings()

    @field_validator("metric")
    @classmethod
    def _known(cls, value: str) -> str:
        return check_metric(value)

    @model_validator(mode="after")
    def _consistent(self) -> EvolveSettings:
        if self.evaluations < self.pop_size:
            raise ConfigError(f"evaluations: expected at least pop_size ({self.pop_size}), got {self.evaluations}")
        if self.failures != "exclude" and self.metric != "time":
            raise ConfigError(
                f"failures: expected 'exclude' with metric {self.metric!r} ({self.failures} counts the time limit)"
            )
        self._check_archive()
        return self

    def _check_archive(self) -> None:
        """Refuse options that mean nothing without others."""
        if self.drive_last and self.failures != "exclude":
            raise ConfigError(
                f"drive_last: expected [] with failures {self.failures!r}, or failures 'exclude': runs that are left "
                "out have no time"
            )
        if self.elite_seeds and not self.archive:
            raise ConfigError(f"elite_seeds: expected 0 without archive, got {self.elite_seeds}")
        if self.confirmation and self.confirmation.candidates < self.maps_per_set:
            raise ConfigError(
                f"confirmation.candidates: expected at least maps_per_set ({self.maps_per_set}), got "
                f"{self.confirmation.candidates}"
            )

    def check_runs(self, controllers: int) -> None:
        """Refuse a limit of runs that the first population and the confirmation do not leave room for.

        Raises:
            ConfigError: Saying how many runs are needed.
        """
        if self.runs is None:
            return
        first = self.pop_size * self.maps_per_set * controllers * self.repeats
        needed = first + self.runs_to_confirm(controllers)
        if self.runs < needed:
            raise ConfigError(
                f"runs: expected at least {needed} ({first} for the first population and "
                f"{needed - first} for the confirmation), got {self.runs}"
            )

    def runs_to_confirm(self, controllers: int) -> int:
        """Return the runs that are kept back for the confirmation: the new seeds of the candidates and of the set.

        They suffice for a whole set whose maps were driven once, and come to the seeds of the elite first.
        """
        if self.confirmation is None:
            return 0
        options = self.confirmation
        of_candidates = max(options.candidates * options.seeds, self.maps_per_set * self.elite_seeds)
        return controllers * (of_candidates + self.maps_per_set * options.seeds_of_set)

    @property
    def elite_repeats(self) -> int:
        """Runs of each controller on a map that comes into the archive's best set."""
        return self.repeats + self.elite_seeds

    @property
    def most_elite_repeats(self) -> int:
        """Runs of each controller on a map that stays there."""
        return self.repeats + 4 * self.elite_seeds


class RunSettingsModel(RunSettings, Protocol):
    """A :class:`RunSettings` type that can be read from a mapping, as every ``Settings`` can."""

    @classmethod
    def from_mapping(cls, values: object, where: str) -> Self:
        """Build from a mapping (``Settings``' own method)."""
        ...


@dataclass(frozen=True)
class Experiment:
    """Everything that defines one search: its options, the compared controllers, and the world they drive in.

    Raises:
        ConfigError: If there is no controller, a name occurs twice, the fitness means nothing for so few, or the runs
            allowed are fewer than the least that are needed.
    """

    search: EvolveSettings
    controllers: tuple[ControllerSpec, ...]
    run: RunSettings

    def __post_init__(self) -> None:
        object.__setattr__(self, "controllers", tuple(self.controllers))
        check_controllers(self.controllers)
        FITNESSES.get(self.search.fitness).check(self.search, len(self.controllers))
        self.search.check_runs(len(self.controllers))

    @classmethod
    def from_document(cls, document: object, run_type: type[RunSettingsModel], where: str) -> Experiment:
        """Read what :meth:`document` returned.

        Args:
            document: A mapping with (at least) ``search``, ``controllers`` and ``run``.
            run_type: The ``Settings`` type that ``run`` is read as.
            where: Beginning of every error message.

        Raises:
            ConfigError: If a part is missing or does not fit.
        """
        if not isinstance(document, Mapping) or not {"search", "controllers", "run"} <= set(document):
            raise ConfigError(f"{where}: expected the keys search, controllers and run")
        if not isinstance(document["controllers"], Sequence):
            raise ConfigError(f"{where}: controllers: expected a list, got {type(document['controllers']).__name__}")
        return cls(
            EvolveSettings.from_mapping(document["search"], f"{where}: search"),
            tuple(ControllerSpec.from_mapping(spec, f"{where}: controllers") for spec in document["controllers"]),
            run_type.from_mapping(document["run"], f"{where}: run"),
        )

    @property
    def plan(self) -> JobPlan:
        """Which runs a scenario needs, and what is measured on them."""
        return JobPlan(self.controllers, self.run, self.search.seed, self.search.repeats, (self.search.metric,))

    def document(self) -> dict[str, Any]:
        """Return everything as JSON-able values, under ``search``, ``controllers`` and ``run``."""
        return {
            "search": self.search.model_dump(mode="json"),
            "controllers": [spec.model_dump(mode="json") for spec in self.controllers],
            "run": self.run.model_dump(mode="json"),
        }
