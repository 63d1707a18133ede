"""Whole runs against Gazebo Fortress: the recorded ones are re-run with our plants, and compared.

The recordings themselves hold two controls: another seed on the same plant, and a start that is shifted by 0.1 mm.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from evolution.driving import ControllerSpec, DriveSettings, Job, JobPlan, RunResult
from evolution.validation.measures import Cases, Measure
from evolution.validation.recorded import read_arrays, read_json
from gym_mapbench.errors import MapFormatError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.plant import PlantName
from gym_mapbench.world.scenario import Pose, Scenario

Drive = Callable[[Sequence[Job]], list[RunResult]]

RESOLUTION, TIME_LIMIT = 0.05, 150.0
ROOTS = {"none": (0,), "nominal": (0, 1, 2)}
"""Root seeds of the recorded runs, by noise."""

OTHER_SEED = 3
"""Distance of two root seeds that are compared in the control ``other_seed``."""


class RunKey(NamedTuple):
    """Identity of a recorded run within its variant."""

    root: int
    map: str
    controller: str


@dataclass(frozen=True)
class RunEnd:
    """How a run ended.

    Args:
        outcome: Outcome.
        time_s: Simulated seconds until the end.
    """

    outcome: str
    time_s: float

    @property
    def rank_time(self) -> float:
        """The time by which controllers are ranked; failed runs come last."""
        return self.time_s if self.outcome == "goal" else math.inf


Runs = Mapping[RunKey, RunEnd]


@dataclass(frozen=True)
class World:
    """The world in which recorded runs are re-run.

    Args:
        plant: The plant.
        noise: Name of the noise.
        robot: Name of the robot.
        recorded: What its runs are compared with: the first word of a variant's name.
    """

    plant: PlantName
    noise: str
    robot: str = "turtlebot3_waffle"
    recorded: str = "fort"

    @property
    def key(self) -> str:
        """Beginning of the names of its measures."""
        return f"runs_{self.plant}_{self.noise}" + ("" if self.recorded == "fort" else "_waffle")

    @property
    def settings(self) -> DriveSettings:
        """Options of its runs: those of the recording, but for the plant."""
        environment = {
            "robot": self.robot,
            "time_limit": TIME_LIMIT,
            "collision_ends_episode": False,
            "noise": self.noise,
            "plant": self.plant,
        }
        return DriveSettings.from_mapping({"navigation": "fair", "environment": environment}, "recorded runs")


WORLDS = (
    World("ideal", "none"),
    World("fortress", "none"),
    World("ideal", "nominal"),
    World("fortress", "nominal"),
    World("fortress", "none", "turtlebot3_waffle_gz", "fortwaffle"),
)


class PlantRuns:
    """Recorded whole runs: ``closed_loop.json`` and ``closed_loop_maps.npz`` of a directory.

    Args:
        directory: Path of the directory.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)

    def __bool__(self) -> bool:
        return (self.directory / "closed_loop.json").exists()

    def of(self, plant: str, noise: str) -> dict[RunKey, RunEnd]:
        """Return the recorded runs of a plant with a noise."""
        return {key: end for name, key, end in self._ends if name == f"{plant}:{noise}"}

    def scenario(self, name: str) -> Scenario:
        """Return a recorded map with its task."""
        fields = read_arrays(self.directory / "closed_loop_maps.npz", [f"{name}/occupancy", f"{name}/start_goal"])
        start, goal = fields[f"{name}/start_goal"]
        return Scenario(GridMap(fields[f"{name}/occupancy"], RESOLUTION), Pose(*start), Pose(*goal), name)

    def jobs(self, world: World) -> dict[RunKey, Job]:
        """Return the jobs that repeat the recorded runs in a world."""
        keys = [key for key in self.of(world.recorded, world.noise) if key.root in ROOTS[world.noise]]
        scenarios = {name: self.scenario(name) for name in dict.fromkeys(key.map for key in keys)}
        controllers = tuple(dict.fromkeys(key.controller for key in keys))
        specs = tuple(ControllerSpec(name=name) for name in controllers)
        plans = {root: JobPlan(specs, world.settings, root) for root in dict.fromkeys(key.root for key in keys)}
        return {key: plans[key.root].job(scenarios[key.map], controllers.index(key.controller), 0) for key in keys}

    @cached_property
    def _ends(self) -> list[tuple[str, RunKey, RunEnd]]:
        """Return plant and noise, identity and end of all runs.

        Raises:
            MapFormatError: If the file is unreadable or a run lacks a field.
        """
        path = self.directory / "closed_loop.json"
        records = read_json(path, dict).get("runs", [])
        try:
            return [_end(record) for record in records]
        except (KeyError, TypeError, ValueError) as error:
            raise MapFormatError(f"{path}: not a table of runs ({error})") from None


def _end(record: Mapping[str, Any]) -> tuple[str, RunKey, RunEnd]:
    variant, _, root = record["variant"].rpartition(":")
    key = RunKey(int(root), record["map"], record["controller"])
    return variant, key, RunEnd(record["outcome"], float(record["time_s"]))


def plant_run_measures(recorded: PlantRuns, drive: Drive) -> list[Measure]:
    """Compare whole runs: each of our worlds with Fortress, and the recorded controls.

    Args:
        recorded: The recorded runs.
        drive: Returns the results of jobs in their order.
    """
    jobs = {(world, key): job for world in WORLDS for key, job in recorded.jobs(world).items()}
    ends = [RunEnd(result.outcome, result.time_s) for result in drive(tuple(jobs.values()))]
    driven = dict(zip(jobs, ends, strict=True))
    measures = []
    for world in WORLDS:
        ours = {key: end for (where, key), end in driven.items() if where == world}
        measures += agreement(world.key, ours, recorded.of(world.recorded, world.noise))
    return [*measures, *_controls(recorded)]


def _controls(recorded: PlantRuns) -> Iterator[Measure]:
    """Yield the agreement of recorded runs of one plant: a start shifted by 0.1 mm, and another seed."""
    yield from agreement("control_none_start_shifted", recorded.of("ours", "none"), recorded.of("eps", "none"))
    seeds = recorded.of("ours", "nominal")
    others = {key._replace(root=key.root - OTHER_SEED): end for key, end in seeds.items()}
    yield from agreement("control_nominal_other_seed", seeds, others)


def agreement(name: str, ours: Runs, theirs: Runs) -> list[Measure]:
    """Compare runs: outcomes, time ratios (theirs to ours) where both reach the goal, and ranks of the controllers.

    Args:
        name: Beginning of the names of the measures.
        ours: Runs.
        theirs: Runs; those without a counterpart are left out.
    """
    both = {key: (end, theirs[key]) for key, end in ours.items() if key in theirs}
    outcomes, ratios = Cases(f"{name}_outcomes_equal", ""), Cases(f"{name}_time_ratio_median", "")
    for key, (one, other) in both.items():
        outcomes.add(float(one.outcome != other.outcome), f"{key.map} {key.controller} seed {key.root}")
        if one.outcome == other.outcome == "goal":
            ratios.add(other.time_s / one.time_s, f"{key.map} {key.controller} seed {key.root}")
    percentiles = [ratios.percentile(share, f"{name}_time_ratio_p{share}", "") for share in (5, 95)]
    return [outcomes.agreement(), ratios.median(), *percentiles, _ranks_kept(f"{name}_ranks_kept", both)]


def _ranks_kept(name: str, both: Mapping[RunKey, tuple[RunEnd, RunEnd]]) -> Measure:
    """Return the share of maps and seeds on which the controllers have the same order by time."""
    groups: dict[tuple[int, str], list[tuple[RunEnd, RunEnd]]] = {}
    for key, ends in both.items():
        groups.setdefault((key.root, key.map), []).append(ends)
    cases = Cases(name, "")
    for (root, where), pairs in groups.items():
        ours, theirs = zip(*pairs, strict=True)
        cases.add(float(_order(ours) != _order(theirs)), f"{where} seed {root}")
    return cases.agreement()


def _order(ends: Sequence[RunEnd]) -> list[int]:
    """Return the numbers of runs from the fastest to the slowest."""
    return sorted(range(len(ends)), key=lambda number: ends[number].rank_time)
