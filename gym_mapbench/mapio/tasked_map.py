"""TaskedMap: what every reader returns and every writer takes: a named map with the tasks known for it."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from typing import NamedTuple

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio.source import MAX_MAP_CELLS
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.genome import Genome
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

GENES = "genes.json"
"""Name of the file with the genomes of maps, beside maps in formats that hold cells only."""


class Task(NamedTuple):
    """Start, goal and moving bodies; ``name`` is that of the scenario."""

    start: Pose
    goal: Pose
    name: str
    bodies: tuple[Body, ...] = ()


@dataclass(frozen=True)
class TaskedMap:
    """A map and its tasks, which may be none.

    Args:
        name: Name of the map, usually the stem of its file.
        grid: The map.
        tasks: Its tasks, in the file's order.
        genome: The genes that it was built from; None if it has none.
    """

    name: str
    grid: GridMap
    tasks: tuple[Task, ...] = ()
    genome: Genome | None = None

    def __post_init__(self) -> None:
        for what, kind in (("name", str), ("grid", GridMap)):
            if not isinstance(getattr(self, what), kind):
                raise ConfigError(f"{what} of a map: expected {kind.__name__}, got {getattr(self, what)!r:.80}")

    @property
    def names(self) -> list[str]:
        """Names of the tasks; of the map if it has none."""
        return [task.name for task in self.tasks] or [self.name]

    def renamed(self, name: str) -> TaskedMap:
        """Return the same map and tasks under another name."""
        named = name_tasks(name, [(task.start, task.goal) for task in self.tasks])
        tasks = zip(named, self.tasks, strict=True)
        return replace(self, name=name, tasks=tuple(task._replace(bodies=old.bodies) for task, old in tasks))

    def split(self, parts: int) -> TaskedMap:
        """Return the same walls and tasks with each cell split into ``parts`` x ``parts``; genes are of whole cells.

        Raises:
            ConfigError: If these are more cells than a file may have.
        """
        if parts == 1:
            return self
        cells = self.grid.occupancy.size * parts**2
        if cells > MAX_MAP_CELLS:
            raise ConfigError(f"{self.name} split by {parts}: expected at most {MAX_MAP_CELLS} cells, got {cells}")
        return replace(self, grid=self.grid.split(parts), genome=None)

    def scenarios(self) -> list[Scenario]:
        """Return one scenario per task; all share this map.

        Raises:
            ConfigError: If a start or goal is off the map or occupied; the message names the task.
        """
        return [self._scenario(task) for task in self.tasks]

    def _scenario(self, task: Task) -> Scenario:
        try:
            return Scenario(self.grid, task.start, task.goal, task.name, task.bodies, self.genome)
        except ConfigError as error:
            raise ConfigError(f"task {task.name!r}: {error}") from None


def name_tasks(name: str, poses: Sequence[tuple[Pose, Pose]]) -> tuple[Task, ...]:
    """Name the tasks of one map: ``name`` if there is one, ``name_0``, ``name_1``... if there are more."""
    if len(poses) == 1:
        return (Task(*poses[0], name),)
    return tuple(Task(start, goal, f"{name}_{index}") for index, (start, goal) in enumerate(poses))


def refuse_bodies(form: str, tasks: Iterable[Task | Scenario]) -> None:
    """Refuse to write tasks among moving bodies in a format that cannot hold them.

    Args:
        form: Name of the format.
        tasks: What is to be written.

    Raises:
        ConfigError: Naming the first task that has bodies.
    """
    for task in tasks:
        if task.bodies:
            raise ConfigError(
                f"{form}: cannot hold the moving bodies of {task.name!r}; a map set (.json) and map_server can"
            )


def genome_files(genomes: Iterable[tuple[str, Genome | None]]) -> dict[str, str | bytes]:
    """Return the file :data:`GENES` with the genomes of maps by name; nothing if no map has one."""
    found = {name: genome.model_dump(mode="json") for name, genome in genomes if genome is not None}
    return {GENES: json.dumps(found, indent=1) + "\n"} if found else {}


def group_scenarios(scenarios: Iterable[Scenario]) -> list[TaskedMap]:
    """Gather neighbouring scenarios on the same map; the order is kept."""
    groups = [list(group) for _, group in groupby(scenarios, key=lambda scenario: scenario.map.digest)]
    return [
        TaskedMap(first.name, first.map, tuple(Task(s.start, s.goal, s.name, s.bodies) for s in group), first.genome)
        for first, group in ((group[0], group) for group in groups)
    ]
