"""The options of a search. The defaults are those of the thesis where it has them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from evolution.driving import TIME
from evolution.search.algorithms import GaSettings
from evolution.search.judging import FITNESSES, JudgingSettings
from evolution.search.option_names import SECTIONS, SHORT_NAMES, nested
from evolution.search.sections import ArchiveSettings, ValidationSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import FamilySpecs, PeopleSettings, ShapeSettings
from gym_mapbench.metrics import METRICS
from gym_mapbench.quantities import Count, Few, Natural
from gym_mapbench.settings import ExtendedSettings

Limit = Annotated[Count, Field(le=10**9)]

METRIC_NAMES = (TIME, *METRICS.built_in)
"""The quantities that can be compared between controllers, without third-party metrics."""


class EvolveSettings(ExtendedSettings):
    """All options of one search.

    Args:
        seed: Root of all randomness.
        evaluations: Individuals evaluated in total, including the first population.
        runs: Runs of controllers in total, including those of the validation stage; None for no limit. The search ends
            where either limit is reached.
        maps_per_set: Maps in an individual.
        repeats: Runs of each controller on each map.
        ga: The algorithm and its operators.
        judging: How the results of a map set become its fitness.
        archive: How the archive of all evaluated maps takes part.
        validation: How the best maps are validated on held-out seeds; None for no validation stage.
        families: Families that new maps, and the pieces that mutation adds, are sampled from with equal probability:
            names of :data:`gym_mapbench.generator.FAMILIES`, or mappings of ``name`` and ``options``. If empty, random
            shapes, as in the thesis.
        shapes: Size of the maps, and the options of random shapes.
        people: The people on new maps, and how often a mutation changes them; none by default.
    """

    newer: ClassVar[tuple[str, ...]] = ("people",)

    seed: Natural = 0
    evaluations: Limit = 600
    runs: Limit | None = None
    maps_per_set: Few = 3
    repeats: Few = 1
    ga: GaSettings = GaSettings()
    judging: JudgingSettings = JudgingSettings()
    archive: ArchiveSettings = ArchiveSettings()
    validation: ValidationSettings | None = None
    families: FamilySpecs = ()
    shapes: ShapeSettings = ShapeSettings()
    people: PeopleSettings = PeopleSettings()

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of all options and their short names, for messages about unknown ones."""
        return [*super().option_names(), *SHORT_NAMES]

    @model_validator(mode="before")
    @classmethod
    def _in_sections(cls, values: Any) -> Any:
        return nested(values) if isinstance(values, Mapping) else values

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if self.evaluations < self.ga.pop_size:
            raise ConfigError(f"evaluations: expected at least pop_size ({self.ga.pop_size}), got {self.evaluations}")
        if self.validation and self.validation.candidates < self.maps_per_set:
            raise ConfigError(
                f"validation.candidates: expected at least maps_per_set ({self.maps_per_set}), got "
                f"{self.validation.candidates}"
            )
        return self

    def replace(self, **changes: Any) -> Self:
        """Return a copy with some options changed, validated again; options in sections by their short names."""
        changed = nested(changes)
        for name in set(changed) & set(SECTIONS):
            if isinstance(changed[name], Mapping):
                changed[name] = {**dict(getattr(self, name)), **changed[name]}
        return super().replace(**changed)

    def check(self, controllers: int) -> None:
        """Refuse a search that cannot be run with this number of controllers.

        Raises:
            ConfigError: Naming the option, the expected value, and the given one.
            PluginError: If a third-party fitness fails.
        """
        pattern = self.judging.pattern
        with FITNESSES.blamed(self.judging.fitness):
            pattern.check(self.maps_per_set, controllers)
        most, objectives = self.ga.kind.objectives, (*pattern.objectives, *self.judging.objectives)
        if most is not None and len(objectives) > most:
            raise ConfigError(
                f"ga.algorithm: expected one for {len(objectives)} objectives (such as nsga2) with fitness "
                f"{self.judging.fitness!r}, got {self.ga.algorithm!r}"
            )
        self.check_runs(controllers)

    def check_runs(self, controllers: int) -> None:
        """Refuse a limit of runs that the first population and the validation stage do not leave room for.

        Raises:
            ConfigError: With the number of runs that are needed.
        """
        if self.runs is None:
            return
        first = self.ga.pop_size * self.maps_per_set * controllers * self.repeats
        needed = first + self.validation_runs(controllers)
        if self.runs < needed:
            raise ConfigError(
                f"runs: expected at least {needed} ({first} for the first population and "
                f"{needed - first} for the validation stage), got {self.runs}"
            )

    def validation_runs(self, controllers: int) -> int:
        """Return the runs reserved for the validation stage: the held-out seeds of the candidates and of the set.

        They suffice for a whole set of maps with one repeat, which get the seeds of the elite first.
        """
        if self.validation is None:
            return 0
        stage = self.validation
        of_candidates = max(stage.candidates * stage.seeds, self.maps_per_set * self.archive.elite_seeds)
        return controllers * (of_candidates + self.maps_per_set * stage.seeds_of_set)

    @property
    def elite_repeats(self) -> int:
        """Runs of each controller on a map that joins the archive's best set."""
        return self.repeats + self.archive.elite_seeds

    @property
    def most_elite_repeats(self) -> int:
        """Runs of each controller on a map that stays there."""
        return self.repeats + 4 * self.archive.elite_seeds
