from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gym_mapbench.errors import PluginError
from gym_mapbench.metrics import ALWAYS, measure, score_barn
from gym_mapbench.metrics.episode import Episode, Event
from gym_mapbench.world.clearance import measure_clearance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import ROBOTS, RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from tests.worlds import ROOM

ROBOT = RobotSpec(radius=0.2, max_linear_velocity=1.0)
GRID = GridMap.from_rows(ROOM, 0.1)


def run(trajectory, *, commands=None, outcome="goal", robot=ROBOT, events=()):
    trajectory = np.asarray(trajectory, dtype=float)
    n = len(trajectory) - 1
    commands = np.zeros((n, 2)) if commands is None else np.asarray(commands, dtype=float)
    scenario = Scenario(GRID, Pose(*trajectory[0, :3]), Pose(*trajectory[-1, :3]))
    return Episode(
        scenario=scenario,
        controller="test",
        seed=0,
        outcome=outcome,
        reason="",
        time=n * 0.1,
        control_period=0.1,
        trajectory=trajectory,
        commands=commands,
        events=tuple(events),
        robot=robot,
    )


def straight(n=10, step=0.1):
    """Along x from (0.45, 1.05) at 1 m/s; between cell centres."""
    return [(0.45 + step * i, 1.05, 0.0, step / 0.1, 0.0) for i in range(n + 1)]


def test_a_straight_run_by_hand():
    values = measure(run(straight(), commands=[(1.0, 0.5)] * 10))
    assert values == pytest.approx(
        {
            "path_length": 1.0,
            "shortest_length": 1.0,
            "min_clearance": 0.15,
            "mean_clearance": np.mean([min(0.35 + 0.1 * i, 0.95, 2.45 - 0.1 * i) for i in range(11)]) - 0.2,
            "curvature": 0.0,
            "path_smoothness": 0.0,
            "velocity_smoothness": 0.0,
            "jerk": 0.0,
            "effort": 1.25,
            "n_replans": 0.0,
            "n_recoveries": 0.0,
            "n_contacts": 0.0,
            "spl": 1.0,
            "barn_score": 0.5,
            "motion_start": 0.1,
        }
    )
    assert set(values) == set(ALWAYS)


def test_a_right_angle_by_hand():
    corner = [*straight(5), *[(0.95, 1.05 + 0.1 * i, math.pi / 2, 0.0, 0.0) for i in range(1, 6)]]
    values = measure(run(corner))
    assert values["path_length"] == pytest.approx(1.0)
    assert values["curvature"] == pytest.approx(math.pi / 2)
    assert values["path_smoothness"] == pytest.approx(2 * 0.1**2)
    # From 1 m/s to rest within one of 10 steps of 0.1 s.
    assert values["velocity_smoothness"] == pytest.approx(10 / 10)
    assert values["jerk"] == pytest.approx((100 + 100) / 9)
    assert values["shortest_length"] == pytest.approx(0.5 * math.sqrt(2))
    assert values["spl"] == pytest.approx(0.5 * math.sqrt(2))


def test_failures_score_nothing():
    values = measure(run(straight(), outcome="timeout"))
    assert (values["spl"], values["barn_score"]) == (0.0, 0.0)


def test_barn_scores_no_run_with_a_contact():
    assert measure(run(straight(), events=[Event(0.5, "contact")]))["barn_score"] == 0.0


def test_events_are_counted():
    kinds = ["replan", "replan", "spin", "clear_local", "backup", "replan_failure", "contact"]
    values = measure(run(straight(), events=[Event(0.1 * i, kind) for i, kind in enumerate(kinds)]))
    assert (values["n_replans"], values["n_recoveries"], values["n_contacts"]) == (2, 3, 1)


def test_a_run_that_never_moves_has_finite_measures():
    values = measure(run(straight(0)))
    assert all(math.isfinite(value) for value in values.values())
    assert values["path_length"] == 0.0


def test_turns_through_pi_are_short():
    turning = [(1.0 + 0.1 * i, 1.0, yaw, 0.0, 0.0) for i, yaw in enumerate([3.0, 3.1, -3.1, -3.0])]
    assert measure(run(turning))["curvature"] == pytest.approx((6.283185 - 6.0) / 0.3, rel=1e-4)


@pytest.mark.parametrize(
    ("time", "low", "score"),
    [(1.0, 2.0, 0.5), (4.0, 2.0, 0.25), (4.0, 4.0, 0.25), (1.0, 4.0, 0.25), (99.0, 2.0, 0.125)],
)
def test_barn_scores_by_hand(time, low, score):
    assert score_barn(True, time, 1.0, low) == score
    assert score_barn(False, time, 1.0, low) == 0.0


def distance_between(first, second):
    """The plain twin: sampled outlines of two polygons."""

    def outline(corners):
        share = np.linspace(0, 1, 60, endpoint=False)[:, None]
        following = np.roll(corners, -1, axis=0)
        return np.concatenate([a + share * (b - a) for a, b in zip(corners, following, strict=True)])

    a, b = outline(first), outline(second)
    return np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1)).min()


@settings(max_examples=40)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["turtlebot3_waffle", "jackal"]))
def test_clearance_is_exact(seed, name):
    rng = np.random.default_rng(seed)
    robot = ROBOTS[name]
    cells = rng.random((12, 15)) < 0.03
    grid = GridMap(cells, 0.25, (-1.0, 2.0))
    x0, y0, x1, y1 = grid.bounds
    pose = rng.uniform(x0, x1), rng.uniform(y0, y1), rng.uniform(-3, 3)
    squares = [
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * 0.25 + (x0 + col * 0.25, y0 + row * 0.25)
        for row, col in zip(*np.nonzero(cells), strict=True)
    ]
    clearance = measure_clearance(grid, robot, [pose])[0]
    if robot.footprint is None:
        inside = [np.maximum(np.maximum(s[0] - pose[:2], pose[:2] - s[2]), 0) for s in squares]
        distances = [
            *np.hypot(*np.array(inside).reshape(-1, 2).T),
            pose[0] - x0,
            x1 - pose[0],
            pose[1] - y0,
            y1 - pose[1],
        ]
        assert clearance == pytest.approx(min(distances) - robot.radius, abs=1e-9)
        return
    cos, sin = math.cos(pose[2]), math.sin(pose[2])
    corners = np.array(robot.footprint) @ np.array([[cos, sin], [-sin, cos]]) + pose[:2]
    edge = min(corners[:, 0].min() - x0, x1 - corners[:, 0].max(), corners[:, 1].min() - y0, y1 - corners[:, 1].max())
    expected = max(0.0, min([edge, *(distance_between(corners, square) for square in squares)]))
    assert clearance == pytest.approx(expected, abs=0.02)


def test_touching_polygons_have_no_clearance():
    grid = GridMap.from_rows([".....", "..#..", "....."], 1.0)
    robot = RobotSpec(footprint=((1.5, 0.1), (-1.5, 0.1), (-1.5, -0.1), (1.5, -0.1)))
    clearances = measure_clearance(grid, robot, [(2.5, 0.5, 0.0), (2.5, 1.5, 0.0), (2.5, 0.89, 0.0), (2.5, 0.91, 0.0)])
    assert clearances == pytest.approx([0.4, 0.0, 0.01, 0.0])


def half_time(episode):
    return np.float32(episode.time / 2)


def never(episode):
    return float("nan")


def fails(episode):
    return episode.nothing


def changes(episode):
    episode.trajectory[:, 2] = np.unwrap(episode.trajectory[:, 2])
    return 0.0


def immense(episode):
    return 10**400


def words(episode):
    return "a lot"


def test_metrics_of_others_are_measured_where_they_are_asked_for():
    episode = run(straight())
    mine = "tests.metrics.test_run_metrics:half_time"
    values = measure(episode, [mine])
    assert values.pop(mine) == 0.5
    assert values == measure(episode)
    assert set(values) == set(ALWAYS)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("never", "expected a finite number for every run, got nan"),
        ("immense", r"OverflowError: int too large to convert to float, run_metrics.py line \d+"),
        ("changes", r"ValueError: assignment destination is read-only, test_run_metrics.py line \d+"),
        ("words", "expected a finite number for every run, got 'a lot'"),
        ("fails", r"AttributeError: 'Episode' object has no attribute 'nothing', test_run_metrics.py line \d+"),
    ],
)
def test_a_metric_that_fails_says_so(name, message):
    with pytest.raises(PluginError, match=f"^metric 'tests.metrics.test_run_metrics:{name}': {message}$"):
        measure(run(straight()), [f"tests.metrics.test_run_metrics:{name}"])
