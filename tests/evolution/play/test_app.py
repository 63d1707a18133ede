"""The application: what a page gets, with real runs in a small room."""

from __future__ import annotations

import asyncio
import io
import zipfile

import pytest

from evolution.api import bench
from evolution.play.messages.requests import MAX_TEXT
from evolution.search import change_near_way
from tests.evolution.play.fake_runs import go_on


def drive_of(session, number=1, **changes):
    return {"type": "drive", "id": number, **session, **changes}


def until(socket, *kinds):
    """Return the messages up to the first of some types or to an error."""
    got = []
    while not got or got[-1]["type"] not in (*kinds, "error"):
        got.append(socket.receive_json())
    return got


@pytest.fixture(scope="module")
def driven(page, session):
    """All messages of a drive."""
    with page.connect() as socket:
        socket.send_json(drive_of(session))
        return until(socket, "answer")


def test_the_ways_are_whole_and_end_where_the_runs_end(driven):
    for run in (one for one in driven if one["type"] == "run"):
        parts = [one for one in driven if one["type"] == "way" and one["variant"] == run["variant"]]
        poses = [pose for part in parts for pose in part["poses"]]
        assert [part["first"] for part in parts] == [sum(len(p["poses"]) for p in parts[:n]) for n in range(len(parts))]
        assert poses[0] == [0.0, 0.5, 0.5, 0.0]
        assert poses[-1][0] == run["time"]
        assert driven.index(parts[-1]) < driven.index(run)


def test_the_numbers_are_those_of_bench(driven, page, session, room, tmp_path):
    answer = driven[-1]
    archive = zipfile.ZipFile(io.BytesIO(page.post("save/session", session).content))
    archive.extractall(tmp_path)
    assert set(answer["files"]) <= set(archive.namelist())
    assert archive.read("command.txt").decode().splitlines() == answer["command"]
    for name, params in (("rpp", "thesis"), ("rpp far", str(tmp_path / "rpp_far.yaml"))):
        (row,) = bench(tmp_path / "room.yaml", "rpp", params=params, robot="turtlebot3_waffle", workers=1).rows
        (run,) = [one for one in driven if one["type"] == "run" and one["variant"] == name]
        of_bench = [
            row[key] for key in ("outcome", "time_s", "path_length_m", "min_clearance", "n_recoveries", "reason")
        ]
        assert [run[key] for key in ("outcome", "time", "length", "clearance", "recoveries", "sentence")] == of_bench


def test_one_run_claims_no_difference(driven):
    assert driven[-1]["verdict"] == [
        "One run of each cannot tell a difference from chance. More repeats can, with noise."
    ]


def test_repeats_have_a_median_and_a_verdict(page, session):
    with page.connect() as socket:
        settings = {"preset": "thesis", "noise": "nominal", "repeats": 3}
        socket.send_json(drive_of(session, settings=settings))
        *_, answer = messages = until(socket, "answer")
    assert [row["runs"] for row in answer["table"]] == [3, 3]
    times = sorted(one["time"] for one in messages if one["type"] == "run" and one["variant"] == "rpp")
    assert answer["table"][0]["time"] == times[1]
    assert "rpp far" in answer["verdict"][0]
    assert "p = " in " ".join(answer["verdict"])


def test_a_failure_says_why_and_where(page, session):
    with page.connect() as socket:
        world = {"preset": "thesis", "robot_radius": 0.45}
        socket.send_json(drive_of(session, settings=world, scene=session["scene"] | {"start": [0.6, 0.6, 0.0]}))
        messages = until(socket, "answer")
    for run in (one for one in messages if one["type"] == "run"):
        assert run["outcome"] != "goal"
        assert run["sentence"]
        assert run["where"] == pytest.approx([0.6, 0.6], abs=0.5)


def test_an_instant_shows_the_pose_of_the_way_and_what_the_robot_believes(page, session, driven):
    with page.connect() as socket:
        socket.send_json(drive_of(session, 5))
        messages = until(socket, "answer")
        socket.send_json({"type": "instant", "id": 5, "variant": "rpp", "time": 1.02})
        (instant,) = until(socket, "instant")
    poses = [pose for one in messages if one["type"] == "way" and one["variant"] == "rpp" for pose in one["poses"]]
    assert instant["time"] == pytest.approx(1.0)
    assert [instant["time"], *instant["pose"]] == poses[20]
    assert instant["thoughts"]["kind"] == "rpp"
    assert instant["local"]["height"] == instant["local"]["width"] == 60
    assert (instant["global_costmap"]["height"], instant["global_costmap"]["width"]) == (41, 60)
    assert len(instant["lidar"]) > 100


def test_a_page_gets_nothing_of_the_drive_of_another_page(page, session):
    with page.connect() as first, page.connect() as second:
        first.send_json(drive_of(session, 7))
        until(first, "answer")
        second.send_json(drive_of(session, 7, scene=session["scene"] | {"start": [0.5, 1.5, 0.0]}))
        until(second, "answer")
        first.send_json({"type": "instant", "id": 7, "variant": "rpp", "time": 0.0})
        (error,) = until(first, "instant")
        if error["message"].startswith("another page"):  # its drive had answered, but not ended
            (error,) = until(first, "instant")
        assert "got 7; another page of this playground has begun to run" in error["message"]
        second.send_json({"type": "instant", "id": 7, "variant": "rpp", "time": 0.0})
        (instant,) = until(second, "instant")
        assert instant["pose"] == [0.5, 1.5, 0.0]


def test_a_page_hears_that_another_page_has_ended_its_runs(page, session, monkeypatch):
    with page.connect() as first, page.connect() as second:
        with monkeypatch.context() as patch:
            patch.setattr("evolution.play.drives.run_streamed", go_on)
            first.send_json(drive_of(session, 3))
            until(first, "way")
        second.send_json(drive_of(session, 4))
        error = until(first, "answer")[-1]
        assert (error["type"], error["id"]) == ("error", 3)
        assert error["message"].startswith("another page of this playground has begun to run")
        assert until(second, "answer")[-1]["type"] == "answer"


@pytest.mark.parametrize(
    ("message", "problem"),
    [
        ("not json", "not a JSON file"),
        ('{"type": "fly"}', "unknown type of message"),
        ('{"type": "instant", "id": 99, "variant": "rpp", "time": 0}', "expected that of the last drive"),
        ('{"type": "search", "id": 99, "goal": "apart"}', "expected that of the last drive"),
        ('{"type": "why", "id": 99, "verdict": "rpp fails"}', "expected that of the last drive"),
    ],
)
def test_a_bad_message_is_answered_with_one_line_and_the_page_goes_on(page, message, problem):
    with page.connect() as socket:
        socket.send_text(message)
        error = socket.receive_json()
        assert error["type"] == "error"
        assert problem in error["message"]
        assert "\n" not in error["message"]
        socket.send_text("[]")
        assert socket.receive_json()["type"] == "error"


def test_bytes_are_answered_with_one_line_and_the_page_goes_on(page):
    with page.connect() as socket:
        for _ in range(2):
            socket.send_bytes(b"{}")
            assert socket.receive_json()["message"] == "message: expected text, got bytes"


def test_a_page_that_goes_away_while_it_sends_is_no_error(page):
    sent = []
    scope = {
        "type": "http",
        "method": "POST",
        "path": f"/{page.door.token}/open",
        "headers": [(b"host", b"127.0.0.1:8765")],
        "query_string": b"",
    }

    async def gone():
        return {"type": "http.disconnect"}

    async def send(message):
        sent.append(message)

    asyncio.run(page.client.app(scope, gone, send))
    assert sent[0]["status"] == 400


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ({"start": [0.0, 0.0, 0.0]}, "start: expected a free cell"),
        ({"goal": [99.0, 0.0, 0.0]}, "goal: expected a point on the map"),
        ({"cells": "AAAA"}, "cells: expected 2460 cells"),
        ({"height": 5001}, "height: expected less than or equal to 5000"),
    ],
)
def test_a_map_that_cannot_be_driven_is_one_line(page, session, change, problem):
    with page.connect() as socket:
        socket.send_json(drive_of(session, scene=session["scene"] | change))
        assert problem in until(socket, "answer")[-1]["message"]


def test_of_a_thousand_edits_in_a_row_the_newest_is_answered(page, session):
    with page.connect() as socket:
        for number in range(1000):
            scene = session["scene"] | {"start": [0.5 + number / 2000, 0.5, 0.0]}
            socket.send_json(drive_of(session, number, scene=scene))
        answers = []
        while not answers or answers[-1]["id"] < 999:
            answers.append(until(socket, "answer")[-1])
    assert answers[-1]["type"] == "answer"


def last_offers(page, session, runs):
    """Search on the map of the session, with its two variants; return the last reply."""
    with page.connect() as socket:
        socket.send_json(drive_of(session, 8))
        until(socket, "answer")
        socket.send_json({"type": "search", "id": 8, "goal": "harder", "runs": runs})
        offers = until(socket, "offers")
        while not offers[-1].get("finished", True):
            offers = until(socket, "offers")
    return offers[-1]


@pytest.mark.parametrize(("runs", "done"), [(8, 8), (1, 2)])
def test_a_search_offers_maps_that_are_harder(page, session, runs, done):
    last = last_offers(page, session, runs)
    assert (last["done"], last["of"]) == (done, done)
    assert len(last["offers"]) <= 3
    assert {one["scene"]["name"] for one in last["offers"]} <= {"room_harder"}


def test_a_search_ends_where_no_change_is_new(page, session, monkeypatch):
    changed = []

    def same(scenario, robot, rng):
        changed[1:] = [] if changed else [change_near_way(scenario, robot, rng)]
        return changed[0]

    monkeypatch.setattr("evolution.play.searches.change_near_way", same)
    last = last_offers(page, session, 8)
    assert (last["done"], last["of"]) == (2, 2)


def test_why_leaves_only_what_the_verdict_needs(page, session):
    with page.connect() as socket:
        socket.send_json(drive_of(session, 9))
        until(socket, "answer")
        socket.send_json({"type": "why", "id": 9, "verdict": "rpp far succeeds", "runs": 50})
        last = until(socket, "offers")[-1]
        while not last.get("finished", True):
            last = until(socket, "offers")[-1]
    assert last["text"].startswith("rpp far succeeds: every obstacle that remains is needed")
    assert last["offers"][0]["scene"]["cells"] != session["scene"]["cells"]
    assert last["offers"][0]["scene"]["name"] == "room_why"


def test_the_state_describes_every_parameter_that_is_tuned(page):
    state = page.get("state").json()
    assert [one["name"] for one in state["controllers"]] == ["dwb", "mppi", "rpp"]
    parameters = {one["key"]: one for one in state["controllers"][2]["parameters"]["thesis"]}
    assert parameters["lookahead_dist"] == {
        "key": "lookahead_dist", "default": 0.6, "kind": "float", "unit": "m", "low": 0.2, "high": 1.2, "choices": [],
        "text": "Distance of the carrot, m.",
    }  # fmt: skip
    for controller in state["controllers"]:
        for preset in controller["parameters"].values():
            assert all(one["text"] for one in preset), controller["name"]


def test_a_gene_is_whole_only_if_its_family_counts_it(page):
    families = {one["name"]: one["genes"] for one in page.get("state").json()["families"]}
    doors = {gene["name"]: (gene["low"], gene["high"], gene["whole"]) for gene in families["doors"]}
    assert (doors["walls"], doors["at"]) == ((1, 3, True), (0, 1, False))


def test_files_are_opened_and_saved(page, session):
    saved = zipfile.ZipFile(io.BytesIO(page.post("save/map", session["scene"]).content))
    assert set(saved.namelist()) == {"room.pgm", "room.yaml", "room_poses.yaml"}
    text = page.post("save/params", {**session, "variant": "rpp far"}).text
    assert "lookahead_dist: 0.9" in text
    assert page.post("random", {"family": "doors", "seed": 3}).json()["name"] == "doors"


@pytest.mark.parametrize("name", ["open", "random", "save/map", "save/params", "save/session"])
@pytest.mark.parametrize("body", ["", "[", "null", "{}", '{"x": 1}'])
def test_a_bad_body_is_one_line_with_status_400(page, name, body):
    answer = page.client.post(f"/{page.door.token}/{name}", content=body)
    assert (answer.status_code, answer.text.count("\n")) == (400, 1)


def test_a_large_body_is_refused(page):
    answer = page.client.post(f"/{page.door.token}/open", content=b" " * (MAX_TEXT + 3_000_000))
    assert (answer.status_code, answer.text) == (400, "body: expected at most 12000000 bytes, got more\n")


@pytest.mark.parametrize("name", ["../app.py", "..%2fapp.py", "%2e%2e/app.py", "/etc/passwd", "nothing.js"])
def test_only_files_of_the_page_are_served(page, name):
    assert page.client.get(f"/{page.door.token}/static/{name}").status_code in (403, 404)


def test_a_ninth_page_is_refused(page):
    from contextlib import ExitStack

    from starlette.websockets import WebSocketDisconnect

    with ExitStack() as stack:
        for _ in range(8):
            stack.enter_context(page.connect())
        with pytest.raises(WebSocketDisconnect):
            stack.enter_context(page.connect())
