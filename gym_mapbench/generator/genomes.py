"""Genomes: from the genes of a map of motifs to plain data, and back."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.families import FamilySpec, build_map, make_family
from gym_mapbench.generator.motifs import AlongRoute, MotifGenes, places
from gym_mapbench.generator.shapes import Cells, ShapeSettings
from gym_mapbench.settings import Settings
from gym_mapbench.world.genome import Genome


def genome_of(spec: FamilySpec, genes: Settings) -> Genome | None:
    """Return the genome of a map; None if its genes are not those of motifs along a route.

    Args:
        spec: The family that the genes are of.
        genes: The genes.
    """
    if not isinstance(genes, MotifGenes):
        return None
    return Genome(family=spec.name, options=spec.options, genes=genes.model_dump(mode="json"))


def build_genome(genome: Genome, shapes: ShapeSettings) -> Cells:
    """Return the ``(size, size)`` occupancy of a genome's map; see :func:`read_genome`."""
    family, genes = read_genome(genome)
    return build_map(genome.family, family, genes, shapes)


def elements_line(genome: Genome, start: Sequence[float], goal: Sequence[float]) -> NDArray[np.float64]:
    """Return ``(n, 2)`` x and y of start, all elements and goal, m; see :func:`read_genome`.

    Args:
        genome: The genome.
        start: ``(x, y)``, m.
        goal: ``(x, y)``, m.
    """
    family, genes = read_genome(genome)
    return np.array([start, *(place.centre for place in places(family, genes, start, goal)), goal])


def read_genome(genome: Genome) -> tuple[AlongRoute, MotifGenes]:
    """Return the family of a genome, and its genes.

    Raises:
        ConfigError: If there is no such family, it has no routes, or the genes are none of it.
    """
    family = make_family(genome.family, **genome.options)
    if not isinstance(family, AlongRoute):
        raise ConfigError(f"family: expected a family of motifs along a route, got {genome.family!r}")
    genes = MotifGenes.from_mapping(genome.genes, "genes")
    for number, section in enumerate(genes.sections):
        expected = family.motif(section.motif).ranges
        if differing := sorted(set(expected) ^ set(section.shared)):
            raise ConfigError(f"sections.{number}.shared: expected the genes of the motif, {differing[0]!r} differs")
    return family, genes
