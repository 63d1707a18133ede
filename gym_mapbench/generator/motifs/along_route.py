"""AlongRoute: families whose maps have elements along a route from start to goal."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.base import empty
from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.genes import MotifGenes, Section
from gym_mapbench.generator.motifs.routes import Leg, Point, Route, RouteName, legs_of
from gym_mapbench.generator.ranges import FractionRange, sample, sample_flag
from gym_mapbench.generator.shapes import Cells, ShapeSettings, clear_and_border, task_cells
from gym_mapbench.settings import Settings

if TYPE_CHECKING:
    from gym_mapbench.generator.motifs.motif import Motif, Values

USUAL_WIDTH = 0.44
"""Width of the robot for which the ranges of gaps and corridors are meant, m; others have as much room beside them."""


class Place(NamedTuple):
    """Where an element stands.

    Args:
        leg: Number of the leg of the route.
        centre: ``(x, y)``, m.
        section: Number of its section.
        number: Its number in the section.
        values: Its values of all genes.
    """

    leg: int
    centre: Point
    section: int
    number: int
    values: Values


class AlongRoute(Settings):
    """A family of maps whose elements follow a route; the genes are :class:`MotifGenes`.

    Args:
        routes: Routes that maps have, all equally likely.
        bend: Range of how far a bent route leaves the straight line, to either side; 1 reaches a corner of the map.
    """

    genes: ClassVar[type[Settings]] = MotifGenes

    routes: Annotated[tuple[RouteName, ...], Field(min_length=1)] = ("diagonal", "straight", "bent")
    bend: FractionRange = (0.3, 1.0)

    @abstractmethod
    def motif(self, name: str) -> Motif:
        """Return the motif of a section."""

    @abstractmethod
    def options_for(self, wider: float) -> dict[str, Any]:
        """Return the options whose ranges are those for a robot of another width, without those that the user gave.

        Args:
            wider: The robot's width less :data:`USUAL_WIDTH`, m.
        """

    @abstractmethod
    def draw_sections(self, rng: np.random.Generator) -> tuple[Section, ...]:
        """Sample the sections of one map."""

    def draw_genes(self, rng: np.random.Generator) -> MotifGenes:
        """Sample the genes of one map."""
        return MotifGenes(route=self.draw_route(rng), sections=self.draw_sections(rng))

    def draw_route(self, rng: np.random.Generator) -> Route:
        """Sample a route."""
        name = self.routes[int(rng.integers(len(self.routes)))]
        mirrored, side, bend = sample_flag(rng), sample_flag(rng), sample(rng, self.bend)
        return Route(name=name, mirrored=mirrored, bend=bend if side else -bend)

    def build(self, genes: MotifGenes, shapes: ShapeSettings) -> Cells:
        """Return the occupancy; see :meth:`~gym_mapbench.generator.Family.build`."""
        cells, (start, goal) = empty(shapes), _task(shapes)
        legs, reach = legs_of(genes.route, start, goal), (shapes.cleared_distance + 0.5) * shapes.resolution
        _check_room(legs, shapes, reach)
        centres = (np.arange(shapes.size) + 0.5) * shapes.resolution
        for place in _places(self, genes, legs):
            if _is_clear(legs, place.leg, place.centre, reach):
                east, north = (centres - part for part in place.centre)
                around = Around(east, north, legs[place.leg].along, place.number, shapes.resolution)
                self.add_walls(cells, genes.sections[place.section].motif, around, place.values)
        return clear_and_border(cells, shapes)

    def add_walls(self, cells: Cells, motif: str, around: Around, values: Values) -> None:
        """Occupy the cells of one element of a section with a motif."""
        cells |= self.motif(motif).walls(around, values)


def places(family: AlongRoute, genes: MotifGenes, start: Sequence[float], goal: Sequence[float]) -> Iterator[Place]:
    """Return the places of all elements from start to goal.

    Sections follow each other; together they are in the middle of the route.

    Args:
        family: The family of the genes.
        genes: Route and sections.
        start: ``(x, y)``, m.
        goal: ``(x, y)``, m.
    """
    return _places(family, genes, legs_of(genes.route, start, goal))


def _places(family: AlongRoute, genes: MotifGenes, legs: Sequence[Leg]) -> Iterator[Place]:
    begin = (sum(leg.length for leg in legs) - sum(_length(section) for section in genes.sections)) / 2
    for number, section in enumerate(genes.sections):
        motif, pitch = family.motif(section.motif), section.shared["pitch"]
        for element, deviations in enumerate(section.elements):
            progress = begin + (element + 0.5 + section.shared["phase"]) * pitch
            low, high = motif.pitch
            leg, rest = _leg_at(legs, progress + deviations.get("pitch", 0.0) * (high - low))
            values = motif.values(section, element)
            yield Place(leg, _centre(legs[leg], rest, values, element), number, element, values)
        begin += _length(section)


def _length(section: Section) -> float:
    return len(section.elements) * section.shared["pitch"]


def _leg_at(legs: Sequence[Leg], progress: float) -> tuple[int, float]:
    """Return the number of the leg at a progress, and the progress on this leg."""
    for number, leg in enumerate(legs[:-1]):
        if progress < leg.length:
            return number, progress
        progress -= leg.length
    return len(legs) - 1, progress


def _centre(leg: Leg, progress: float, values: Values, number: int) -> Point:
    """Return the centre of an element, on the line of gaps."""
    side = 0.5 if number % 2 == 0 else -0.5
    aside = values["shift"] + values["slope"] * (progress - leg.length / 2) + side * values["swing"]
    return leg.at(progress) + aside * leg.across


def _is_clear(legs: Sequence[Leg], number: int, centre: Point, reach: float) -> bool:
    """Whether a wall across a leg, through a point, leaves out the squares cleared around start and goal."""
    leg, ends = legs[number], (legs[0].start, legs[-1].end)
    return all(abs(float((centre - end) @ leg.along)) > reach * leg.breadth for end in ends)


def _check_room(legs: Sequence[Leg], shapes: ShapeSettings, reach: float) -> None:
    """Refuse a map whose cleared areas leave no room for a wall halfway between start and goal."""
    middle = (legs[0].start + legs[-1].end) / 2
    if not all(_is_clear(legs, number, middle, reach) for number in range(len(legs))):
        raise ConfigError(
            f"size: expected a map with room for motifs between the cleared areas of start and goal, got {shapes.size} "
            "cells"
        )


def _task(shapes: ShapeSettings) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return ``(x, y)`` of start and goal, m."""
    ends = task_cells((shapes.size, shapes.size), shapes.border + shapes.task_distance)
    start, goal = (((col + 0.5) * shapes.resolution, (row + 0.5) * shapes.resolution) for row, col in ends)
    return start, goal
