from __future__ import annotations

import heapq
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.movingai import ScenTask, optimal_lengths
from gym_mapbench.mapio.movingai_check import SUMMATION, check_scen, tolerances
from gym_mapbench.world.gridmap import GridMap
from tests.mapio.samples import MOVINGAI_MAP, MOVINGAI_SCEN
from tests.oracle_data import DATA, needs_data


def dijkstra(blocked, start, goal):
    """The slow, obvious way."""
    rows, cols = blocked.shape
    best, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        length, (row, col) = heapq.heappop(queue)
        if (row, col) == goal:
            return length
        for r in (row - 1, row, row + 1):
            for c in (col - 1, col, col + 1):
                inside = 0 <= r < rows and 0 <= c < cols
                if not inside or blocked[r, c] or blocked[row, c] or blocked[r, col]:
                    continue
                further = length + math.hypot(r - row, c - col)
                if further < best.get((r, c), math.inf) - 1e-12:
                    best[r, c] = further
                    heapq.heappush(queue, (further, (r, c)))
    return math.inf


@given(cells=st.tuples(st.integers(1, 9), st.integers(1, 9)).flatmap(lambda s: arrays(np.bool_, s)), data=st.data())
@settings(max_examples=40, deadline=None)
def test_lengths_are_those_of_a_plain_search(cells, data):
    places = st.tuples(st.integers(0, cells.shape[0] - 1), st.integers(0, cells.shape[1] - 1))
    tasks = data.draw(st.lists(st.tuples(places, places), min_size=1, max_size=5))
    tasks = [(start, goal) for start, goal in tasks if not cells[start]]
    expected = [dijkstra(cells, start, goal) for start, goal in tasks]
    assert optimal_lengths(GridMap(cells), tasks) == pytest.approx(np.array(expected))


@pytest.fixture
def scen(tmp_path):
    (tmp_path / "tiny.map").write_text(MOVINGAI_MAP)
    (tmp_path / "tiny.map.scen").write_text(MOVINGAI_SCEN)
    return tmp_path / "tiny.map.scen"


def test_a_map_of_another_format_is_refused_by_its_name(tmp_path):
    (tmp_path / "room.yaml").write_text("image: room.pgm\nresolution: 0.05\n")
    with pytest.raises(MapFormatError, match=r"room\.yaml: expected a \.scen file, got \.yaml"):
        check_scen(tmp_path / "room.yaml")


def test_right_and_wrong_optima(scen):
    report = check_scen(scen)
    # (1, 1) to (3, 2) must go round the wall at (3, 1): one step straight, one diagonal.
    assert (report.tasks, report.solved, report.passed) == (2, 2, True)
    assert report.largest_error < 1e-8
    assert "2 of 2 tasks solved, all agree" in str(report)
    scen.write_text(MOVINGAI_SCEN.replace("1.0\n", "1.002\n"))
    report = check_scen(scen)
    assert report.wrong == (1,)
    assert report.largest_error == pytest.approx(0.002)
    assert "1 disagree, the first is task 1" in str(report)


@pytest.mark.parametrize(
    ("printed", "right"),
    [("2.41", True), ("2.42", True), ("2.40", False), ("2.4", True), ("2.5", False), ("2", True), ("3", False)],
)
def test_a_length_may_be_rounded_as_far_as_the_file_prints_it(scen, printed, right):
    scen.write_text(MOVINGAI_SCEN.replace("2.41421356", printed))
    assert check_scen(scen).passed is right


def test_a_zero_at_the_end_that_is_not_printed_does_not_widen_the_tolerance():
    def tasks(*printed):
        numbers = [text.partition(".")[2] for text in printed]
        return [ScenTask((0, 0), (0, 0), float(p), len(d)) for p, d in zip(printed, numbers, strict=True)]

    two_decimals = tolerances(tasks("3.5", "7.25", "7", "9.12"))
    assert two_decimals == pytest.approx(SUMMATION + np.full(4, 0.005))
    six_digits = tolerances(tasks("12345.7", "1234.5", "1234.57", "12.3457"))
    assert six_digits == pytest.approx(SUMMATION + np.array([0.05, 0.005, 0.005, 0.00005]))
    assert len(tolerances([])) == 0


@given(
    lengths=st.lists(st.floats(0.5, 90000), min_size=1, max_size=20),
    form=st.sampled_from(["{:.2f}", "{:.6g}", "{:.0f}", "{:.8f}"]),
)
def test_no_rounding_of_a_right_length_is_called_wrong(lengths, form):
    texts = [form.format(length) for length in lengths]
    tasks = [ScenTask((0, 0), (0, 0), float(t), len(t.partition(".")[2])) for t in texts]
    assert (abs(np.array(lengths) - [task.optimal for task in tasks]) <= tolerances(tasks)).all()


def test_tasks_without_a_path_are_wrong(scen):
    scen.write_text(MOVINGAI_SCEN.replace("1\t1\t3\t2", "1\t1\t4\t2"))
    report = check_scen(scen)
    assert report.solved == 1
    assert report.wrong == (0,)


@needs_data
def test_published_tasks():
    report = check_scen(DATA / "movingai" / "arena.map.scen")
    assert (report.tasks, report.solved) == (160, 160)
    assert report.largest_error < 1e-4
