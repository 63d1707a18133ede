"""The options of mutation."""

from __future__ import annotations

import math
from typing import Any, Literal, Self

from pydantic import Field, SerializerFunctionWrapHandler, field_validator, model_serializer, model_validator

from evolution.search.operators.changes import OPERATORS
from evolution.search.operators.edits import EditSettings, ordered
from evolution.search.operators.gene_mutation import GeneSettings
from gym_mapbench.errors import ConfigError
from gym_mapbench.quantities import Few, Fraction
from gym_mapbench.settings import OptionError


class MutationSettings(EditSettings):
    """How mutation changes the obstacles of a map (thesis, section 4.1.5). Ranges include both ends.

    Args:
        probability: Probability that an individual is mutated (p_m).
        shapes_per_map: Smallest and largest number of obstacles changed on each map (k).
        move_probability: Probability that a chosen obstacle is moved.
        scale_probability: Probability that it is enlarged or reduced.
        remove_probability: Probability that it is deleted.
        add_probability: Probability that it stays and a new obstacle is sampled.
        move_distance: Farthest move along each axis, cells.
        scale_factor: Smallest and largest factor of an obstacle's height and width.
        connectivity: Neighbours of a cell that belong to the same obstacle, 4 (SciPy's default) or 8.
        maps: Whether ``all`` maps of an individual are mutated, as in the thesis, or ``one``.
        drivable: Whether a mutation must leave a path that Nav2 can plan; otherwise it is sampled again, 20 times at
            most.
        adaptive: Whether operators are selected by the gain of their earlier uses (adaptive operator selection,
            :mod:`evolution.search.operators.adaptive`); only with ``maps: one``, where the gain has one cause.
        operators: Further operators by name, with the probability that each is applied to a chosen obstacle (see
            :mod:`evolution.search.operators.changes`): ``nudge``, ``near_way`` and ``door``, which use the path that
            Nav2 plans, ``redraw``, which samples a new map, or a third party's.
        genes: How maps of motifs, which have a genome, change: in their genes, by operators of their own. Of the other
            operators, only those that sample a new map apply to them.
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
    connectivity: Literal[4, 8] = 4
    operators: dict[str, Fraction] = Field(default_factory=dict)
    genes: GeneSettings = GeneSettings()

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
        """Leave out what is as it is by default and not every search needs: ``operators`` and ``genes``."""
        values: dict[str, Any] = dump(self)
        default = {"operators": {}, "genes": GeneSettings().model_dump(mode="json")}
        return {name: value for name, value in values.items() if name not in default or value != default[name]}

    @field_validator("shapes_per_map")
    @classmethod
    def _counts_ordered(cls, value: tuple[int, int]) -> tuple[int, int]:
        return ordered(value)

    @model_validator(mode="after")
    def _consistent(self) -> Self:
        if not math.isclose(sum(self.probabilities.values()), 1.0, abs_tol=1e-9):
            own = {name: f"{name}_probability" for name in self.probabilities if name not in self.operators}
            chances = ", ".join(f"{own.get(name, name)} {chance:g}" for name, chance in self.probabilities.items())
            raise OptionError("", f"expected probabilities with a sum of 1, got {chances}")
        if self.adaptive and self.maps != "one":
            raise OptionError("adaptive", f"expected maps 'one' beside it, got {self.maps!r}")
        return self

    @property
    def probabilities(self) -> dict[str, float]:
        """Probabilities of all operators by name: move, scale, remove and add, then the others."""
        named = {name: getattr(self, f"{name}_probability") for name in ("move", "scale", "remove", "add")}
        return named | self.operators

    @property
    def gene_probabilities(self) -> dict[str, float]:
        """Probabilities of the operators for a map with a genome: those that sample a new map, then those on genes."""
        anew = {name: chance for name, chance in self.operators.items() if OPERATORS.get(name).anew}
        rest = 1.0 - sum(anew.values())
        return anew | {name: rest * chance for name, chance in self.genes.operators.items()}
