"""Runs among moving bodies: recorded, seeded, and drawn again from the record."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.nav2_params import load_preset
from controllers.rl import as_controller
from evolution import bench
from evolution.driving import ControllerSpec, DriveSettings, JobPlan
from evolution.driving.one_run import environment_for, run_episode
from evolution.pictures import PEOPLE_COLOUR
from evolution.pictures.animation import frames
from evolution.report.page import Report, render_page
from evolution.report.replays import ReplayedMap, replays_of
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.render import BODY
from gym_mapbench.metrics import Event, measure
from tests.evolution.browser import NEEDS_CHROMIUM, open_chromium
from tests.worlds import among, line, social

SCENARIO = among(line((2.5, 0.8), (0.5, 0.8), 0.5))


@pytest.fixture(scope="module")
def episode():
    controller = as_controller(lambda observation: (0.1, 0.0), "ahead", ("goal",))
    env = environment_for(EnvConfig(time_limit=10.0), controller)
    return run_episode(env, controller, SCENARIO, name="ahead", seed=0)


def test_the_record_says_that_a_body_was_touched(episode):
    assert episode.outcome == "collision"
    assert episode.reason.startswith("the robot touched a body")
    assert episode.events == (Event(episode.first_contact_time, "contact", "body"),)
    assert 2.0 < episode.time < 2.3


@pytest.mark.parametrize("speed", [0.0, 0.1])
def test_the_info_of_a_step_and_the_metrics_of_the_run_agree_on_whose_a_contact_is(speed):
    controller = as_controller(lambda observation: (speed, 0.0), "ahead", ("goal",))
    env = environment_for(EnvConfig(time_limit=10.0), controller)
    values = measure(run_episode(env, controller, SCENARIO, name="ahead", seed=0))
    info, over = env.reset(seed=0, options={"scenario": SCENARIO})[1], False
    while not over:
        *_, over, _, info = env.step((speed, 0.0))
    assert info["contact_by_body"] is bool(values["n_contacts_by_people"]) is (speed == 0.0)
    assert values["n_contacts_by_people"] + values["n_collisions_with_people"] == 1


def test_films_show_people_who_see_the_robot_where_they_were():
    scenario = among(social((2.5, 1.0), (0.5, 1.0), sees_robot=True), goal=(2.5, 2.5, 0.0))
    controller = as_controller(lambda observation: (0.1, 0.0), "ahead", ("goal",))
    env = environment_for(EnvConfig(time_limit=2.0), controller)
    shown = run_episode(env, controller, scenario, name="ahead", seed=0)
    x = env.unwrapped.simulation.world.poses[0, 0]
    *_, last = frames(shown, shown.robot, 300)
    coloured = (np.abs(last - BODY).sum(axis=2) < 2).nonzero()[1]
    assert coloured.min() == pytest.approx((x - 0.2) * 100, abs=2)


def test_films_show_the_bodies_where_they_were(episode):
    drawn = list(frames(episode, episode.robot, 300))
    for row in (0, len(drawn) // 2, len(drawn) - 1):
        coloured = (np.abs(drawn[row] - BODY).sum(axis=2) < 2).nonzero()[1]
        left = (2.5 - 0.5 * row * episode.control_period - 0.2) * 100
        assert coloured.min() == pytest.approx(left, abs=2)


def test_replays_hold_the_bodies_until_the_last_run_ends(episode):
    document = replays_of([ReplayedMap("room", [episode])])
    (body,) = document["maps"][0]["bodies"]
    assert body["radius"] == 0.2
    assert document["period"] * (len(body["x"]) - 1) >= episode.time
    assert body["x"][:3] == pytest.approx([2.5, 2.45, 2.4])
    assert set(body["y"]) == {0.8}


def test_replays_hold_people_who_see_the_robot_where_they_were_in_each_run():
    scenario = among(social((2.5, 1.0), (0.5, 1.0), sees_robot=True), goal=(2.5, 2.5, 0.0))
    episodes, places = [], []
    for speed in (0.0, 0.26):
        controller = as_controller(lambda observation, speed=speed: (speed, 0.0), "ahead", ("goal",))
        env = environment_for(EnvConfig(time_limit=2.0), controller)
        episodes.append(run_episode(env, controller, scenario, name=f"at {speed}", seed=0))
        places.append(env.unwrapped.simulation.world.poses[0, :2])
    (shown,) = replays_of([ReplayedMap("room", episodes)])["maps"]
    assert shown["bodies"] == []
    for run, place in zip(shown["runs"], places, strict=True):
        (body,) = run["bodies"]
        assert (body["x"][20], body["y"][20]) == pytest.approx(place, abs=2e-3)
    assert np.hypot(*(places[0] - places[1])) > 0.01


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_the_legend_and_the_replay_show_people_in_the_colour_of_the_figures(episode, tmp_path):
    page = tmp_path / "page.html"
    maps = [ReplayedMap("room", [episode])]
    page.write_text(render_page(Report("Room", "", ["A verdict."], "", "", maps)), encoding="utf-8")
    red, green, blue = (int(PEOPLE_COLOUR[place : place + 2], 16) for place in (1, 3, 5))
    find = """const canvas = document.querySelector('canvas'), pen = canvas.getContext('2d'), [r, g, b] = arguments;
        const {data} = pen.getImageData(0, 0, canvas.width, canvas.height);
        for (let i = 0; i < data.length; i += 4) if (data[i] == r && data[i + 1] == g && data[i + 2] == b) return true;
        return false;"""
    with open_chromium(height=900) as browser:
        browser.get(page.as_uri())
        assert browser.find_element("id", "legend").text.split() == ["ahead", "people"]
        disc = browser.find_element("css selector", "#legend .disc").value_of_css_property("background-color")
        assert disc == f"rgba({red}, {green}, {blue}, 1)"
        assert browser.execute_script(find, red, green, blue)


@pytest.mark.slow
@NEEDS_CHROMIUM
def test_the_replay_shows_the_footprint_of_the_robot(tmp_path):
    controller = as_controller(lambda observation: (0.0, 0.0), "ahead", ("goal",))
    env = environment_for(EnvConfig(time_limit=0.5, robot="jackal"), controller)
    episode = run_episode(env, controller, among(), name="ahead", seed=0)
    page = tmp_path / "page.html"
    page.write_text(render_page(Report("Room", "", ["A."], "", "", [ReplayedMap("room", [episode])])), encoding="utf-8")
    find = """const canvas = document.querySelector('canvas'), pen = canvas.getContext('2d'), xs = [], ys = [];
        const {data} = pen.getImageData(0, 0, canvas.width, canvas.height);
        const isRobot = (i) => Math.abs(data[i + 3] - 0.45 * 255) < 2 && Math.abs(data[i + 2] - 178) < 3;
        for (let i = 0; i < data.length; i += 4) if (isRobot(i)) {
            xs.push(i / 4 % canvas.width); ys.push(Math.floor(i / 4 / canvas.width)); }
        return [xs, ys].map((all) => (Math.max(...all) - Math.min(...all) + 1) / canvas.width);"""
    with open_chromium(height=900) as browser:
        browser.get(page.as_uri())
        long, wide = browser.execute_script(find)
    metres = episode.scenario.map.bounds[2] - episode.scenario.map.bounds[0]
    assert (long * metres, wide * metres) == pytest.approx((0.42, 0.33), abs=0.02)


def test_replays_without_bodies_say_nothing_of_them():
    controller = as_controller(lambda observation: (0.5, 0.0), "ahead", ("goal",))
    env = environment_for(EnvConfig(time_limit=10.0), controller)
    episode = run_episode(env, controller, among(), name="a", seed=0)
    (shown,) = replays_of([ReplayedMap("room", [episode])])["maps"]
    assert shown["bodies"] == shown["runs"][0]["bodies"] == []


def test_bodies_are_part_of_the_seeds_of_a_run():
    plan = JobPlan((ControllerSpec(name="rpp"),), DriveSettings(navigation=load_preset("thesis")))
    moving, empty = plan.job(SCENARIO, 0, 0), plan.job(among(), 0, 0)
    assert moving.seed != empty.seed
    assert moving.noise_seed != empty.noise_seed
    assert moving.key != empty.key


def test_runs_among_people_who_react_do_not_depend_on_the_workers():
    hall = ("#" * 60, *["#" + "." * 58 + "#"] * 28, "#" * 60)
    people = social((3.5, 0.8), (0.6, 1.5)), social((3.5, 2.4), (0.6, 1.0), sees_robot=False)
    scenarios = [among(person, rows=hall, goal=(5.2, 1.6, 0.0)) for person in people]
    first, second = (
        [
            {key: value for key, value in row.items() if key != "controller_ms"}
            for row in bench(scenarios, ["rpp", "dwb"], workers=workers, noise="nominal", time_limit=30).rows
        ]
        for workers in (1, 2)
    )
    assert first == second
