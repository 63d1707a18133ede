"""``NAME_poses.yaml`` and ``NAME_waypoints.yaml``: the tasks beside a map, as the thesis' framework writes them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from gym_mapbench.errors import MapBenchError, MapFormatError
from gym_mapbench.mapio.source import as_numbers, read_yaml_file, short
from gym_mapbench.world.scenario import Pose

MOST_YAW = 6.3
"""Largest heading of a task that a user writes, rad: a turn. A larger number is meant in degrees."""


def find_poses(map_path: Path) -> Path | None:
    """Return the poses of ``NAME.yaml``: ``NAME_poses.yaml`` beside it or in ``../params/``; None if there is none."""
    name = f"{map_path.stem}_poses.yaml"
    places = (map_path.with_name(name), map_path.absolute().parent.parent / "params" / name)
    return next((file for file in places if os.path.lexists(file)), None)


def read_poses(path: Path) -> tuple[Pose, Pose]:
    """Read start and goal: the first two entries of a plain list ``- [x, y, yaw]`` (m, rad).

    Raises:
        MapFormatError: If the file holds anything else, or a yaw in degrees.
    """
    poses = read_yaml_file(path)
    if not isinstance(poses, list) or len(poses) < 2:
        raise MapFormatError(f"{path}: expected a list of [x, y, yaw], start first, then goal, got {short(poses)}")
    start, goal = (_read_pose(f"{path}: pose {index}", pose) for index, pose in enumerate(poses[:2]))
    return start, goal


def check_yaw(where: str, pose: Pose, raises: type[MapBenchError]) -> Pose:
    """Return a pose as it is; ``raises`` the error if its yaw is larger than a turn."""
    if abs(pose.yaw) > MOST_YAW:
        raise raises(f"{where}: expected a yaw of -{MOST_YAW} to {MOST_YAW} rad, got {pose.yaw:g}")
    return pose


def _read_pose(where: str, value: object) -> Pose:
    return check_yaw(where, Pose(*as_numbers(where, value, 3)), MapFormatError)


def poses_yaml(poses: Sequence[Pose]) -> str:
    """Return the text of ``NAME_poses.yaml``."""
    return "".join(f"- {_flow(pose)}\n" for pose in poses)


def waypoints_yaml(poses: Sequence[Pose]) -> str:
    """Return the text of ``NAME_waypoints.yaml``: one list of waypoints that visits the poses in order."""
    return f"- waypoints: [{', '.join(_flow(pose) for pose in poses)}]\n"


def _flow(pose: Pose) -> str:
    return f"[{', '.join(yaml_float(value) for value in pose)}]"


def yaml_float(value: float) -> str:
    """Write a float exactly; YAML 1.1 wants a dot in every one (``1.0e-07``, not ``1e-07``)."""
    text = repr(float(value))
    return text.replace("e", ".0e", 1) if "e" in text and "." not in text else text
