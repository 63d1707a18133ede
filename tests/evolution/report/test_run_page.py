"""What the page of a run says in words about the search."""

from __future__ import annotations

from dataclasses import replace
from math import nan
from pathlib import Path
from types import SimpleNamespace

import pytest

from evolution.pictures import recorded_maps
from evolution.report.run_page import _held, _objectives, _outcome, _penalties, _unfinished, _verdict, replayed_maps
from evolution.report.sections import _genes_rows, _how_to_read, _times_rows, tables_section
from evolution.runs import load_run
from gym_mapbench.world.genome import Genome


def a_run(bests, finished=True, driven=7, **search):
    return SimpleNamespace(
        path="runs/a",
        config={"search": {"evaluations": 40, **search}},
        generations=[{"best": best} for best in bests],
        finished=finished,
        checkpoint={"evaluations": 12},
        runs=[{}] * driven,
        best_results={"success_rate": 1.0},
    )


@pytest.mark.parametrize(
    ("run", "expected"),
    [
        (a_run([-1.0, -2.5]), "The search improved the best fitness from -1.00 to -2.50 (lower is better)."),
        (a_run([-1.0, -1.0]), "found nothing better than its first population, fitness -1.00"),
        (a_run([5578.0, -2.5]), "reached fitness -2.50; its first population had no set that all solve"),
        (a_run([-3.5, -2.78], archive={"elite": True}), "The best set has fitness -2.78 (lower is better)."),
        (a_run([-3.5, -2.78], finished=False, archive={"elite": True}), "The best set so far has fitness -2.78"),
    ],
)
def test_a_gain_is_said_where_fitnesses_can_be_compared(run, expected):
    assert expected in _outcome(run)


def test_a_fitness_above_0_is_explained_and_all_objectives_are_named():
    assert _penalties(52.92)[0].startswith("A fitness above 0 is a sum of penalties")
    assert _penalties(-2.5) == []
    assert _objectives({"fitness": "gini", "objectives": ["n_obstacles"]}) == ["gini fitness", "n_obstacles"]


def test_an_unfinished_run_is_not_called_unconfirmed():
    assert _held(a_run([-1.0], finished=False, validation={})) == []
    assert _held(a_run([-1.0], finished=False, validation={"seeds": 5}))[0].startswith("The set is not validated yet")
    assert _held(a_run([-1.0], validation={"seeds": 5})) == ["No set is validated."]


def test_a_controller_that_a_race_left_out_of_a_map_has_a_row_and_no_warning():
    fails = {"outcome": "timeout", "time_s": 9.0, "metrics": {"n_recoveries": 2.0}}
    rows = _times_rows({"name": "map_1", "score": None, "runs": {"rpp": [fails], "graceful": []}})
    assert [(row[2], row[3], row[8]) for row in rows] == [
        ("rpp", 1, 2.0),
        ("graceful", 0, pytest.approx(nan, nan_ok=True)),
    ]


def test_how_far_a_search_has_come_is_counted_in_what_limits_it():
    assert _unfinished(a_run([-1.0])) == []
    assert "12 of 40 sets; mapbench evolve --resume runs/a" in _unfinished(a_run([-1.0], finished=False))[0]
    assert "7 of 900 runs" in _unfinished(a_run([-1.0], finished=False, runs=900))[0]


def test_verdict_replays_figure_and_table_show_one_sample():
    """On map_2 of the kept set one of 19 runs of DWB takes 65 s: every part of the page tells it of the same runs."""
    run = load_run(Path(__file__).parents[1] / "earlier_run")
    recorded = recorded_maps(run)
    driven = [replace(one, episodes=(SimpleNamespace(controller="dwb"),)) for one in recorded]
    verdict = next(line for line in _verdict(run) if line.startswith("map_2"))
    assert verdict == (
        "map_2: mppi takes 1.3 times as long as dwb. Medians of 19 runs: dwb 23.8 s (1 outlier: 65.0 s), "
        "mppi 31.1 s, rpp 25.3 s."
    )
    replay = replayed_maps(run, driven)[1]
    assert replay.title == "map_2: mppi takes 1.3 times as long as dwb"
    assert replay.sample.startswith("Title: medians of 19 runs. Replay: run 10 of 19, ")
    table = tables_section(run).tables[0]
    (row,) = [dict(zip(table.columns, row, strict=True)) for row in table.rows if tuple(row[:3:2]) == ("map_2", "dwb")]
    assert (row["runs"], round(row["median s"], 1), row["max s"], row["outliers"]) == (19, 23.8, 65.0, 1)
    assert recorded[1].summary.difference in replay.title


@pytest.mark.filterwarnings("error")
def test_a_controller_without_a_run_is_a_line_of_the_table_of_times():
    (row,) = _times_rows({"name": "map_1", "score": None, "runs": {"dwb": []}})
    assert (row[0], row[2], row[3], row[-1]) == ("map_1", "dwb", 0, "no run")


@pytest.mark.parametrize(("elements", "largest"), [([{}, {}], 0.0), ([{"shift": -0.2}, {"gap": 0.1}], 0.2)])
def test_elements_without_deviations_are_a_line_of_the_table_of_genes(elements, largest):
    genes = {"route": {"name": "diagonal"}, "sections": [{"shared": {"gap": 0.8}, "elements": elements}]}
    (row,) = _genes_rows("map_1", Genome(family="gates", genes=genes))
    assert row == ["map_1", "gates", "diagonal", 2, "gap 0.80", largest]


def test_a_rising_line_is_explained():
    assert "it rises where" in _how_to_read("convergence", a_run([-1.0], archive={"elite": True}))
    assert (
        _how_to_read("convergence", a_run([-1.0]))
        == _how_to_read("times", a_run([-1.0], archive={"elite": True}))
        == ""
    )
