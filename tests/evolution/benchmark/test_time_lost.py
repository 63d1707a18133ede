from __future__ import annotations

import pytest

from evolution import bench
from evolution.benchmark import time_lost, without_people
from tests.worlds import among, line, social


def row(name, repeat, outcome, time_s):
    return {"map": name, "controller": "dwb", "repeat": repeat, "outcome": outcome, "time_s": time_s}


def test_only_pairs_that_reach_the_goal_count():
    people = [
        row("a", 0, "goal", 30.0),
        row("a", 1, "goal", 18.0),
        row("b", 0, "timeout", 60.0),
        row("c", 0, "goal", 9),
    ]
    alone = [
        row("a", 1, "goal", 20.0),
        row("a", 0, "goal", 20.0),
        row("b", 0, "goal", 20.0),
        row("c", 0, "collision", 5),
    ]
    lost = time_lost(people, alone)
    assert [(pair.map, pair.repeat, pair.seconds, pair.ratio) for pair in lost] == [
        ("a", 0, 10.0, 1.5),
        ("a", 1, -2.0, pytest.approx(0.9)),
    ]


def test_people_in_the_way_cost_time():
    hall = ("#" * 60, *["#" + "." * 58 + "#"] * 28, "#" * 60)
    task = {"start": (0.8, 1.5, 0.0), "goal": (5.0, 1.5, 0.0), "rows": hall}
    standing = line((2.8, 1.5), (2.8, 1.5), 0.0, 0.25)
    walking = social((4.2, 2.4), (4.2, 0.6), radius=0.25)
    rows = [
        bench(scenarios, ["rpp"], workers=1, time_limit=60).rows
        for scenarios in ([among(standing, walking, **task)], without_people([among(standing, walking, **task)]))
    ]
    (lost,) = time_lost(*rows)
    assert lost.alone == pytest.approx(4.2 / 0.5, rel=0.3)
    assert lost.seconds > 0.2
