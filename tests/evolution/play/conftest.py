"""A small room, and an application that drives in it."""

from __future__ import annotations

import json

import pytest
from starlette.testclient import TestClient

from evolution.driving import JobPlan, Resources, preparation_of, run_job
from evolution.play.app import Application
from evolution.play.catalogue import state_of
from evolution.play.desk import Desk
from evolution.play.guard import Door
from evolution.play.messages.requests import WorldSettings
from evolution.play.scenes import scene_of
from evolution.play.track import Track
from evolution.play.worlds import Given, PageWorld
from evolution.search import controllers_from
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

ROOM = ("#" * 60, *["#" + "." * 58 + "#"] * 20, "#" + "." * 25 + "#" * 4 + "." * 29 + "#", *["#" + "." * 58 + "#"] * 18)
WORLD = WorldSettings(preset="thesis")
ORIGIN, SOCKETS = "http://127.0.0.1:8765", "ws://127.0.0.1:8765"


class Page:
    """A page, as the tests play it."""

    def __init__(self, client, door):
        self.client, self.door = client, door

    def connect(self, **headers):
        return self.client.websocket_connect(
            f"{SOCKETS}/{self.door.token}/socket", headers={"origin": ORIGIN, **headers}
        )

    def post(self, name, document):
        return self.client.post(f"/{self.door.token}/{name}", content=json.dumps(document))

    def get(self, name, **headers):
        return self.client.get(f"/{self.door.token}/{name}", headers=headers)


@pytest.fixture(scope="session")
def room():
    """A room of 3 m x 2 m with a wall beside the way."""
    return Scenario(GridMap.from_rows((*ROOM, "#" * 60)), Pose(0.5, 0.5, 0.0), Pose(2.4, 1.5, 0.0), "room")


@pytest.fixture(scope="session")
def given():
    return Given(controllers_from(["dwb", "mppi", "rpp"]))


@pytest.fixture(scope="session")
def session(room):
    """What the page shows: RPP as it is, and RPP with another lookahead distance."""
    variants = [
        {"name": "rpp", "controller": "rpp"},
        {"name": "rpp far", "controller": "rpp", "parameters": {"lookahead_dist": 0.9}},
    ]
    return {"scene": scene_of(room).model_dump(mode="json"), "settings": {"preset": "thesis"}, "variants": variants}


@pytest.fixture(scope="module")
def page(given, room):
    """An application with two workers for runs and one for instants."""
    warm_up = preparation_of([JobPlan(given.controllers[2:], PageWorld(WORLD, given).own_settings)])
    resources = [Resources(workers=workers, run_timeout_s=60.0) for workers in (2, 1)]
    tracks = [Track(one.evaluator(run_job, warm_up=warm_up, retries=0)) for one in resources]
    state = state_of(given, [scene_of(room)], WORLD, given.controllers)
    door = Door("127.0.0.1", 8765)
    app = Application(given, state, Desk(given, *tracks)).behind(door)
    with TestClient(app, base_url=ORIGIN) as client:
        yield Page(client, door)
