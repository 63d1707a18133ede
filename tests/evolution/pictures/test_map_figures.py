"""The figure of a map set: titles say who is slower, the strips below show every run, rings mark outliers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from evolution.pictures import DrivenMap, map_set_figure, save_comparison
from evolution.pictures.comparison_film import STEP, _draw_legend_at, _draw_map_at, comparison_frames
from evolution.pictures.map_figures import maps_figure
from evolution.pictures.style import RING, new_figure
from evolution.runs import summary_of_map
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.bodies import Body, Disc
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.motions import MotionSpec
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario

ROOM = Scenario(GridMap(np.zeros((20, 30), np.bool_), 0.1), Pose(0.5, 0.5), Pose(2.5, 1.5), "map_1")


def straight(controller, time, outcome="goal"):
    share = np.linspace(0.0, 1.0, round(time / 0.1) + 1)[:, None]
    trajectory = np.zeros((len(share), 5))
    trajectory[:, :2] = (1 - share) * ROOM.start[:2] + share * ROOM.goal[:2]
    return Episode(ROOM, controller, 0, outcome, "", time, 0.1, trajectory, np.zeros((len(share) - 1, 2)), ())


def goals(*times):
    return [{"outcome": "goal", "time_s": time} for time in times]


@pytest.fixture
def driven():
    runs = {"dwb": goals(4.0, 4.2, 9.0), "rpp": [*goals(8.0, 8.4), {"outcome": "timeout", "time_s": 60.0}]}
    return DrivenMap(summary_of_map("map_1", runs), 1, (straight("dwb", 4.2), straight("rpp", 8.4)))


def test_people_are_discs_at_their_start_with_their_ways():
    walks = MotionSpec(name="scripted", options={"waypoints": [[1.0, 1.0], [2.0, 1.0]], "speed": 0.5})
    person = Body(shape=Disc(radius=0.2), motion=walks)
    (axes,) = maps_figure([replace(ROOM, bodies=(person,))]).axes
    (disc,), walk = axes.patches, axes.lines[0].get_xydata()
    assert (*disc.center, disc.radius) == (1.0, 1.0, 0.2)
    assert (walk.min(axis=0), walk.max(axis=0)) == (pytest.approx([1.0, 1.0]), pytest.approx([2.0, 1.0]))


def test_signs_name_people_only_where_there_are_some(driven):
    assert "people" not in map_set_figure([driven], ["dwb", "rpp"]).texts[0].get_text()


def test_titles_of_long_names_stay_above_their_maps():
    names = ["a_controller_with_a_long_name", "another_controller_with_a_long_name"]
    runs = {name: goals(time) for name, time in zip(names, (4.0, 9.0), strict=True)}
    one = DrivenMap(summary_of_map("map_1", runs), 0, tuple(straight(name, 4.2) for name in names))
    figure = map_set_figure([one, one], names)
    FigureCanvasAgg(figure).draw()
    first, second = (axes.title.get_window_extent() for axes in figure.axes[:2])
    assert first.x1 < second.x0


def test_title_labels_and_rings_show_the_same_runs(driven):
    maps, times = map_set_figure([driven], ["dwb", "rpp"]).axes
    assert maps.get_title() == "map_1: rpp takes 2.0 times as long as dwb"
    assert [label.get_text() for label in times.get_yticklabels()] == ["dwb 4.2 s", "rpp 8.2 s\n1 of 3 failed"]
    rings = [line.get_xdata().tolist() for line in times.lines if line.get_markersize() == RING["markersize"]]
    assert rings == [[9.0], []]
    dots = [line.get_xdata().tolist() for line in times.lines if line.get_markersize() == 3]
    assert dots == [[4.0, 4.2, 9.0], [8.0, 8.4]]
    assert [text.get_text() for text in times.texts] == ["9 s"]
    assert "medians of 3 runs" in times.get_xlabel()


def test_the_recorded_sample_is_named(driven):
    assert replace(driven, repeat=0).recorded_sample == "run 1 of 3, as some runs fail"
    solved = replace(driven, summary=summary_of_map("map_1", {"dwb": goals(4.0, 4.2, 9.0)}))
    assert solved.recorded_sample == "run 2 of 3, nearest to the medians"
    signs = [map_set_figure([one], ["dwb", "rpp"]).texts[0].get_text() for one in (driven, solved)]
    assert ["medians, or the first on a map with failed runs. Circle" in text for text in signs] == [True, False]
    single = replace(driven, summary=summary_of_map("map_1", {"dwb": goals(4.0)}), repeat=0)
    assert single.recorded_sample == "the only run"


def texts(time, episodes):
    figure, _ = new_figure()
    figure.clear()
    _draw_legend_at(figure, episodes, ["DWB", "RPP"], time, "A title")
    return [text.get_text() for text in (*figure.texts, *figure.axes[0].texts)]


def test_an_outcome_appears_when_its_run_ends():
    episodes = [straight("dwb", 4.2), straight("rpp", 8.4)]
    first, middle, last = (" | ".join(texts(time, episodes)) for time in (0.0, 5.0, 8.4))
    assert "DWB" in first
    assert "goal" not in first
    assert "takes" not in first
    assert "goal, 4.2 s" in middle
    assert "8.4" not in middle
    assert "RPP takes 2.0 times as\nlong as DWB" in last


def test_a_film_draws_the_footprint_of_a_robot_that_has_one():
    footprint = ((0.3, 0.1), (-0.2, 0.1), (-0.2, -0.1), (0.3, -0.1))
    run = straight("dwb", 1.0)
    trajectory = run.trajectory.copy()
    trajectory[0, :3] = 1.0, 1.0, np.pi / 2
    turned = replace(run, robot=RobotSpec(footprint=footprint), trajectory=trajectory)
    _, (axes,) = new_figure()
    _draw_map_at(axes, [turned, straight("rpp", 1.0)], 0.0)
    drawn, disc = axes.patches[-2:]
    np.testing.assert_allclose(drawn.get_xy()[:4], [(0.9, 1.3), (0.9, 0.8), (1.1, 0.8), (1.1, 1.3)])
    assert disc.radius == RobotSpec().radius


def test_a_film_lasts_as_long_as_the_longest_run(tmp_path):
    episodes = [straight("dwb", 1.0), straight("rpp", 1.3)]
    frames = list(comparison_frames(episodes, "t", ["dwb", "rpp"]))
    assert len(frames) == int(1.3 / STEP) + 2
    for name in ("a.gif", "b.gif"):
        save_comparison(episodes, tmp_path / name)
    assert (tmp_path / "a.gif").read_bytes() == (tmp_path / "b.gif").read_bytes()
    with Image.open(tmp_path / "a.gif") as film:
        assert film.n_frames == len(frames)
