from __future__ import annotations

import numpy as np
import pytest

from gym_mapbench.metrics import ALWAYS, METRICS, Episode, Event, measure
from gym_mapbench.metrics.social_metrics import SOCIAL
from gym_mapbench.world.robot import ROBOTS
from tests.worlds import among, line

WAFFLE = ROBOTS["turtlebot3_waffle"]
PERIOD = 0.1
ALONE = among()
CROSSING = among(line((2.5, 0.8), (1.0, 0.8), 0.5))
"""A body of 0.2 m radius that comes towards the robot at (0.8, 0.8)."""


def standing(scenario, seconds=3.0, speed=0.0, events=()):
    """A robot at its start that stands, or is said to turn at a speed."""
    rows = round(seconds / PERIOD)
    trajectory = np.tile([*scenario.start, 0.0, speed], (rows + 1, 1))
    return Episode(
        scenario, "dwb", 0, "timeout", "", seconds, PERIOD, trajectory, np.zeros((rows, 2)), events=events, robot=WAFFLE
    )


def test_times_and_distances_of_a_body_that_comes_near():
    values = measure(standing(CROSSING))
    # The gap is 2.5 - 0.8 - 0.2 - 0.22 - 0.5 t until t = 3 s.
    gap = 1.7 - 0.2 - WAFFLE.radius
    assert values["min_distance_to_people"] == pytest.approx(gap - 1.5)
    assert values["personal_space_time"] == pytest.approx(3.0 - (gap - 1.2) / 0.5, abs=PERIOD)
    assert values["intimate_space_time"] == pytest.approx(3.0 - (gap - 0.45) / 0.5, abs=PERIOD)
    assert values["freezing_time"] == values["personal_space_time"]
    assert measure(standing(CROSSING, speed=0.2))["freezing_time"] == 0.0


def test_a_contact_while_the_robot_stands_is_the_other_s():
    contacts = (Event(0.5, "contact"), Event(1.0, "contact", "body"), Event(2.0, "contact", "wall and body"))
    stands, turns = (measure(standing(CROSSING, speed=speed, events=contacts)) for speed in (0.0, 0.3))
    names = ("n_collisions_with_people", "n_contacts_by_people", "n_collisions_with_walls")
    assert [stands[name] for name in names] == [0, 2, 2]
    assert [turns[name] for name in names] == [2, 0, 2]


def test_only_runs_among_bodies_have_them_unless_they_are_asked_for():
    names = {function.__name__ for function in SOCIAL}
    assert set(measure(standing(ALONE))) == set(ALWAYS) == set(METRICS.built_in) - names
    assert set(measure(standing(CROSSING))) == set(METRICS.built_in)
    asked = measure(standing(ALONE), ["personal_space_time", "min_distance_to_people"])
    assert (asked["personal_space_time"], asked["min_distance_to_people"]) == (0.0, 1000.0)
