"""Mutation of genes: an operator changes the genes of a map, and the map is built again."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from pydantic import Field, field_validator

from evolution.search.operators.gene_changes import GENE_OPERATORS, PROBABILITIES, GeneEdit, StepSettings
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.generator import MotifGenes, read_genome
from gym_mapbench.quantities import Fraction
from gym_mapbench.world.genome import Genome


def _default_operators() -> dict[str, float]:
    """Return the probabilities of the project's operators by name."""
    return {operator.__name__: chance for operator, chance in PROBABILITIES.items()}


class GeneSettings(StepSettings):
    """How mutation changes maps that have a genome.

    Args:
        operators: Operators on genes by name, with the probability that each is applied (see
            :mod:`evolution.search.operators.gene_changes`).
    """

    operators: dict[str, Fraction] = Field(default_factory=_default_operators, min_length=1)

    @field_validator("operators")
    @classmethod
    def _known(cls, value: dict[str, float]) -> dict[str, float]:
        for name in value:
            GENE_OPERATORS.get(name)
        if not math.isclose(sum(value.values()), 1.0, abs_tol=1e-9):
            raise ConfigError(f"expected probabilities whose sum is 1, got a sum of {sum(value.values()):g}")
        return value


def change_genome(
    genome: Genome, operator: str, settings: StepSettings, mates: Sequence[Genome], rng: np.random.Generator
) -> Genome:
    """Return a genome that an operator has changed.

    Args:
        genome: The genome.
        operator: Name of the operator.
        settings: Size of the steps.
        mates: Genomes of other maps; those of the same family and options take part in crossover.
        rng: Source of all randomness.

    Raises:
        PluginError: If a third-party operator fails or returns anything but genes.
    """
    family, genes = read_genome(genome)
    alike = [one for one in mates if (one.family, one.options) == (genome.family, genome.options) and one != genome]
    edit = GeneEdit(genes, family, settings, [MotifGenes.from_mapping(one.genes, "genes") for one in alike])
    with GENE_OPERATORS.blamed(operator):
        changed: object = GENE_OPERATORS.get(operator)(edit, rng)
    if not isinstance(changed, MotifGenes):
        raise PluginError(f"operator on genes {operator!r}: expected MotifGenes, got {type(changed).__name__}")
    return genome.replace(genes=changed.model_dump(mode="json"))
