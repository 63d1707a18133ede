"""Minimisation: delta debugging, obstacles, verdicts, and a whole minimisation without a robot."""

from __future__ import annotations

import json
import tracemalloc
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from evolution import load
from evolution.cli import main
from evolution.driving import JobPlan, RunResult, resources
from evolution.minimizing import MinimizeSettings, read_verdict, run_minimizing
from evolution.minimizing.delta_debugging import minimal
from evolution.minimizing.obstacles import farthest_first, frame_of, halves, map_with, obstacles_of
from gym_mapbench.errors import ConfigError, RunError
from gym_mapbench.generator import FamilySpec, ShapeSettings, draw_from
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.robot import make_robot
from gym_mapbench.world.scenario import Pose, Scenario
from tests.evolution import fake_runs

ROWS = (
    "##########",
    "#........#",
    "#.#....##.",
    "#..#...##.",
    "#........#",
    "#...#....#",
    "#........#",
    "##########",
)
GRID = GridMap.from_rows(
    ["#" * 10, "#........#", "#.#....###", "#..#...###", "#........#", "#...#....#", "#" * 10], 0.1
)


def first_that(condition):
    return lambda candidates: next((i for i, one in enumerate(candidates) if condition(one)), None)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 40), st.sets(st.integers(0, 39), max_size=5))
def test_only_the_needed_items_are_left(count, needed):
    """Where the condition is that some items are there, exactly these are left."""
    needed = {one for one in needed if one < count}
    assert minimal(range(count), first_that(lambda items: needed <= set(items))) == sorted(needed)


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 25), st.integers(0, 2**31))
def test_no_single_item_can_be_removed(count, seed):
    """Also where the condition is not monotonic."""
    rng = np.random.default_rng(seed)
    known = {}

    def condition(items):
        return known.setdefault(tuple(items), bool(rng.random() < 0.3))

    known[tuple(range(count))] = True
    left = minimal(range(count), first_that(condition))
    assert known[tuple(left)]
    assert not any(known[tuple(left[:i] + left[i + 1 :])] for i in range(len(left)))


def test_obstacles_touch_at_corners_and_the_frame_is_none():
    assert sorted(map(len, obstacles_of(GRID))) == [1, 2, 4]
    assert int(frame_of(GRID.occupancy).sum()) == 2 * 10 + 2 * 5
    assert frame_of(GridMap.from_rows(ROWS).occupancy)[:, -1].sum() == 2  # a border with a gap is no frame


def test_the_map_with_all_obstacles_is_the_map():
    assert map_with(GRID, obstacles_of(GRID)) == GRID
    assert not obstacles_of(map_with(GRID, []))


def test_the_farthest_obstacle_is_first():
    path = np.array([[0.15, 0.15], [0.45, 0.15]])
    assert list(map(len, farthest_first(obstacles_of(GRID), GRID, [path]))) == [4, 2, 1]


def test_halves_are_the_whole():
    cells = np.argwhere(np.pad(np.ones((2, 7), dtype=bool), ((2, 0), (1, 0))))
    first, second = halves(cells)
    assert sorted(map(tuple, [*first, *second])) == list(map(tuple, cells))
    assert first[:, 1].max() < second[:, 1].min()
    assert not list(halves(first[first[:, 1] < 3]))


def test_a_scanned_map_with_thousands_of_specks_needs_little_memory():
    occupancy = np.zeros((1000, 1000), dtype=bool)
    occupancy[10:990:20, 10:990:20] = occupancy[11:991:20, 11:991:20] = True
    grid = GridMap(occupancy)
    tracemalloc.start()
    specks = obstacles_of(grid)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert (len(specks), {len(one) for one in specks}) == (49 * 49, {2})
    assert peak < 100e6
    assert map_with(grid, specks) == grid


def result(outcome="goal", time=10.0):
    return RunResult(outcome, time, 5.0)


def test_verdicts_by_hand():
    trial = {"dwb": result(), "mppi": result("timeout", 150.0), "rpp": result("goal", 8.0)}
    names = tuple(trial)
    assert read_verdict("mppi fails", names).holds(trial)
    assert read_verdict("mppi fails and  rpp succeeds", names).holds(trial)
    assert not read_verdict("dwb fails", names).holds(trial)
    assert not read_verdict("mppi fails", names).holds(trial | {"rpp": result("error", 0.0)})
    order = read_verdict("order", names).measured_on([trial])
    assert order.order == ("rpp", "dwb", "mppi")
    assert not order.holds(trial | {"dwb": result(time=7.0)})
    without_order = ({"dwb": result("collision")}, {"dwb": result(time=8.0)})
    assert not any(order.holds(trial | changed) for changed in without_order)
    for changed in without_order:
        with pytest.raises(ConfigError, match="all times differ and at most one controller fails"):
            read_verdict("order", names).measured_on([trial | changed])
    both = {"dwb": result(), "rpp": result(time=8.0)}
    ratio = read_verdict("ratio", ("dwb", "rpp"), tolerance=0.1).measured_on([both])
    assert ratio.holds({"dwb": result(time=10.9), "rpp": result(time=8.0)})
    assert not ratio.holds({"dwb": result(time=11.1), "rpp": result(time=8.0)})
    at_once = {"dwb": result(time=0.0), "rpp": result(time=0.0)}
    assert not ratio.holds(at_once)
    assert read_verdict("dwb succeeds", names).measured_on([at_once]).holds(at_once)
    for refused in (trial, at_once):
        with pytest.raises(ConfigError, match="all controllers reach the goal, none in 0 s"):
            read_verdict("ratio", names).measured_on([refused])


def test_a_verdict_names_controllers_whatever_their_names():
    names = ("rpp 2", "rpp and more", "größe")
    verdict = read_verdict("rpp 2 fails and rpp and more succeeds and größe fails", names)
    assert verdict.outcomes == {"rpp 2": False, "rpp and more": True, "größe": False}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mppi explodes", "expected 'CONTROLLER fails'"),
        ("mpi fails", "did you mean 'mppi'"),
        ("mppi fails and mppi succeeds", "expected 'CONTROLLER fails'"),
        ("", "expected 'CONTROLLER fails'"),
    ],
)
def test_bad_verdicts(text, message):
    with pytest.raises(ConfigError, match=message):
        read_verdict(text, ("dwb", "mppi"))


def blocked(job):
    """Fails where the cell at (0.45, 0.15) is occupied; takes longer with more walls."""
    fails = job.scenario.map.occupancy[1, 4]
    return RunResult("collision" if fails else "goal", 5.0 + job.scenario.map.occupancy.sum(), 3.0, seed=job.seed)


def blocked_by_a_leg(job):
    """Fails where the cells at x = 0.35 m and y = 0.25 to 0.55 m are occupied."""
    return RunResult("collision" if job.scenario.map.occupancy[2:6, 3].all() else "goal", 5.0, 3.0, seed=job.seed)


def fails(job):
    return RunResult("timeout", 60.0, 0.0, seed=job.seed)


def recorded(job):
    return Episode(job.scenario, job.controller.name, 0, "goal", "", 1.0, 0.1, np.array([[0.15, 0.15, 0, 0, 0]]), None)


def minimise(path, keep="rpp fails", workers=1, on_run=None, resume=False, grid=GRID, name="hand", genome=None, **more):
    """Minimise, with one worker in this process, unless the executor is given."""
    more = {"executor": fake_runs.IN_PROCESS if workers == 1 else "processes", **more}
    scenario = Scenario(grid, Pose(0.15, 0.15), Pose(0.85, 0.15), name, genome=genome)
    plan = JobPlan(fake_runs.CONTROLLERS[2:], fake_runs.WORLD, 3)
    verdict = read_verdict(keep, plan.names)
    wanted = MinimizeSettings(seeds=2, held_out_seeds=3)
    options = {"resources": resources.Resources(workers=workers, **more), "on_run": on_run, "resume": resume}
    return run_minimizing(scenario, plan, verdict, wanted, path, **options)


def use_fakes(patch):
    patch.setattr("evolution.minimizing.running.run_job", blocked)
    patch.setattr("evolution.minimizing.running.drive", recorded)
    patch.setattr("evolution.runs.exclusive.preparation_of", lambda *_: None)


@pytest.fixture
def no_robot(monkeypatch):
    use_fakes(monkeypatch)


def test_the_cause_is_left(no_robot, tmp_path):
    found = minimise(tmp_path / "out")
    (cause,) = obstacles_of(found.after.map)
    assert [1, 4] in cause.tolist()
    assert found.held_after == (True,) * 3
    assert [row["obstacles"] for row in found.table()] == [3, 1]
    again = load(tmp_path / "out")
    assert again.sentences() == found.sentences()
    assert again.after.map == found.after.map


def test_a_map_whose_result_could_not_be_read_is_refused_before_its_runs(no_robot, monkeypatch, tmp_path):
    monkeypatch.setattr("gym_mapbench.mapio.map_set_file.MAX_JSON_BYTES", 700)
    with pytest.raises(ConfigError, match="expected fewer cells: the map-set file would have"):
        minimise(tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_the_smallest_map_has_not_the_genome_of_all_obstacles(no_robot, tmp_path):
    of_gates = [FamilySpec(name="gates")], ShapeSettings(), make_robot("turtlebot3_waffle")
    genome = draw_from(np.random.default_rng(0), *of_gates).genome
    found = minimise(tmp_path / "out", genome=genome)
    assert found.before.genome is genome is not None
    assert found.after.genome is None


def test_no_obstacle_may_be_needed(no_robot, monkeypatch, tmp_path):
    monkeypatch.setattr("evolution.minimizing.running.run_job", fails)
    first, _, last = minimise(tmp_path / "out").sentences()
    assert first == "3 obstacles become 0, and the verdict 'rpp fails' still holds."
    assert last == "The verdict needs no obstacle."


def test_a_part_that_a_cut_has_set_free_is_removed(no_robot, monkeypatch, tmp_path):
    """Both legs of an upside-down U are in its lower half; the verdict needs only the left one, from end to end."""
    rows = ["#" * 10, "#........#", "#..####..#", *["#..#..#..#"] * 7, "#........#", "#" * 10]
    grid = GridMap.from_rows(rows, 0.1)
    assert len(obstacles_of(grid)) == 1
    monkeypatch.setattr("evolution.minimizing.running.run_job", blocked_by_a_leg)
    (left,) = obstacles_of(minimise(tmp_path / "out", grid=grid).after.map)
    assert left.tolist() == [[row, 3] for row in range(2, 6)]


def test_another_map_is_named_when_it_cannot_continue(no_robot, tmp_path):
    minimise(tmp_path / "out")
    with pytest.raises(ConfigError, match="map was hand when the minimization began, got office"):
        minimise(tmp_path / "out", resume=True, name="office")


def test_a_killed_minimisation_continues_with_the_same_bytes(no_robot, tmp_path):
    minimise(tmp_path / "whole", workers=2)
    count = iter(range(100))

    def interrupt(*_):
        if next(count) == 5:
            raise KeyboardInterrupt

    with suppress(KeyboardInterrupt):
        minimise(tmp_path / "cut", on_run=interrupt)
    minimise(tmp_path / "cut", resume=True)
    for name in ("maps.json", "summary.json"):
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "whole" / name).read_bytes()


def test_a_verdict_that_does_not_hold_is_refused(no_robot, tmp_path):
    with pytest.raises(ConfigError, match="holds on 0 of 2 seeds"):
        minimise(tmp_path / "out", "rpp succeeds")


def crashes(job):
    """Ends in an error, as a controller that raises."""
    return RunResult("error", 0.0, 0.0, reason="ValueError: why")


def test_a_verdict_that_does_not_hold_because_of_an_error_says_so(no_robot, monkeypatch, tmp_path):
    monkeypatch.setattr("evolution.minimizing.running.run_job", crashes)
    with pytest.raises(ConfigError, match="0 of 2 seeds, and 2 runs ended in an error, the first because: ValueError"):
        minimise(tmp_path / "out")


def test_the_command_says_what_is_wrong(tmp_path, capsys):
    argv = ["minimize", "examples/office.yaml", "--out", str(tmp_path / "out")]
    assert main([*argv, "--keep", "mpi fails"]) == 2
    assert "minimize: --keep: unknown controller 'mpi'; did you mean 'mppi'" in capsys.readouterr().err
    assert main([*argv, "--keep", "mppi fails", "--map", "offic"]) == 2
    assert "--map: unknown map 'offic'; did you mean 'office'" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_damaged_result_is_refused_in_one_line(no_robot, tmp_path):
    minimise(tmp_path / "out")
    summary, maps = tmp_path / "out" / "summary.json", tmp_path / "out" / "maps.json"
    before, document = summary.read_text(), json.loads(maps.read_text())
    summary.write_text(json.dumps({**json.loads(before), "held_after": [[True]]}))
    with pytest.raises(RunError, match=r"summary.json: held_after.0: should be a valid boolean"):
        load(tmp_path / "out")
    summary.write_text(before)
    maps.write_text(json.dumps({**document, "maps": document["maps"][:1]}))
    with pytest.raises(RunError, match=r"maps.json: expected the original and the smallest map, got 1 map; --resume"):
        load(tmp_path / "out")


def test_the_summary_is_json(no_robot, tmp_path):
    minimise(tmp_path / "out")
    assert json.loads((tmp_path / "out" / "summary.json").read_text())["keep"] == "rpp fails"


@pytest.mark.parametrize("name", ["maps.json", "summary.json", "minimize.json"])
def test_a_file_of_another_minimization_is_refused(no_robot, tmp_path, name):
    other = GRID.occupancy.copy()
    other[-1, -1] = not other[-1, -1]
    minimise(tmp_path / "out")
    minimise(tmp_path / "other", grid=GridMap(other, GRID.resolution))
    before = (tmp_path / "out" / name).read_bytes()
    (tmp_path / "out" / name).write_bytes((tmp_path / "other" / name).read_bytes())
    with pytest.raises(RunError, match=r"json: expected the (summary|map) of .*; --resume makes it again"):
        load(tmp_path / "out")
    (tmp_path / "out" / name).write_bytes(before)
    found = load(tmp_path / "out")
    assert list(found.table("steps")[0]) == ["step", "obstacles", "occupied cells"]
    with pytest.raises(ConfigError, match="unknown table 'step'; did you mean 'steps'"):
        found.table("step")
