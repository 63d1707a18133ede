"""What commands say besides their results: --quiet and --verbose, which every command and every action of one has."""

from __future__ import annotations

import argparse
import io
import logging
import re
import shlex
import sqlite3
from contextlib import closing
from dataclasses import replace
from types import SimpleNamespace

import pytest
from rich.console import Console

from controllers.nav2_params import load_preset
from evolution.cli import build_parser, main
from evolution.commands import COMMANDS, COMMON, console, progress
from evolution.commands.console import PACKAGES
from evolution.commands.progress import RunsPerSecond, SearchBar, WorkBar, best_in_words
from evolution.commands.run_notes import note_errors
from evolution.driving import ControllerSpec, DriveSettings, JobPlan, ResultStore, RunResult
from evolution.files import Table
from evolution.search import EvolveSettings
from gym_mapbench.mapio import load_scenarios
from tests.evolution.commands.test_cli import OFFICE, refused

EXAMPLE = ["bench", OFFICE, "--controllers", "rpp", "--time-limit", "2", "--workers", "1"]


def parsers(parser, words=()):
    """All parsers of commands and of their actions, with the words that lead to them."""
    found = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    for name, one in (pair for action in found for pair in action.choices.items()):
        yield (*words, name), one
        yield from parsers(one, (*words, name))


def test_every_command_and_every_action_has_them():
    everyone = dict(parsers(build_parser(None)))
    assert {words[0] for words in everyone} == set(COMMANDS)
    assert {("maps", "draw"), ("params", "check")} <= set(everyone)
    for words, parser in everyone.items():
        assert set(COMMON) <= {action.dest for action in parser._actions}, words


def test_an_action_does_not_undo_what_stands_before_its_name():
    parser = build_parser("maps")
    before = argparse.Namespace(**COMMON)
    assert parser.parse_args(["maps", "--quiet", "info", OFFICE], before).quiet
    assert parser.parse_args(["maps", "info", OFFICE, "--verbose"], argparse.Namespace(**COMMON)).verbose


def test_how_many_runs_ended_in_an_error_is_said(capsys, tmp_path):
    with ResultStore(tmp_path / "results.sqlite") as store:
        store.put("a", RunResult("goal", 1.0, 1.0))
        note_errors(tmp_path)
        assert capsys.readouterr().err == ""
        store.put("b", RunResult("error", 0.0, 0.0, reason="the worker died"))
    note_errors(tmp_path)
    counted, how = capsys.readouterr().err.splitlines()
    assert counted == "1 of 2 runs ended in an error, the first because: the worker died"
    statement = shlex.split(how.partition("first: ")[2])[-1]
    with closing(sqlite3.connect(tmp_path / "results.sqlite", isolation_level=None)) as database:
        assert database.execute(statement).rowcount == 1
    with ResultStore(tmp_path / "results.sqlite") as store:
        assert (len(store), store.errors()) == (1, [])


def test_verbose_says_where_everything_comes_from_and_how_runs_end(capsys, tmp_path):
    load_preset.cache_clear()  # an earlier test may have read it
    assert main([*EXAMPLE, "--verbose", "--out", str(tmp_path / "kept"), "--format", "json"]) == 0
    said = capsys.readouterr().err
    for expected in (
        f"{OFFICE}: read as map_server",
        "thesis.yaml: read",
        "seed 0 (not given); controllers: rpp",
        "new directory of a benchmark",
        "office, rpp, repeat 0: timeout after 2.00 s (the time limit was reached",
        "mapbench 0.1.0, python",
    ):
        assert expected in said
    assert main(EXAMPLE) == 0
    assert "repeat 0: timeout" not in capsys.readouterr().err
    assert all(logging.getLogger(package).handlers == [] for package in PACKAGES)


def test_where_no_bar_is_seen_lines_say_how_far_it_is(capsys, monkeypatch):
    monkeypatch.setattr(progress, "SECONDS_PER_LINE", 0.0)
    assert main([*EXAMPLE, "--repeats", "2"]) == 0
    said = capsys.readouterr().err
    assert "1 of 2 runs done" in said
    assert "2 of 2 runs done" in said


@pytest.fixture
def terminal(monkeypatch):
    """A terminal of 80 columns in place of standard error; what is drawn there."""
    drawn = io.StringIO()
    monkeypatch.setattr(progress, "notes", Console(file=drawn, force_terminal=True, width=80, height=40))
    return drawn


def lines(terminal):
    """What a terminal shows, without control sequences, line by line."""
    return re.sub(r"\x1b\[[?\d;]*[A-Za-z]", "", terminal.getvalue()).replace("\r", "\n").splitlines()


def test_a_bar_is_drawn_before_anybody_knows_how_much_there_is_to_do(terminal):
    job = JobPlan((ControllerSpec(name="rpp"),), DriveSettings(navigation="thesis")).jobs(load_scenarios(OFFICE)[0])[0]
    with WorkBar("driving") as bar:
        assert "0/?" in lines(terminal)[0]
        bar.advance(job, RunResult("controller_failure", 3.0, 1.0), 2)
        bar.bar.refresh()
    shown = [line for line in lines(terminal) if "1/3" in line]
    assert "office rpp: controller_failure" in shown[-1]
    assert max(map(len, shown)) <= 80


def test_numbers_and_time_stay_whole_beside_a_long_state(terminal):
    scenario = replace(load_scenarios(OFFICE)[0], name="a_map_of_a_long_name_as_of_a_minimal_one")
    job = JobPlan((ControllerSpec(name="rpp"),), DriveSettings(navigation="thesis")).jobs(scenario)[0]
    with WorkBar("minimization") as bar:
        bar.advance(job, RunResult("controller_failure", 3.0, 1.0), 122)
        bar.bar.refresh()
    shown = [line.rstrip() for line in lines(terminal) if line.strip()]
    assert all(line.startswith("minimization ") for line in shown)
    assert "  1/123 a_map_of" in shown[-1]
    assert shown[-1].endswith(("left", "so far"))
    assert max(map(len, shown)) <= 80


def test_a_search_says_beside_its_bar_how_far_it_is(terminal):
    row = {"generation": 12, "evaluations": 30, "best": 5578.0, "mean_success_rate": 0.5}
    with SearchBar(EvolveSettings(runs=900)) as bar:
        bar.on_generation(SimpleNamespace(row=row, driven=345, reused=0, replayed=False, seconds=1.0))
        bar.bar.refresh()
    shown = [line for line in lines(terminal) if "345/900" in line]
    assert "gen 12 done, no good set yet" in shown[-1]
    assert max(map(len, shown)) <= 80


def test_quiet_says_nothing_but_results(capsys):
    assert main([*EXAMPLE, "--quiet"]) == 0
    output = capsys.readouterr()
    assert output.err == ""
    assert "office" in output.out


def test_they_exclude_each_other(capsys):
    assert "--verbose: not allowed with argument --quiet" in refused(capsys, "list", "--quiet", "--verbose")


@pytest.mark.parametrize(
    ("fitness", "expected"),
    [
        (-2.9224, "best fitness -2.92 (lower is better)"),
        (5578.0, "no set yet that all controllers solve"),
        (0.0, "best fitness 0"),
    ],
)
def test_penalties_are_no_numbers_for_a_reader(fitness, expected):
    assert expected in best_in_words(fitness)


def test_a_table_fits_a_narrow_terminal(monkeypatch):
    drawn = io.StringIO()
    monkeypatch.setattr(console, "console", Console(file=drawn, width=80))
    row = {"map": "office", "controller": "rpp", "goals": "3/5", "mean s": 36.1, "min s": 27.6, "max s": 53.0}
    row |= {"length m": 10.5, "clearance m": 0.057, "recoveries": 9.4, "otherwise": "2 controller_failure"}
    console.print_table(Table([row]))
    words = drawn.getvalue().split()
    assert {"controller", "clearance", "recoveries", "otherwise", "27.6", "0.057"} <= set(words)
    assert not any("…" in word for word in words)
    console.print_table(Table([{**row, "otherwise": ""}]))
    assert drawn.getvalue().count("otherwise") == 1


@pytest.mark.parametrize("width", [50, 60, 80])
def test_no_word_of_a_table_is_broken_and_every_block_says_which_row_it_is_about(monkeypatch, width):
    drawn = io.StringIO()
    monkeypatch.setattr(console, "console", Console(file=drawn, width=width))
    row = {"map": "a_long_name_003", "controller": "rpp", "mean s": 36.1, "length m": 10.5, "clearance m": 0.057}
    row |= {"velocity_smoothness": 0.123, "n_collisions_with_people": 2, "otherwise": "2 controller_failure, 1 timeout"}
    console.print_table(Table([row, {**row, "controller": "mppi", "otherwise": ""}], "The title"))
    lines = drawn.getvalue().splitlines()
    assert max(map(len, lines)) <= width
    words = drawn.getvalue().split()
    assert {"smoothness", "collisions_", "people", "clearance", "controller_failure,", "timeout", "0.123"} <= set(words)
    assert words.count("title") == 1
    headed = [line for line in lines if line.startswith("a_long_name_003") and "mppi" in line]
    assert len(headed) == words.count("map") > 1


def test_slow_rates_are_counted_by_the_minute(monkeypatch):
    speed = RunsPerSecond()
    speed.runs = 12
    monkeypatch.setattr(progress.time, "perf_counter", lambda: speed.began + 2.0)
    assert str(speed) == "6.0 runs/s"
    monkeypatch.setattr(progress.time, "perf_counter", lambda: speed.began + 600.0)
    assert str(speed) == "1.2 runs/min"
