"""The page of a benchmark, from runs made by hand and from a short real one."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from evolution.benchmark import read_bench, score_rows, table_of_scores
from evolution.cli import main
from evolution.files import Table
from evolution.report import write_benchmark_report
from evolution.report.benchmark_page import maps_and_runs, split_reasons, verdict_of_benchmark
from evolution.report.page import page_tables
from gym_mapbench.errors import RunError
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

OFFICE = str(Path(__file__).resolve().parents[3] / "examples" / "office.yaml")


def runs(controller, times, outcome="goal"):
    return [
        {
            "map": f"map_{number}",
            "controller": controller,
            "repeat": 0,
            "outcome": outcome,
            "time_s": time,
            "n_recoveries": 0,
        }
        for number, time in enumerate(times)
    ]


def test_the_verdict_by_hand():
    rows = runs("slow", [20.0, 22.0, 21.0, 23.0, 24.0, 25.0]) + runs("fast", [10.0, 12.0, 11.0, 13.0, 14.0, 14.9])
    fast, slow, pair = verdict_of_benchmark(rows, ("slow", "fast"))
    assert fast == (
        "fast reaches the goal in 6 of 6 runs (100 %, 95 % interval 61 to 100 %), in 12.5 s (10.7 to 14.2) in the mean "
        "of these."
    )
    assert slow.startswith("slow reaches the goal in 6 of 6 runs")
    assert "fast is 10.0 s faster than slow in the mean (95 % interval 10.0 to 10.1 s, p = 0.031)." in pair


def test_of_three_controllers_the_p_values_are_corrected():
    """A difference that two controllers alone would show is not shown among three, as one of three pairs."""
    fast = [10.0, 12.0, 11.0, 13.0, 14.0, 14.9]
    rows = [row for number in range(3) for row in runs(f"c{number}", [time * (1 + number / 9) for time in fast])]
    assert "p = 0.031)" in verdict_of_benchmark(rows, ("c0", "c1"))[-1]
    *_, pair, why = verdict_of_benchmark(rows, ("c0", "c1", "c2"))
    assert "p = 0.094 by Holm over 3 pairs, so neither is shown to be faster)" in pair
    assert why == (
        "No difference of times can be shown: Wilcoxon's test with Holm's correction over 3 pairs needs at least 7 "
        "maps where both reach the goal and has at most 6."
    )


@pytest.mark.parametrize(("controllers", "fewest"), [(2, 6), (3, 7), (6, 10)])
def test_too_few_maps_for_any_difference_are_said_with_how_many_are_needed(controllers, fewest):
    """The fewest maps on which the least p-value, corrected, is below 0.05; on one map less no times would do."""
    names = [f"c{number}" for number in range(controllers)]
    for maps in (fewest - 1, fewest):
        times = {
            name: [(10 + map_ + map_**2 / 9) * 1.3**number for map_ in range(maps)] for number, name in enumerate(names)
        }
        verdict = verdict_of_benchmark([row for name in names for row in runs(name, times[name])], names)
        assert any(f"needs at least {fewest} maps" in line for line in verdict) == (maps < fewest)
        assert all("neither is shown" in line for line in verdict if " faster than " in line) == (maps < fewest)


def test_no_difference_is_called_none():
    rows = runs("a", [20.0, 10.0, 21.0, 10.0, 24.0, 9.0]) + runs("b", [10.0, 20.0, 11.0, 21.0, 9.0, 23.9])
    *_, pair = verdict_of_benchmark(rows, ("a", "b"))
    assert "so neither is shown to be faster" in pair
    alike = verdict_of_benchmark(runs("a", [20.0] * 5) + runs("b", [20.0] * 5), ("a", "b"))
    assert not any("faster" in sentence for sentence in alike)


def test_the_command_writes_the_page_and_fails_by_rule(tmp_path, capsys):
    page = tmp_path / "bench.html"
    argv = ["bench", OFFICE, "--controllers", "rpp", "--time-limit", "4", "--workers", "1", "--format", "json"]
    argv += ["--html", str(page), "--fail-if", "success<0.95", "--fail-if", "rpp.collisions>0"]
    assert main(argv) == 1
    output = capsys.readouterr()
    (run,) = json.loads(output.out)["runs"]
    assert run["outcome"] == "timeout"
    assert "mapbench bench: --fail-if success<0.95: rpp 0\n" in output.err
    assert "collisions" not in output.err
    text = page.read_text(encoding="utf-8")
    assert "rpp reaches the goal in 0 of 1 run (0 %, 95 % interval 0 to 79 %)." in text
    assert f"mapbench bench {OFFICE} --controllers rpp" in text
    assert "differ from what was recorded" not in text
    (shown,) = json.loads(re.search(r'id="replays">(.*?)</script>', text)[1])["maps"]
    assert [(one["controller"], one["outcome"]) for one in shown["runs"]] == [("rpp", "timeout")]
    assert shown["title"] == "office: rpp never reaches the goal"
    assert shown["sample"].startswith("Title: 1 run.")
    assert main([*argv[:-4], "--fail-if", "success<0"]) == 2  # the page exists: nothing is driven, nothing overwritten
    assert "exists already" in capsys.readouterr().err


def test_a_file_of_results_has_no_maps_to_replay(tmp_path):
    (tmp_path / "bench.json").write_text(json.dumps({"runs": runs("a", [1.0])}))
    with pytest.raises(RunError, match="does not hold its maps"):
        write_benchmark_report(read_bench(tmp_path), tmp_path / "page.html")


def test_tables_of_the_page_are_for_readers():
    scores = table_of_scores(score_rows(runs("a", [20.0, 22.0, 21.0, 23.0, 24.0]), ("a",)))
    assert [row["a"] for row in scores][:2] == ["100 (56.6 to 100)", "0 (0 to 43.4)"]
    assert {row["over all maps"]: row["a"] for row in scores}["mean s"] == "22 (20.4 to 23.8)"


def test_what_has_no_value_is_a_dash_in_every_column():
    rows = [{"a": None, "b": 1.0, "c": "own", "d": ""}, {"a": None, "b": None, "c": None, "d": "x"}]
    (table,) = page_tables("t", Table(rows))
    shown = table.shown
    assert [[text for _, text, _ in row] for row in shown] == [["-", "1", "own", ""], ["-", "-", "-", "x"]]


@pytest.mark.parametrize(
    ("maps", "tasks", "repeats", "words"),
    [(1, 1, 1, "1 map, 1 run"), (20, 1, 3, "20 maps, 3 runs"), (2, 4, 3, "8 tasks on 2 maps, 3 runs")],
)
def test_maps_and_runs_in_words(maps, tasks, repeats, words):
    grids = [GridMap(np.zeros((5, 5 + number), dtype=np.bool_), 1.0) for number in range(maps)]
    scenarios = [
        Scenario(grid, Pose(0.5, 0.5), Pose(1.5 + task, 0.5), f"{number}_{task}")
        for number, grid in enumerate(grids)
        for task in range(tasks)
    ]
    assert maps_and_runs(scenarios, repeats) == f"{words} of each controller on each"


def test_reasons_have_a_table_of_their_own():
    row = {"map": "m", "controller": "a", "repeat": 0, "seed": 7, "outcome": "goal", "reason": "", "jerk": 0.1}
    failed = {**row, "repeat": 1, "outcome": "timeout", "reason": "the time limit was reached"}
    rows, failures = split_reasons([row, failed])
    assert [list(one) for one in rows] == [["map", "controller", "repeat", "outcome", "jerk", "seed"]] * 2
    assert failures == [
        {
            "map": "m",
            "controller": "a",
            "repeat": 1,
            "outcome": "timeout",
            "reason": "the time limit was reached",
        }
    ]
