"""Why a run failed, in words: by hand, and on the example at whose corner DWB stands still."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from controllers.diagnosis import ADVICE, diagnose, where_it_stood, who_gave_up
from evolution import bench
from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import NoPathError
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.metrics.episode import Event
from gym_mapbench.planners import make_planner
from gym_mapbench.world.scenario import Pose

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"


def test_where_a_robot_stood():
    x = np.concatenate([np.linspace(0.0, 2.0, 101), np.full(200, 2.0)])
    trajectory = np.stack([x, np.full_like(x, 1.5)], axis=1)
    assert where_it_stood(trajectory, 0.05) == "it stood at (2.00, 1.50) from 4.3 s on"
    assert where_it_stood(trajectory[:120], 0.05) == "it ended at (2.00, 1.50)"
    assert where_it_stood(trajectory[:1], 0.05) == "it ended at (0.00, 1.50)"


def test_who_gave_up():
    events = [Event(1.0, "controller_failure", "stuck"), Event(2.0, "clear_local"), Event(3.0, "spin")]
    events += [Event(4.0, "controller_failure", "stuck"), Event(5.0, "replan_failure", "no path from here: closed")]
    assert who_gave_up(events) == [
        "the controller failed 2 times (stuck)",
        "the planner failed once (no path from here: closed)",
        "2 recoveries did not help",
    ]
    assert who_gave_up(events[:2])[1] == "1 recovery did not help"
    assert who_gave_up([]) == []


def test_advice_follows_the_reason():
    events = [Event(1.0, "controller_failure", "RegulatedPurePursuitController detected collision ahead!")]
    said = diagnose(np.zeros((3, 2)), 0.05, events, "")
    assert said.endswith("a shorter lookahead_dist keeps the arc nearer to the path")
    assert "\n" not in said


@pytest.mark.parametrize("mark", ADVICE)
def test_advice_is_given_on_reasons_that_there_are(mark):
    sources = [*EXAMPLES.parent.glob("controllers/**/*.py"), *EXAMPLES.parent.glob("gym_mapbench/planners/*.py")]
    texts = [path.read_text(encoding="utf-8") for path in sources if path.name != "diagnosis.py"]
    assert any(mark in text for text in texts)


def test_dwb_says_which_critics_hold_it_at_the_corner():
    run = bench(EXAMPLES / "office.yaml", "dwb", workers=1, collision_ends_episode=False, time_limit=60.0)
    (row,) = run.rows
    assert row["outcome"] == "timeout"
    assert "it stood at (7." in row["reason"]
    assert "beats the cheapest that drives on" in row["reason"]
    assert run.failures == [f"office/dwb: {row['reason']}"]


@pytest.mark.parametrize("noise", ["none", "nominal"])
def test_all_three_drive_through_the_hall_with_nav2s_own_parameters(noise):
    run = bench(EXAMPLES / "hall.yaml", workers=2, noise=noise)
    assert [row["outcome"] for row in run.rows] == ["goal"] * 3
    assert not run.failures


def test_navfn_names_its_limit():
    cells = np.zeros((120, 120), np.uint8)
    for number, row in enumerate((20, 40, 60, 80)):  # back and forth between walls: 440 cells, two points a cell
        cells[row] = 254
        cells[row, 1:6] = 0 if number % 2 else 254
        cells[row, -6:-1] = 254 if number % 2 else 0
    costmap = Costmap(cells, 0.05, 0.0, 0.0)
    with pytest.raises(NoPathError, match="NavFn follows at most 480 points, 4 times the longer side in cells"):
        make_planner("navfn").plan(costmap, Pose(1.5, 0.1, 0.0), Pose(1.5, 5.0, 0.0))


def test_the_hall_is_a_map_with_a_task():
    (hall,) = load_scenarios(EXAMPLES / "hall.yaml")
    assert hall.map.shape == (140, 200)
