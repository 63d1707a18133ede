"""The plant against Gazebo Fortress: recorded commands go in, our poses are compared with the recorded ones.

Source of the recordings: the physics libraries of Gazebo Fortress (README of their directory).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from evolution.validation.measures import Cases, Measure
from evolution.validation.recorded import read_arrays
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.plant import PLANTS, PlantName
from gym_mapbench.world.robot import RobotSpec, make_robot
from gym_mapbench.world.scenario import Pose, wrap_angle
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.world import World

ROBOTS = {"bundle": "turtlebot3_waffle", "waffle": "turtlebot3_waffle_gz"}
"""Robots by the first word of their files."""

COMMAND_HZ, PHYSICS_HZ = 20.0, 100.0
FIELD = 100.0
"""Half the side of the map without walls on which sequences without contact run, m."""

X, Y, YAW = 0, 1, 5
"""Columns of recorded states."""

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Sequence:
    """Recorded commands, and the poses that they led to.

    Args:
        name: Its name in the recording.
        start: Pose at time 0.
        commands: ``(n, 2)`` m/s, rad/s at 20 Hz.
        poses: ``(n, 3)`` x, y (m), yaw (rad) after 50 ms of each command.
        wall: x0, x1, y0, y1 of a wall, m; None for a map without walls.
    """

    name: str
    start: Pose
    commands: Floats
    poses: Floats
    wall: Floats | None = None


class PlantOracle:
    """A directory of recorded sequences.

    Args:
        directory: Path of the directory.
    """

    def __init__(self, directory: str | Path) -> None:
        self.directory = Path(directory)

    @staticmethod
    def is_in(directory: str | Path) -> bool:
        """Whether a directory holds recordings of a plant."""
        return any(_files(Path(directory), robot) for robot in ROBOTS)

    def sequences(self, robot: str) -> list[Sequence]:
        """Return the sequences without contact of a robot: ``bundle`` or ``waffle``.

        Raises:
            MapFormatError: If a file is unreadable or lacks a field.
        """
        return [one for path in _files(self.directory, robot) for one in _sequences(path)]

    def contacts(self) -> list[Sequence]:
        """Return the sequences of the exported robot with a wall; empty where none were recorded.

        Raises:
            MapFormatError: If the file is unreadable or lacks a field.
        """
        path = self.directory / "contacts.npz"
        return list(_contacts(path)) if path.exists() else []


def plant_measures(oracle: PlantOracle) -> list[Measure]:
    """Compare positions and headings: both robots without contact, each plant; the exported robot at walls."""
    measures = [measure for robot in ROBOTS for plant in PLANTS for measure in _open_loop(oracle, robot, plant)]
    return [*measures, *(measure for sequence in oracle.contacts() for measure in _contact(sequence))]


def _open_loop(oracle: PlantOracle, robot: str, plant: PlantName) -> list[Measure]:
    """Return the mean over sequences of the rms errors of position (mm) and heading (degrees)."""
    of = "" if robot == "bundle" else f"_{robot}"
    aimed = plant == "fortress" and robot == "bundle"  # the Waffle's wheels slip, which no plant of ours does
    position = Cases(f"plant_{plant}_position_rms_mm{of}", "<= 0.5" if aimed else "")
    heading = Cases(f"plant_{plant}_heading_rms_deg{of}", "<= 0.01" if aimed else "")
    for sequence in oracle.sequences(robot):
        error = replay(sequence, make_robot(ROBOTS[robot]), plant) - sequence.poses
        position.add(1e3 * _rms(np.hypot(error[:, 0], error[:, 1])), sequence.name)
        heading.add(math.degrees(_rms(_wrapped(error[:, 2]))), sequence.name)
    return [position.mean(), heading.mean()]


def _contact(sequence: Sequence) -> list[Measure]:
    """Return the largest differences between the two robots during a sequence with a wall: position, mm; heading."""
    error = replay(sequence, make_robot(ROBOTS["bundle"]), "fortress") - sequence.poses
    position, heading = 1e3 * np.hypot(error[:, 0], error[:, 1]), np.degrees(np.abs(_wrapped(error[:, 2])))
    return [
        Measure(f"contact_{sequence.name}_mm", float(position.max()), len(error)),
        Measure(f"contact_{sequence.name}_deg", float(heading.max()), len(error)),
    ]


def replay(sequence: Sequence, robot: RobotSpec, plant: PlantName) -> Floats:
    """Return the poses ``(n, 3)`` of our robot after each command."""
    simulation = Simulation(World(_map_of(sequence), (), PHYSICS_HZ), robot, sequence.start, plant=plant, rests=True)
    poses = np.empty_like(sequence.poses)
    for row, (v, w) in enumerate(sequence.commands.tolist()):
        simulation.advance(v, w, round(PHYSICS_HZ / COMMAND_HZ))
        poses[row] = simulation.pose
    return poses


def _map_of(sequence: Sequence) -> GridMap:
    if sequence.wall is None:
        return GridMap(np.zeros((1, 1), np.bool_), 2 * FIELD, (-FIELD, -FIELD))
    resolution, half = 0.05, 100
    cells = np.zeros((2 * half, 2 * half), np.bool_)
    left, right, bottom, top = np.round(sequence.wall / resolution).astype(int) + half
    cells[bottom:top, left:right] = True
    return GridMap(cells, resolution, (-half * resolution, -half * resolution))


def _files(directory: Path, robot: str) -> list[Path]:
    return sorted(directory.glob(f"{robot}_*.npz"))


def _fields(path: Path, fields: tuple[str, ...]) -> Iterator[tuple[str, list[NDArray[Any]]]]:
    """Yield the name of every sequence of a file, and its fields."""
    names = read_arrays(path, ["names"])["names"].tolist()
    arrays = read_arrays(path, [f"{name}/{field}" for name in names for field in fields])
    for name in names:
        yield name, [arrays[f"{name}/{field}"] for field in fields]


def _sequences(path: Path) -> Iterator[Sequence]:
    for name, (start, commands, states) in _fields(path, ("start", "commands", "states")):
        yield Sequence(name, Pose(*start[[X, Y, YAW]]), commands, states[:, [X, Y, YAW]])


def _contacts(path: Path) -> Iterator[Sequence]:
    for name, (start, commands, states, wall) in _fields(path, ("start_xyyaw", "commands", "bundle", "wall_x0x1y0y1")):
        yield Sequence(name, Pose(*start), commands, states[:, [X, Y, YAW]], wall)


def _rms(values: NDArray[Any]) -> float:
    return float(np.sqrt(np.mean(np.square(values))))


def _wrapped(angles: Floats) -> Floats:
    return np.array([wrap_angle(angle) for angle in angles.tolist()])
