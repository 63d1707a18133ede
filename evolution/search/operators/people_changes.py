"""Mutation of the people on a map: add, remove, move a waypoint, change speed or phase. The walls stay."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from gym_mapbench.generator import PeopleSettings, draw_person, fits
from gym_mapbench.world.bodies import Body
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.scenario import Scenario

MAX_TRIES = 20
"""Tries of a mutation; if no changed person fits, the people stay."""
STEP = 0.5
"""Standard deviation of a step of a waypoint or a centre, m."""
PACE_STEP = 0.2
"""Standard deviation of a step of the speed, m/s, and of the phase."""

People = tuple[Body, ...]


def change_people(
    scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator
) -> tuple[Scenario, tuple[str, ...]]:
    """Return the scenario with one person changed, added or removed, and the name of the operator.

    Args:
        scenario: A map with at least one person.
        settings: How people walk; ``count`` is the number of people of a new map.
        rng: Source of all randomness.
    """
    for _ in range(MAX_TRIES):
        name = str(rng.choice(list(PEOPLE_OPERATORS)))
        changed = PEOPLE_OPERATORS[name](scenario, settings, rng)
        if changed is not None:
            return replace(scenario, bodies=changed), (name,)
    return scenario, ()


def add_person(scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator) -> People | None:
    """Add a sampled person; nothing if there are twice as many as on a new map."""
    if len(scenario.bodies) >= 2 * settings.count:
        return None
    person = draw_person(scenario, scenario.bodies, settings, rng)
    return None if person is None else (*scenario.bodies, person)


def remove_person(scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator) -> People | None:
    """Remove a person; nothing if there is only one."""
    if len(scenario.bodies) < 2:
        return None
    place = int(rng.integers(len(scenario.bodies)))
    return scenario.bodies[:place] + scenario.bodies[place + 1 :]


def move_waypoint(scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator) -> People | None:
    """Move a waypoint of a walk, or the centre of a wander, by a normal step."""

    def moved(options: dict[str, Any]) -> dict[str, Any]:
        if "centre" in options:
            return {**options, "centre": _stepped(options["centre"], rng)}
        points = list(options["waypoints"])
        place = int(rng.integers(len(points)))
        points[place] = _stepped(points[place], rng)
        return {**options, "waypoints": points}

    return _with_options(scenario, rng, moved)


def change_speed(scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator) -> People | None:
    """Change a person's speed by a normal step, within the range of new people."""

    def faster(options: dict[str, Any]) -> dict[str, Any]:
        speed = round(float(np.clip(options["speed"] + rng.normal(0.0, PACE_STEP), *settings.speed)), 3)
        return {**options, "speed": float(np.clip(speed, *settings.speed))}

    return _with_options(scenario, rng, faster)


def change_phase(scenario: Scenario, settings: PeopleSettings, rng: np.random.Generator) -> People | None:
    """Change by a normal step how much of the course lies behind a person at time 0."""
    return _with_options(
        scenario,
        rng,
        lambda options: {**options, "phase": round((options["phase"] + rng.normal(0.0, PACE_STEP)) % 1.0, 3) % 1.0},
    )


PEOPLE_OPERATORS: dict[str, Callable[[Scenario, PeopleSettings, np.random.Generator], People | None]] = {
    function.__name__: function for function in (add_person, remove_person, move_waypoint, change_speed, change_phase)
}
"""The operators on people by name, all equally likely."""


def _with_options(
    scenario: Scenario, rng: np.random.Generator, change: Callable[[dict[str, Any]], dict[str, Any]]
) -> People | None:
    """Return the people with the options of one of them changed; None if the changed person does not fit."""
    people = list(scenario.bodies)
    place = int(rng.integers(len(people)))
    before = people.pop(place)
    motion = MotionSpec(name=before.motion.name, options=change(dict(before.motion.options)))
    person = before.replace(motion=motion)
    if person == before or not fits(scenario, person, tuple(people)):
        return None
    return (*people[:place], person, *people[place:])


def _stepped(point: Any, rng: np.random.Generator) -> list[float]:
    """Return a point moved by a normal step along each axis, m."""
    return [round(float(value), 3) for value in np.asarray(point) + rng.normal(0.0, STEP, 2)]
