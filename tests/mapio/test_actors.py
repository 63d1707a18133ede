"""People as actors of Gazebo: the exported trajectories are those of the simulation."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.errors import ConfigError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.mapio.actors import SPACING, TURN, round_of
from gym_mapbench.mapio.gazebo import export_gazebo, map_files
from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.scenario import Pose, Scenario
from tests.mapio.test_gazebo import OPTIONS, thesis_scenario

PATH = ((0.5, 1.0), (0.5, 3.0), (2.0, 3.0))


def open_room():
    """A room of 4 m by 4 m with a wall in one corner."""
    cells = np.zeros((80, 80), dtype=np.uint8)
    cells[-1, -1] = 1
    return Scenario(GridMap(cells), Pose(3.0, 1.0, 0.0), Pose(3.0, 1.8, 0.0), "room")


def body(name, **options):
    return Body(shape=Disc(radius=0.25), motion=MotionSpec(name=name, options=options))


def walker(speed=0.5, **options):
    return body("scripted", waypoints=[list(point) for point in PATH], speed=speed, **options)


@given(
    phase=st.floats(0.0, 0.999),
    loop=st.booleans(),
    speed=st.floats(0.3, 1.3),
    times=st.lists(st.floats(0.0, 60.0), min_size=1, max_size=20),
)
def test_actors_walk_as_the_people_do(phase, loop, speed, times):
    person = walker(speed, phase=phase, loop=loop)
    points = np.array(round_of(person))
    assert (np.diff(points[:, 0]) > 0).all()
    period, times = points[-1, 0], np.array(times)
    walked = person.motion.motion.at(times)[:, :2]
    interpolated = [np.interp(np.fmod(times, period), points[:, 0], points[:, axis]) for axis in (1, 2)]
    assert np.abs(np.stack(interpolated, axis=1) - walked).max() <= 2 * speed * TURN


def catmull_rom(points, times):
    """Return where gz-sim has an actor: on a Catmull-Rom spline through its waypoints, one unit for each."""
    places, following, before = points[:, 1:3], points[1:, 1:3], points[:-1, 1:3]
    assert (places[0] == places[-1]).all()
    beyond = np.concatenate([before[-1:], places, following[:1]])
    tangents = 0.5 * (beyond[2:] - beyond[:-2])
    leg = np.searchsorted(points[:, 0], times, side="right") - 1
    t = ((times - points[leg, 0]) / (points[leg + 1, 0] - points[leg, 0]))[:, None]
    here = (1 + 2 * t) * (1 - t) ** 2 * places[leg] + t**2 * (3 - 2 * t) * places[leg + 1]
    return here + t * (1 - t) ** 2 * tangents[leg] + t**2 * (t - 1) * tangents[leg + 1]


@given(phase=st.floats(0.0, 0.999), loop=st.booleans(), speed=st.floats(0.05, 3.0), ways=st.integers(2, 5))
def test_the_spline_of_gz_sim_through_the_waypoints_is_the_walk(phase, loop, speed, ways):
    waypoints = np.random.default_rng(ways).uniform(0.0, 5.0, (ways, 2)).tolist()
    person = body("scripted", waypoints=waypoints, speed=speed, phase=phase, loop=loop)
    points = np.array(round_of(person))
    assert points[:, 0] * 1000 == pytest.approx(np.rint(points[:, 0] * 1000), abs=1e-6)
    times = np.arange(0.0, points[-1, 0], 0.002)
    away = np.hypot(*(catmull_rom(points, times) - person.motion.motion.at(times)[:, :2]).T)
    assert away.max() <= SPACING / 3


@given(
    reach=st.floats(0.01, 3.0),
    speed=st.floats(0.05, 3.0),
    phase=st.floats(0.0, 0.999),
    seed=st.integers(0, 1000),
)
def test_the_spline_of_gz_sim_through_the_waypoints_is_the_wander(reach, speed, phase, seed):
    person = body("wander", centre=[2.0, 1.0], reach=reach, speed=speed, phase=phase, seed=seed)
    points, walk = np.array(round_of(person)), person.motion.motion
    assert points[-1, 0] == pytest.approx(walk.period, abs=6e-4)
    assert (np.diff(points[:, 0]) > 0).all()
    assert np.hypot(*np.diff(points[:, 1:3], axis=0).T).max() <= SPACING + 6e-4 * 3 * speed
    times = np.linspace(0.0, points[-1, 0], 5000, endpoint=False)
    away = np.hypot(*(catmull_rom(points, times) - walk.at(times)[:, :2]).T)
    assert away.max() <= 0.01


def test_a_wander_within_a_millimetre_stands():
    assert len(round_of(body("wander", centre=[2.0, 1.0], reach=1e-6, speed=3.0))) == 2


@pytest.mark.parametrize("end", [[1.0, 1.0], [1.001, 1.0]])
def test_a_person_who_stands_is_an_actor_who_stands(end):
    points = round_of(body("scripted", waypoints=[[1.0, 1.0], end], speed=0.5))
    assert points == ((0.0, 1.0, 1.0, 0.0), (1.0, 1.0, 1.0, 0.0))


def test_an_actor_turns_at_a_waypoint():
    points = round_of(walker(0.5))
    turns = [one for one in points if min(abs(one.time - corner) for corner in (4.0, 7.0, 10.0, 14.0)) < 0.006]
    assert [one.time for one in turns] == [3.995, 4.005, 6.995, 7.005, 9.995, 10.005, 13.995, 14.0]
    headings = {(one.time > 4.0) + (one.time > 7.0) + (one.time > 10.0): one.yaw for one in points[:-1]}
    assert headings == pytest.approx({0: np.pi / 2, 1: 0.0, 2: np.pi, 3: -np.pi / 2})
    assert points[0][1:] == (0.5, 1.0, pytest.approx(np.pi / 2))
    assert points[-1][1:3] == points[0][1:3]


def test_the_world_of_gz_sim_holds_one_actor_for_each_person_and_that_of_classic_none():
    scenario = replace(thesis_scenario(5, "map_0"), bodies=(walker(), walker(phase=0.5)))
    files = map_files(scenario, 0.5, ("classic", "gz"))
    classic, gz = (ElementTree.fromstring(files[f"worlds/map_0.{ending}"]) for ending in ("world", "sdf"))
    actors = gz.findall("world/actor")
    assert [actor.get("name") for actor in actors] == ["person_0", "person_1"]
    assert not classic.findall("world/actor")
    first = actors[1].find("script/trajectory/waypoint")
    expected = scenario.bodies[1].motion.motion.at(np.zeros(1))[0]
    pose = [float(value) for value in first.findtext("pose").split()]
    assert [pose[0], pose[1], pose[5]] == pytest.approx(expected.tolist(), abs=1e-4)


@pytest.mark.parametrize(
    "person",
    [
        body("line", start=[0.5, 1.0], end=[0.5, 3.0], speed=0.4),
        *(
            body("social_force", waypoints=[[0.5, 1.0], [0.5, 3.0]], speed=0.4, sees_robot=sees)
            for sees in (True, False)
        ),
    ],
)
def test_only_a_person_whose_walk_repeats_can_be_exported(tmp_path, person):
    scenario = replace(thesis_scenario(5, "map_0"), bodies=(walker(), person))
    words = rf"'map_0': body 1: expected the motion 'scripted' or 'wander', .* got '{person.motion.name}'"
    with pytest.raises(ConfigError, match=words):
        export_gazebo([scenario], tmp_path / "out", **OPTIONS)
    assert not list(tmp_path.iterdir())


def test_a_package_is_read_back_with_its_people(tmp_path):
    aside = body("scripted", waypoints=[[1.5, 0.4], [2.2, 0.4]], speed=1 / 3)
    wanders = body("wander", centre=[1.9, 2.0], reach=0.5, speed=0.4, seed=3)
    rooms = [replace(open_room(), bodies=(walker(), aside, wanders)), replace(open_room(), name="empty")]
    export_gazebo(rooms, tmp_path, **OPTIONS)
    assert {one.name: one.digest for one in load_scenarios(tmp_path)} == {one.name: one.digest for one in rooms}
    assert "| `maps/NAME_people.yaml` |" in (tmp_path / "README.md").read_text()


def test_a_map_does_not_have_the_name_of_a_file_of_people(tmp_path):
    rooms = [replace(open_room(), bodies=(walker(),)), replace(open_room(), name="room_people")]
    with pytest.raises(ConfigError, match="map 'room_people': expected another name"):
        export_gazebo(rooms, tmp_path / "out", **OPTIONS)


def test_a_map_does_not_have_the_name_of_a_person_in_its_world(tmp_path):
    alone, among = (replace(open_room(), name="person_0", bodies=bodies) for bodies in ((), (walker(),)))
    export_gazebo([alone], tmp_path / "alone", **OPTIONS)
    with pytest.raises(ConfigError, match="map 'person_0': expected another name"):
        export_gazebo([among], tmp_path / "among", **OPTIONS)


@pytest.mark.parametrize(
    ("path", "problem"),
    [
        (PATH, None),
        ([[0.5, 1.0], [-0.1, 1.0]], "body 0 (scripted): expected a course clear of walls"),
        ("start", "start: expected room for the robot"),
    ],
)
def test_people_are_refused_as_by_every_other_command(tmp_path, path, problem):
    scenario = open_room()
    start = [[scenario.start.x + shift, scenario.start.y] for shift in (0.0, 0.3)]
    person = body("scripted", waypoints=start if path == "start" else [list(point) for point in path], speed=0.5)
    scenario = replace(scenario, bodies=(person,))
    if problem is None:
        assert export_gazebo([scenario], tmp_path / "out", **OPTIONS)
        return
    with pytest.raises(ConfigError, match=re.escape(f"Gazebo: 'room': {problem}")):
        export_gazebo([scenario], tmp_path / "out", **OPTIONS)
    assert not list(tmp_path.iterdir())
