"""Operators on genes: they change the genes of a map of motifs, from which the map is built again.

A third-party operator is a function ``(edit, rng) -> MotifGenes``, named ``module:attribute`` or registered in
:data:`GENE_OPERATORS`. The option ``genes.operators`` of mutation holds its probability. An operator that cannot change
these genes returns them as they are; another operator is selected then.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from gym_mapbench.generator import AlongRoute, Motif, MotifGenes, Section
from gym_mapbench.quantities import Fraction
from gym_mapbench.registry import Registry, must_be_callable
from gym_mapbench.settings import Settings

T = TypeVar("T")

LINE_GENES = ("shift", "slope", "swing")
"""Shared genes that take elements off the route; all are 0 on it."""


class StepSettings(Settings):
    """The size of steps of genes.

    Args:
        step: Standard deviation of a step, share of the width of the gene's range.
        leap: Standard deviation of a large step.
        leap_probability: Probability that a step is a large one.
    """

    step: Fraction = 0.05
    leap: Fraction = 0.18
    leap_probability: Fraction = 0.2


@dataclass(frozen=True)
class GeneEdit:
    """The genes of a map before a mutation.

    Args:
        genes: The genes.
        family: Their family, which has the ranges.
        settings: Size of the steps.
        mates: Genes of the same family of other maps in the population.
    """

    genes: MotifGenes
    family: AlongRoute
    settings: StepSettings
    mates: Sequence[MotifGenes] = ()

    def step_size(self, rng: np.random.Generator) -> float:
        """Return the standard deviation of the next steps, share of a gene's range."""
        return self.settings.leap if rng.random() < self.settings.leap_probability else self.settings.step

    def section(self, rng: np.random.Generator) -> tuple[int, Section, Motif]:
        """Return the number of a random section, the section, and its motif."""
        number = int(rng.integers(len(self.genes.sections)))
        section = self.genes.sections[number]
        return number, section, self.family.motif(section.motif)

    def mate(self, motif: str, rng: np.random.Generator) -> Section | None:
        """Return a random section of another map with the same motif; None if there is none."""
        sections = [one for genes in self.mates for one in genes.sections if one.motif == motif]
        return sections[int(rng.integers(len(sections)))] if sections else None

    def replaced(self, number: int, section: Section) -> MotifGenes:
        """Return the genes with another section."""
        return self.genes.replace(sections=put(self.genes.sections, number, section))


def step_shared(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Step shared genes of a section, about half of them, at least one."""
    number, section, motif = edit.section(rng)
    names, size = tuple(motif.ranges), edit.step_size(rng)
    chosen = rng.random(len(names)) < 0.5
    chosen[rng.integers(len(names))] = True
    shared = dict(section.shared)
    for name in (name for name, hit in zip(names, chosen, strict=True) if hit):
        low, high = motif.ranges[name]
        shared[name] = float(np.clip(shared[name] + rng.normal(0.0, size) * (high - low), low, high))
    return edit.replaced(number, section.replace(shared=shared))


def step_element(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Step the deviation of one element in one gene."""
    _, _, motif = picked = edit.section(rng)
    genes = motif.element_genes
    return _with_stepped(edit, picked, (genes[int(rng.integers(len(genes)))],), rng)


def shift_element(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Shift one element along the route and across it."""
    return _with_stepped(edit, edit.section(rng), ("pitch", "shift"), rng)


def shrink_deviations(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Shrink all deviations of a section by one factor, 0 to 1."""
    number, section, _ = edit.section(rng)
    factor = float(rng.random())
    elements = tuple({gene: factor * value for gene, value in one.items()} for one in section.elements)
    return edit.replaced(number, section.replace(elements=elements))


def straighten(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Make the elements of a section equal, and put them on the route: no deviations, shift, slope or swing."""
    number, section, motif = edit.section(rng)
    on_route = {gene: float(np.clip(0.0, *motif.ranges[gene])) for gene in LINE_GENES}
    shared = {**section.shared, **on_route}
    return edit.replaced(number, section.replace(shared=shared, elements=({},) * len(section.elements)))


def add_element(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Add an element with small deviations anywhere in a section, unless it has the largest count."""
    number, section, motif = edit.section(rng)
    return _inserted(edit, number, section, motif.draw_element(rng, edit.settings.step), rng)


def duplicate_element(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Add a copy of an element anywhere in its section, unless it has the largest count."""
    number, section, _ = edit.section(rng)
    return _inserted(edit, number, section, section.elements[int(rng.integers(len(section.elements)))], rng)


def remove_element(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Remove an element of a section, unless it has the smallest count."""
    number, section, motif = edit.section(rng)
    if len(section.elements) <= motif.count[0]:
        return edit.genes
    place = int(rng.integers(len(section.elements)))
    return edit.replaced(number, section.replace(elements=section.elements[:place] + section.elements[place + 1 :]))


def cross_shared(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Take each shared gene of a section from another map with probability 1/2 (uniform crossover)."""
    number, section, _ = edit.section(rng)
    if (mate := edit.mate(section.motif, rng)) is None:
        return edit.genes
    swap = rng.random(len(section.shared)) < 0.5
    pairs = zip(section.shared.items(), swap, strict=True)
    shared = {name: mate.shared[name] if swapped else value for (name, value), swapped in pairs}
    return edit.replaced(number, section.replace(shared=shared))


def cross_elements(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Take each element of a section from the same place of another map with probability 1/2."""
    number, section, _ = edit.section(rng)
    if (mate := edit.mate(section.motif, rng)) is None:
        return edit.genes
    both = min(len(section.elements), len(mate.elements))
    swap = rng.random(both) < 0.5
    taken = (mate.elements[place] if swap[place] else section.elements[place] for place in range(both))
    return edit.replaced(number, section.replace(elements=(*taken, *section.elements[both:])))


def change_route(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Step the bend of a bent route, or sample another route."""
    route = edit.genes.route
    if route.name != "bent" or rng.random() < 0.5:
        return edit.genes.replace(route=edit.family.draw_route(rng))
    low, high = edit.family.bend
    size = np.clip(abs(route.bend) + rng.normal(0.0, edit.step_size(rng)) * (high - low), low, high)
    return edit.genes.replace(route=route.replace(bend=float(np.copysign(size, route.bend))))


def swap_sections(edit: GeneEdit, rng: np.random.Generator) -> MotifGenes:
    """Exchange two sections of a sequence."""
    sections = list(edit.genes.sections)
    if len(sections) < 2:
        return edit.genes
    one, other = rng.choice(len(sections), size=2, replace=False)
    sections[one], sections[other] = sections[other], sections[one]
    return edit.genes.replace(sections=tuple(sections))


def put(values: tuple[T, ...], place: int, value: T) -> tuple[T, ...]:
    """Return a copy with the value at a place replaced."""
    return (*values[:place], value, *values[place + 1 :])


def _with_stepped(
    edit: GeneEdit, picked: tuple[int, Section, Motif], genes: Sequence[str], rng: np.random.Generator
) -> MotifGenes:
    """Return the genes after a step of some deviations of one element; deviations stay within -1 and 1."""
    number, section, _ = picked
    place, size = int(rng.integers(len(section.elements))), edit.step_size(rng)
    element = section.elements[place]
    stepped = {gene: float(np.clip(element.get(gene, 0.0) + rng.normal(0.0, size), -1.0, 1.0)) for gene in genes}
    return edit.replaced(number, section.replace(elements=put(section.elements, place, {**element, **stepped})))


def _inserted(
    edit: GeneEdit, number: int, section: Section, element: dict[str, float], rng: np.random.Generator
) -> MotifGenes:
    """Return the genes with another element at a random place of a section, unless it has the largest count."""
    if len(section.elements) >= edit.family.motif(section.motif).count[1]:
        return edit.genes
    place = int(rng.integers(len(section.elements) + 1))
    elements = (*section.elements[:place], element, *section.elements[place:])
    return edit.replaced(number, section.replace(elements=elements))


GeneOperator = Callable[[GeneEdit, np.random.Generator], MotifGenes]

PROBABILITIES = {
    step_shared: 0.35,
    step_element: 0.05,
    shift_element: 0.04,
    shrink_deviations: 0.05,
    straighten: 0.15,
    add_element: 0.06,
    remove_element: 0.06,
    duplicate_element: 0.04,
    cross_shared: 0.1,
    cross_elements: 0.04,
    change_route: 0.04,
    swap_sections: 0.02,
}
"""The operators on genes of the project, with their default probabilities."""

GENE_OPERATORS: Registry[GeneOperator] = Registry(
    "operator on genes",
    "gene_operators",
    {operator.__name__: operator for operator in PROBABILITIES},
    check=must_be_callable,
)
"""The operators on genes by name."""
