"""Mutation: changes some obstacles of maps of a set (thesis, section 4.1.5).

An obstacle is a connected component of the cells inside the border. The chosen obstacles are removed from the map
first and put back changed (:mod:`evolution.search.operators.changes`), so that they do not cut into each other.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy
from numpy.typing import NDArray
from pymoo.core.mutation import Mutation

from evolution.search.operators.adaptive import Credit, Trial
from evolution.search.operators.changes import OPERATORS
from evolution.search.operators.edits import Edit, Labels, Operator
from evolution.search.operators.gene_mutation import change_genome
from evolution.search.operators.people_changes import change_people
from evolution.search.operators.sampling import NOBODY, Cells, Column, as_column, scenario_on
from evolution.search.operators.settings import MutationSettings
from gym_mapbench.errors import PluginError
from gym_mapbench.generator import (
    FamilySpec,
    PeopleSettings,
    ShapeSettings,
    build_genome,
    checked_cells,
    clear_and_border,
    interior,
    is_drivable,
    plan_way,
    with_people,
)
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import MapSet, Scenario

MAX_TRIES = 20
"""Tries of a mutation that must leave a path; the last try stays."""
NEAR = 3
"""An informed operator lifts one of this many obstacles that are nearest to the path."""

Changes = list[tuple[int, str]]
Changed = tuple[Cells, tuple[str, ...], Genome | None]
"""A changed map, the names of the operators, and its genome."""
RoleOf = Callable[[MapSet, int], int]


@dataclass(frozen=True)
class Mutator:
    """Changes one map at a time.

    Args:
        shapes: Options of the map's border and of random shapes.
        settings: How obstacles change.
        robot: The robot that drives.
        families: Families whose pieces are added; random shapes if empty.
        people: How the people on a map change.
    """

    shapes: ShapeSettings
    settings: MutationSettings
    robot: RobotSpec
    families: Sequence[FamilySpec] = ()
    people: PeopleSettings = NOBODY

    def vary(
        self,
        scenario: Scenario,
        rng: np.random.Generator,
        chances: Mapping[str, float] | None = None,
        mates: Sequence[Genome] = (),
    ) -> tuple[Scenario, tuple[str, ...]]:
        """Return a changed map with the default task, and the names of the operators.

        A map with a genome changes in its genes; operators on cells apply to other maps only. On a map with people,
        either the people change or the walls; people who no longer fit between the walls are sampled again. A
        change of walls that leaves no room for a single person is dropped.

        Args:
            scenario: The map.
            rng: Source of all randomness.
            chances: Probabilities of the operators; those of the settings if None.
            mates: Genomes of other maps, for crossover.
        """
        if not scenario.bodies:
            return self._vary_walls(scenario, rng, chances, mates)
        if rng.random() < self.people.mutation:
            return change_people(scenario, self.people, rng)
        varied, names = self._vary_walls(scenario, rng, chances, mates)
        varied = with_people(varied, self.people, rng, scenario.bodies)
        return (varied, names) if varied.bodies else (scenario, ())

    def _vary_walls(
        self, scenario: Scenario, rng: np.random.Generator, chances: Mapping[str, float] | None, mates: Sequence[Genome]
    ) -> tuple[Scenario, tuple[str, ...]]:
        """Return a map without people, its walls changed."""
        chances = chances or self.probabilities(scenario)
        for _ in range(MAX_TRIES):
            if scenario.genome is None:
                cells, names, genome = self._change(scenario.map.occupancy, rng, chances)
            else:
                cells, names, genome = self._change_genes(scenario, scenario.genome, rng, chances, mates)
            same = genome is not None and np.array_equal(cells, scenario.map.occupancy)
            if not same and (not self.settings.drivable or is_drivable(cells, self.shapes, self.robot)):
                break
        return scenario_on(cells, self.shapes, genome), names

    def probabilities(self, scenario: Scenario) -> dict[str, float]:
        """Return the configured probabilities of the operators for a map."""
        return self.settings.probabilities if scenario.genome is None else self.settings.gene_probabilities

    def _change_genes(
        self,
        scenario: Scenario,
        genome: Genome,
        rng: np.random.Generator,
        chances: Mapping[str, float],
        mates: Sequence[Genome],
    ) -> Changed:
        """Return the map of changed genes, or a new map."""
        name = str(rng.choice(list(chances), p=list(chances.values())))
        if name not in self.settings.genes.operators:
            return self._change(scenario.map.occupancy, rng, {name: 1.0})
        changed = change_genome(genome, name, self.settings.genes, mates, rng)
        return build_genome(changed, self.shapes), (name,), changed

    def _change(self, cells: Cells, rng: np.random.Generator, chances: Mapping[str, float]) -> Changed:
        """Return a copy of the cells with some obstacles changed; border, start and goal areas are kept."""
        inside = interior(cells, self.shapes.border)
        labels, count = label_obstacles(inside, self.settings.connectivity)
        drawn = draw_changes(count, self.settings, rng, chances)
        operators = [OPERATORS.get(name) for _, name in drawn]
        way = None
        if any(operator.informed for operator in operators):
            way = plan_way(cells, self.shapes, self.robot)
            drawn = self._near_way(drawn, operators, labels, way, rng)
        lifted = [obstacle for (obstacle, _), operator in zip(drawn, operators, strict=True) if operator.lifts]
        changed, genome = inside & ~np.isin(labels, lifted), None
        for (obstacle, name), operator in zip(drawn, operators, strict=True):
            edit = Edit(changed, labels, obstacle, self.shapes, self.settings, self.robot, tuple(self.families), way)
            changed, genome = _changed_by(name, operator, edit, rng), edit.genome
        mutated = cells.copy()
        interior(mutated, self.shapes.border)[:] = changed
        return clear_and_border(mutated, self.shapes), tuple(name for _, name in drawn), genome

    def _near_way(
        self,
        drawn: Changes,
        operators: Sequence[Operator],
        labels: Labels,
        way: NDArray[np.float64] | None,
        rng: np.random.Generator,
    ) -> Changes:
        """Return the changes, in which informed operators lift obstacles near the path."""
        if way is None or not labels.any():
            return drawn
        near = obstacles_near(way / self.shapes.resolution - self.shapes.border - 0.5, labels)[:NEAR]
        return [
            (int(rng.choice(near)), name) if operator.informed and operator.lifts else (obstacle, name)
            for (obstacle, name), operator in zip(drawn, operators, strict=True)
        ]


def _changed_by(name: str, operator: Operator, edit: Edit, rng: np.random.Generator) -> Cells:
    """Return the cells after the change of an operator.

    Raises:
        PluginError: If a third-party operator fails, returns a value, or leaves other cells.
    """
    wanted = edit.cells.shape
    with OPERATORS.blamed(name):
        answer: object = operator.change(edit, rng)  # type: ignore[func-returns-value]
    if answer is not None:
        got = type(answer).__name__
        raise PluginError(f"mutation operator {name!r}: expected a change of edit.cells and no result, got {got}")
    return checked_cells(edit.cells, wanted, f"mutation operator {name!r}: expected edit.cells")


def label_obstacles(cells: Cells, connectivity: int = 4) -> tuple[Labels, int]:
    """Return the labels of the connected obstacles, from 1 (0 where free), and their number."""
    neighbours = scipy.ndimage.generate_binary_structure(2, 1 if connectivity == 4 else 2)
    labels, count = scipy.ndimage.label(cells, structure=neighbours)
    return np.asarray(labels, dtype=np.int32), int(count)


def obstacles_near(way: NDArray[np.float64], labels: Labels) -> list[int]:
    """Return the numbers of the obstacles, the nearest to the path first.

    Args:
        way: ``(n, 2)`` x and y in cells.
        labels: ``(rows, cols)`` numbers, 0 where free.
    """
    free = np.ones(labels.shape, dtype=np.bool_)
    cols, rows = (np.clip(np.rint(way[:, axis]).astype(int), 0, labels.shape[1 - axis] - 1) for axis in (0, 1))
    free[rows, cols] = False
    distances = scipy.ndimage.distance_transform_edt(free)
    numbers = np.unique(labels[labels > 0])
    nearest = np.asarray(scipy.ndimage.minimum(distances, labels, numbers))
    return [int(number) for number in numbers[np.argsort(nearest, kind="stable")]]


def draw_changes(
    count: int, settings: MutationSettings, rng: np.random.Generator, probabilities: Mapping[str, float] | None = None
) -> Changes:
    """Return some of ``count`` obstacles with an operator for each; a map without obstacles only gets new ones.

    An operator that samples a new map is the only one.

    Args:
        count: Number of obstacles.
        settings: Options of mutation.
        rng: Source of all randomness.
        probabilities: Of the operators, by name; those of ``settings`` if None.
    """
    changes = int(rng.integers(*settings.shapes_per_map, endpoint=True))
    if count == 0:
        return [(0, "add")] * changes
    chosen = rng.choice(count, size=min(changes, count), replace=False) + 1
    names, chances = zip(*(probabilities or settings.probabilities).items(), strict=True)
    operators = rng.choice(len(names), size=len(chosen), p=chances)
    drawn = [(int(obstacle), names[operator]) for obstacle, operator in zip(chosen, operators, strict=True)]
    return next(([one] for one in drawn if OPERATORS.get(one[1]).anew), drawn)


class MapMutation(Mutation):  # type: ignore[misc]
    """A :class:`Mutator` as a pymoo operator; an individual is mutated with ``settings.probability``.

    Args:
        mutator: Changes the maps.
        role_of: Returns the rank of a map's score in its set, from the set and the map's place in it. If None,
            operators are selected with their configured probabilities, not by their credit.

    Attributes:
        credit: Credit of the operators.
        trials: Mutations since the last call of :meth:`credit_trials`.
    """

    def __init__(self, mutator: Mutator, role_of: RoleOf | None = None) -> None:
        super().__init__(prob=1.0)
        self.mutator = mutator
        self.role_of = role_of
        self.credit = Credit()
        self.trials: list[Trial] = []

    def _do(self, _problem: Any, X: Column, *_: Any, random_state: np.random.Generator, **__: Any) -> Column:
        mates = [one.genome for map_set in X[:, 0] for one in map_set if one.genome is not None]
        # p_m is applied here and not by pymoo, which would mutate all individuals and discard most of the work.
        hit = random_state.random(len(X)) < self.mutator.settings.probability
        return as_column(
            [
                self._mutated(map_set, random_state, mates) if mutated else map_set
                for map_set, mutated in zip(X[:, 0], hit, strict=True)
            ]
        )

    def credit_trials(self, gain: Callable[[Trial], float]) -> None:
        """Add the mutations since the last call to the credit of their operators.

        Args:
            gain: Returns by how much a mutation improved the fitness of its set.
        """
        for trial in self.trials:
            self.credit.add(trial, gain(trial))
        self.trials = []

    def _mutated(self, map_set: MapSet, rng: np.random.Generator, mates: Sequence[Genome]) -> MapSet:
        """Return the set with all its maps mutated, or with one of them."""
        if self.mutator.settings.maps == "all":
            return MapSet(tuple(self.mutator.vary(scenario, rng, mates=mates)[0] for scenario in map_set))
        roles = [self.role_of(map_set, place) if self.role_of else 0 for place in range(len(map_set))]
        place = self.draw_place(roles, rng)
        return self.note(self.mutated_in(map_set, place, roles[place], rng, mates))

    def draw_place(self, roles: Sequence[int], rng: np.random.Generator) -> int:
        """Return the place of one of some roles, selected in proportion to their credit if there is credit."""
        if self.role_of is None:
            return int(rng.integers(len(roles)))
        credit = np.array([self.credit.of(role) for role in roles])
        return int(rng.choice(len(roles), p=credit / credit.sum()))

    def mutated_in(
        self,
        map_set: MapSet,
        place: int,
        role: int,
        rng: np.random.Generator,
        mates: Sequence[Genome],
        before: MapSet | None = None,
    ) -> Trial:
        """Return a mutation of the map at a place.

        Args:
            map_set: The set.
            place: Place of the map.
            role: Its role, which has the credit of the operators.
            rng: Source of all randomness.
            mates: Genomes of other maps, for crossover.
            before: The set that the mutated one is compared with; ``map_set`` if None.
        """
        configured = self.mutator.probabilities(map_set[place])
        chances = configured if self.role_of is None else self.credit.chances(configured, role)
        varied, names = self.mutator.vary(map_set[place], rng, chances, mates)
        return Trial(before or map_set, map_set.with_map(place, varied), role, names)

    def note(self, trial: Trial) -> MapSet:
        """Keep a mutation for :meth:`credit_trials`, and return the mutated set."""
        if self.role_of is not None:
            self.trials.append(trial)
        return trial.after
