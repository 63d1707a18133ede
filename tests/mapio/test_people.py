from __future__ import annotations

import pytest
import yaml

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.mapio.conversion import write_map_file, write_maps
from gym_mapbench.mapio.map_server import map_server_files
from gym_mapbench.mapio.tasked_map import group_scenarios
from gym_mapbench.world.bodies import Body
from tests.worlds import among

PERSON = {
    "shape": {"radius": 0.2},
    "motion": {"name": "scripted", "options": {"waypoints": [[0.5, 1.5], [2.5, 1.5]], "speed": 0.5}},
}
AGENT = {
    "id": 1,
    "behavior": 2,
    "max_vel": 1.2,
    "radius": 0.3,
    "cyclic_goals": True,
    "init_pose": {"x": 0.5, "y": 2.5, "z": 1.25, "h": 0.0},
    "goals": ["g0", "g1"],
    "g0": {"x": 1.5, "y": 2.5, "h": 1.25},
    "g1": {"x": 1.5, "y": 1.5, "h": 1.25},
}
ARENA_AGENT = {
    "name": "1",
    "pos": [0.5, 2.5, 1.57],
    "type": "adult",
    "vmax": 0.9,
    "waypoints": [[1.5, 2.5, 0.0], [1.5, 1.5]],
    "waypoint_mode": 0,
}


def hunav(**changes):
    agent = {key: value for key, value in (AGENT | changes).items() if value is not None}
    return {"hunav_loader": {"ros__parameters": {"map": "room", "agents": ["agent1"], "agent1": agent}}}


def arena(**changes):
    agent = {key: value for key, value in (ARENA_AGENT | changes).items() if value is not None}
    return {"pedsim_agents": [agent]}


@pytest.fixture
def room(tmp_path):
    """Writes a map with people, and reads it."""

    def read(people, poses=True):
        for name, content in map_server_files(group_scenarios([among()])).items():
            if poses or "poses" not in name:
                (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        (tmp_path / "room_people.yaml").write_text(yaml.safe_dump(people))
        return load_scenarios(tmp_path / "room.yaml")

    return read


def test_people_beside_a_map_are_on_it(room):
    (scenario,) = room([PERSON])
    (body,) = scenario.bodies
    assert body.model_dump(mode="json") == PERSON
    assert scenario.map == among().map
    assert room([])[0].digest == room([])[0].digest != scenario.digest


@pytest.mark.parametrize("single", [False, True])
def test_people_come_back_from_the_files_of_a_map_server(tmp_path, single):
    motions = [
        {"name": "scripted", "options": {"waypoints": [[0.5, 1.5], [2.5, 1 / 3]], "speed": 0.5, "phase": 1e-7}},
        {"name": "wander", "options": {"centre": [2, 0.7], "reach": 0.1, "speed": 0.4, "seed": 2**62}},
        {"name": "social_force", "options": {"waypoints": [[0.5, 2.5], [1.5, 2.5]], "speed": 1, "sees_robot": False}},
    ]
    scenario = among(*(Body(motion=motion) for motion in motions))
    maps = group_scenarios([scenario])
    files = write_map_file(maps, tmp_path / "room.yaml") if single else write_maps(maps, tmp_path, "map_server")
    assert {file.name for file in files} == {f"room{end}" for end in (".pgm", ".yaml", "_poses.yaml", "_people.yaml")}
    (back,) = load_scenarios(tmp_path / "room.yaml")
    assert (back.bodies, back.digest) == (scenario.bodies, scenario.digest)


def test_agents_of_hunavsim_are_scripted_walks_in_a_loop(room):
    ((body,),) = (one.bodies for one in room(hunav()))
    assert body.shape.radius == 0.3
    assert body.motion.name == "scripted"
    assert body.motion.options == {"waypoints": [[0.5, 2.5], [1.5, 2.5], [1.5, 1.5]], "speed": 1.2, "loop": True}


@pytest.mark.parametrize("agents", [arena(), {"obstacles": {"static": [], "dynamic": arena()["pedsim_agents"]}}])
def test_agents_of_arena_are_scripted_walks_in_a_loop(room, agents):
    ((body,),) = (one.bodies for one in room(agents))
    assert body.shape.radius == 0.25
    assert body.motion.name == "scripted"
    assert body.motion.options == {"waypoints": [[0.5, 2.5], [1.5, 2.5], [1.5, 1.5]], "speed": 0.9, "loop": True}


@pytest.mark.parametrize(
    ("people", "sees_robot"),
    [
        (hunav(behavior=1), True),
        (hunav(behavior={"type": 1, "configuration": 0}), True),
        (arena(force_factor_robot=2.0), True),
        (arena(force_factor_robot=0.0), False),
    ],
)
def test_agents_that_react_walk_by_social_forces(room, people, sees_robot):
    ((body,),) = (one.bodies for one in room(people))
    assert body.motion.name == "social_force"
    assert body.motion.options["sees_robot"] is sees_robot
    assert body.motion.options["waypoints"] == [[0.5, 2.5], [1.5, 2.5], [1.5, 1.5]]


def test_people_by_social_forces_are_written_and_read(room):
    motion = {"name": "social_force", "options": {"waypoints": [[0.5, 1.5], [2.5, 1.5]], "speed": 0.5}}
    ((body,),) = (one.bodies for one in room([{"shape": {"radius": 0.2}, "motion": motion}]))
    assert body.motion.model_dump() == motion


@pytest.mark.parametrize(
    ("people", "message"),
    [
        (3, "expected a list of bodies, or one of the keys hunav_loader, pedsim_agents, obstacles, got 3"),
        ({"hunav": {}}, "expected a list of bodies, or one of the keys hunav_loader"),
        ([3], "person 0: expected a mapping"),
        ([{**PERSON, "shape": {"radius": -1}}], r"person 0: shape\.radius: expected"),
        (hunav(cyclic_goals=False), "agent1: expected cyclic_goals true"),
        (hunav(max_vel=None), "agent1: expected the key .*max_vel"),
        (hunav(goals=["g7"]), "agent1: expected the key .*g7"),
        (hunav(goals=[["g0"]]), r"agent1: expected the key \['g0'\]"),
        (hunav(max_vel=40.0), "person 0: .*speed: expected"),
        ({"hunav_loader": {"ros__parameters": {"agents": 3}}}, "agents: expected a list of names, got 3"),
        ({"pedsim_agents": 3}, "expected a list of agents, got 3"),
        ({"obstacles": {"static": []}}, "obstacles: expected the key 'dynamic'"),
        (arena(waypoint_mode=1), r"agent 0: expected waypoint_mode 0 \(a loop\), got 1"),
        (arena(vmax=None), "agent 0: expected the key 'vmax'"),
        (arena(waypoints=[]), r"agent 0: waypoints: expected a list of points, got \[\]"),
        (arena(pos=[0.5]), r"agent 0: expected points \[x, y\] or \[x, y, yaw\], got \[0.5\]"),
        (arena(pos=["a", 1.0]), "agent 0: x: expected"),
        (arena(force_factor_robot="much"), "agent 0: force_factor_robot: expected"),
    ],
)
def test_bad_files_are_one_clear_line(room, people, message):
    with pytest.raises(MapFormatError, match=message) as caught:
        room(people)
    assert "\n" not in str(caught.value)


def test_people_without_a_task_are_refused(room):
    with pytest.raises(MapFormatError, match=r"room_people\.yaml: expected start and goal beside it"):
        room([PERSON], poses=False)
