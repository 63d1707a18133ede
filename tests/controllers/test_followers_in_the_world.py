"""The Graceful Controller and the Rotation Shims on a few maps: they arrive, and a shim turns before it drives."""

from __future__ import annotations

import numpy as np
import pytest

from controllers.nav2_params.plugins import SHIMS
from controllers.registry import make_controller
from evolution.driving.one_run import environment_for, run_episode
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

ROWS, COLS = 80, 100


def room(*walls):
    """A room of 5 m x 4 m with blocks in it, each from row to row and from column to column."""
    occupied = np.ones((ROWS, COLS), dtype=bool)
    occupied[1:-1, 1:-1] = False
    for top, bottom, left, right in walls:
        occupied[top:bottom, left:right] = True
    return GridMap.from_rows(tuple("".join("#" if cell else "." for cell in row) for row in occupied), 0.05)


OPEN = room()
DOOR = Scenario(room((0, 35, 48, 52), (55, 80, 48, 52)), Pose(0.8, 0.8, 0.0), Pose(4.2, 3.2, 1.0), "door")
CORNER = Scenario(room((30, 80, 40, 60)), Pose(1.0, 1.0, -1.5), Pose(4.0, 1.0, -1.57), "corner")
BEHIND = Scenario(OPEN, Pose(3.5, 2.0, 0.0), Pose(1.0, 2.0, np.pi), "behind")


def drive(name, scenario, preset, **params):
    controller = make_controller(name, preset=preset, **params)
    env = environment_for(EnvConfig(time_limit=90.0), controller)
    return run_episode(env, controller, scenario, name=name, seed=1)


@pytest.mark.parametrize("scenario", [DOOR, CORNER], ids=lambda scenario: scenario.name)
@pytest.mark.parametrize("preset", ["thesis", "jazzy"])
@pytest.mark.parametrize("name", ["graceful", *SHIMS])
def test_it_arrives_without_touching_anything(name, preset, scenario):
    episode = drive(name, scenario, preset)
    assert (episode.outcome, episode.first_contact_time) == ("goal", None)


@pytest.mark.parametrize("preset", ["thesis", "jazzy"])
@pytest.mark.parametrize("name", SHIMS)
def test_a_shim_turns_on_the_spot_before_it_drives(name, preset):
    episode = drive(name, BEHIND, preset)
    moves = np.flatnonzero(episode.commands[:, 0] != 0.0)
    heading = episode.trajectory[moves[0], 2]
    assert episode.outcome == "goal"
    assert moves[0] > 10
    assert np.ptp(np.abs(episode.trajectory[: moves[0], :2]), axis=0).max() < 0.01
    # Its wheels still turn as it hands over, so the turn ends within the larger of the two thresholds.
    assert np.pi - abs(heading) < 0.8


def test_the_graceful_controller_turns_first_unless_told_otherwise():
    turning = drive("graceful", BEHIND, "jazzy").commands
    curving = drive("graceful", BEHIND, "jazzy", initial_rotation=False).commands
    assert np.flatnonzero(turning[:, 0])[0] > 10
    assert np.flatnonzero(curving[:, 0])[0] < 5


def test_the_shim_turns_to_the_goals_heading_on_its_own():
    episode = drive("shim_dwb", BEHIND, "jazzy", rotate_to_goal_heading=True)
    at_goal = np.hypot(*(episode.trajectory[:-1, :2] - BEHIND.goal[:2]).T) < 0.24
    assert episode.outcome == "goal"
    assert not episode.commands[at_goal[: len(episode.commands)], 0].any()
