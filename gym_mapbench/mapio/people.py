"""``NAME_people.yaml``: the people on a map, as a list of bodies, or as a file of HuNavSim or Arena.

::

    - {shape: {radius: 0.25}, motion: {name: scripted, options: {waypoints: [[1, 1], [4, 1]], speed: 0.8}}}

Source of the second form: the agents file of HuNavSim (Perez-Higueras et al., HuNavSim: A ROS 2 Human Navigation
Simulator for Benchmarking Human-Aware Robot Navigation, 2023). An agent with ``cyclic_goals`` walks from ``init_pose``
along its goals in a loop, at ``max_vel``. Source of the third form: scenarios of Arena (Kaestner et al., Arena-Rosnav
2.0, 2023), YAML or JSON. An agent of ``pedsim_agents`` or ``obstacles.dynamic`` walks from ``pos`` along its
``waypoints`` in a loop, at ``vmax``.

An agent of HuNavSim whose ``behavior`` is 1, regular, walks by social forces and sees the robot. An agent of Arena with
a ``force_factor_robot`` walks by social forces, and sees the robot if the factor is above 0. All others are scripted.
Both simulators have factors of the forces; here they are those of :mod:`gym_mapbench.kernels.social_force`.
"""

from __future__ import annotations

import os
from collections.abc import Hashable, Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml

from gym_mapbench.errors import ConfigError, MapFormatError
from gym_mapbench.mapio.source import as_number, read_yaml_file, short
from gym_mapbench.trust import refuse_code
from gym_mapbench.world.bodies import Body

HUNAV = "hunav_loader"
ARENA = "pedsim_agents", "obstacles"
REGULAR = 1
"""HuNavSim's ``behavior`` of agents to whom the robot is one more person."""
ROBOT_FACTOR = "force_factor_robot"
"""Arena's factor of the force by which an agent avoids the robot."""
LOOP = 0
"""Arena's ``waypoint_mode`` of agents that walk their waypoints in order, and from the last one to the first."""


def find_people(map_path: Path) -> Path | None:
    """Return ``NAME_people.yaml`` beside ``NAME.yaml``; None if there is none."""
    file = map_path.with_name(f"{map_path.stem}_people.yaml")
    return file if os.path.lexists(file) else None


def read_people(path: Path) -> tuple[Body, ...]:
    """Read the people of a map.

    Raises:
        MapFormatError: If the file holds anything else.
        UntrustedError: If it names code.
    """
    document = read_yaml_file(path)
    refuse_code(document, path)
    if isinstance(document, Mapping) and HUNAV in document:
        entries = _hunav_bodies(document[HUNAV], str(path))
    elif isinstance(document, Mapping) and any(key in document for key in ARENA):
        entries = _arena_bodies(document, str(path))
    elif isinstance(document, list):
        entries = document
    else:
        raise MapFormatError(
            f"{path}: expected a list of bodies, or one of the keys {HUNAV}, {', '.join(ARENA)}, got {short(document)}"
        )
    try:
        return tuple(Body.from_mapping(entry, f"{path}: person {index}") for index, entry in enumerate(entries))
    except ConfigError as error:
        raise MapFormatError(str(error)) from None


def people_yaml(bodies: Iterable[Body]) -> str:
    """Return the text of ``NAME_people.yaml``, from which :func:`read_people` returns equal bodies."""
    return yaml.safe_dump([body.model_dump(mode="json") for body in bodies], sort_keys=False, default_flow_style=None)


def _hunav_bodies(node: object, where: str) -> list[dict[str, Any]]:
    """Return the agents of HuNavSim as bodies."""
    parameters = _entry(node, "ros__parameters", where)
    names = _entry(parameters, "agents", where)
    if not isinstance(names, list):
        raise MapFormatError(f"{where}: agents: expected a list of names, got {short(names)}")
    return [_hunav_body(_entry(parameters, name, where), f"{where}: {name}") for name in names]


def _hunav_body(agent: Any, where: str) -> dict[str, Any]:
    if _entry(agent, "cyclic_goals", where) is not True:
        raise MapFormatError(f"{where}: expected cyclic_goals true; nobody here stops at a last goal")
    goals = _entry(agent, "goals", where)
    if not isinstance(goals, list):
        raise MapFormatError(f"{where}: goals: expected a list of names, got {short(goals)}")
    points = [_entry(agent, name, where) for name in ("init_pose", *goals)]
    waypoints = [[as_number(f"{where}: {axis}", _entry(point, axis, where)) for axis in "xy"] for point in points]
    speed = as_number(f"{where}: max_vel", _entry(agent, "max_vel", where))
    sees_robot = True if _behavior(agent) == REGULAR else None
    radius = as_number(f"{where}: radius", _entry(agent, "radius", where))
    return {"shape": {"radius": radius}, "motion": _loop(waypoints, speed, sees_robot)}


def _behavior(agent: Mapping[str, Any]) -> object:
    """Return the kind of behaviour, which newer files of HuNavSim put into a mapping; None if there is none."""
    behavior = agent.get("behavior")
    return behavior.get("type") if isinstance(behavior, Mapping) else behavior


def _loop(waypoints: list[list[float]], speed: float, sees_robot: bool | None) -> dict[str, Any]:
    """Return a motion along waypoints in a loop: by social forces, or scripted where ``sees_robot`` is None."""
    options = {"waypoints": waypoints, "speed": speed, "loop": True}
    if sees_robot is None:
        return {"name": "scripted", "options": options}
    return {"name": "social_force", "options": {**options, "sees_robot": sees_robot}}


def _arena_bodies(document: Mapping[object, Any], where: str) -> list[dict[str, Any]]:
    """Return the agents of a scenario of Arena as bodies."""
    first, second = ARENA
    agents = document[first] if first in document else _entry(document[second], "dynamic", f"{where}: {second}")
    if not isinstance(agents, list):
        raise MapFormatError(f"{where}: expected a list of agents, got {short(agents)}")
    return [_arena_body(agent, f"{where}: agent {number}") for number, agent in enumerate(agents)]


def _arena_body(agent: Any, where: str) -> dict[str, Any]:
    if (mode := _entry(agent, "waypoint_mode", where)) != LOOP:
        raise MapFormatError(f"{where}: expected waypoint_mode {LOOP} (a loop), got {short(mode)}")
    goals = _entry(agent, "waypoints", where)
    if not isinstance(goals, list) or not goals:
        raise MapFormatError(f"{where}: waypoints: expected a list of points, got {short(goals)}")
    waypoints = [_arena_point(point, where) for point in (_entry(agent, "pos", where), *goals)]
    speed = as_number(f"{where}: vmax", _entry(agent, "vmax", where))
    sees_robot = as_number(f"{where}: {ROBOT_FACTOR}", agent[ROBOT_FACTOR]) > 0 if ROBOT_FACTOR in agent else None
    return {"motion": _loop(waypoints, speed, sees_robot)}


def _arena_point(point: object, where: str) -> list[float]:
    """Return ``[x, y]`` of a point with or without an angle."""
    if not isinstance(point, list) or len(point) not in (2, 3):
        raise MapFormatError(f"{where}: expected points [x, y] or [x, y, yaw], got {short(point)}")
    return [as_number(f"{where}: {axis}", value) for axis, value in zip("xy", point[:2], strict=True)]


def _entry(values: object, key: object, where: str) -> Any:
    if not isinstance(values, Mapping) or not isinstance(key, Hashable) or key not in values:
        raise MapFormatError(f"{where}: expected the key {short(key)}, got {short(values)}")
    return values[key]
