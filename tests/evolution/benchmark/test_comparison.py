"""Times measured elsewhere beside ours: a sample of the runner's CSV, made by hand."""

from __future__ import annotations

import json
import math

import pytest

from evolution.benchmark import Benchmark, read_bench
from evolution.benchmark.comparison import compare, our_times, times_of_results
from evolution.cli import main
from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.runner_results import read_runner_results

HEADER = "map,controller,repeat,outcome,time_s,path_length_m\n"
SAMPLE = HEADER + "\n".join(
    [
        "map_1,dwb,0,goal,11.0,8.0",
        "map_1,dwb,1,goal,13.0,8.0",
        "map_1,rpp,0,goal,12.5,8.1",
        "map_2,dwb,0,goal,40.0,9.0",
        "map_2,rpp,0,goal,20.0,9.0",
        "map_3,dwb,0,timeout,150.0,3.0",
        "map_3,rpp,0,goal,30.0,9.0",
        "map_4,mppi,0,goal,9.0,8.0",
    ]
)
OURS = {
    "runs": [
        {"map": name, "controller": controller, "outcome": "goal", "time_s": time}
        for name, controller, time in (
            ("map_1", "dwb", 10.0),
            ("map_1", "rpp", 10.5),
            ("map_2", "dwb", 36.0),
            ("map_2", "rpp", 18.0),
            ("map_3", "dwb", 50.0),
            ("map_3", "rpp", 25.0),
            ("map_5", "rpp", 25.0),
        )
    ]
}


@pytest.fixture
def files(tmp_path):
    (tmp_path / "results.csv").write_text(SAMPLE)
    (tmp_path / "bench.json").write_text(json.dumps(OURS))
    return tmp_path


def test_sample_by_hand(files):
    theirs = times_of_results(read_runner_results(files / "results.csv"))
    comparison = compare(our_times(read_bench(files / "bench.json")), theirs)
    ratios = {(pair.map, pair.controller): pair.ratio for pair in comparison.pairs}
    assert ratios["map_1", "dwb"] == pytest.approx(1.2)
    assert ratios["map_2", "rpp"] == pytest.approx(20 / 18)
    # map_3 is left out: their DWB never arrived. On the others the gap grows from map_1 to map_2 on both sides.
    assert comparison.order_kept == {"map_1": True, "map_2": True}
    assert comparison.correlation[0] == pytest.approx(1.0)
    assert comparison.missing == ("map_5/rpp: not in the results", "map_4/mppi: no run of ours")


def test_failed_runs_count_and_the_slowest_run_does_not_decide():
    """Their mean over the goals would be 34 s, and would not say that a run failed."""
    rows = [("goal", 10.0), ("goal", 80.0), ("goal", 12.0), ("timeout", 150.0), ("error", 0.0)]
    (pair,) = compare({("m", "dwb"): (12.0,)}, our_times(Benchmark(_rows(rows)))).pairs
    assert (pair.ours, pair.theirs, pair.ratio) == (12.0, 12.0, 1.0)
    assert (pair.our_goals, pair.our_runs, pair.their_goals, pair.their_runs) == (1, 1, 3, 4)
    (failed,) = compare({("m", "dwb"): (12.0,)}, our_times(Benchmark(_rows(rows[3:])))).pairs
    assert (failed.their_goals, failed.their_runs, math.isnan(failed.theirs)) == (0, 1, True)


def _rows(runs):
    return tuple({"map": "m", "controller": "dwb", "outcome": outcome, "time_s": time} for outcome, time in runs)


def test_results_on_another_map_of_the_same_name_are_refused(files, capsys):
    head, *rows = SAMPLE.splitlines()
    digests = {row.partition(",")[0]: f"digest of {row.partition(',')[0]}" for row in rows}
    written = [f"{row},{digests[row.partition(',')[0]]}" for row in rows]
    (files / "results.csv").write_text("\n".join([f"{head},digest", *written]))
    argv = ["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]
    for maps, code in (({}, 0), (digests, 0), ({**digests, "map_2": "another"}, 2)):
        (files / "bench.json").write_text(json.dumps({"maps": maps, **OURS}))
        assert main(argv) == code
    assert "expected the map map_2 of ours, got one with other walls, start, goal or people" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("column", "message"),
    [
        ("simulator", "expected runs with one simulator, got 2 (classic, gz)"),
        ("params", "expected runs with one set of parameters and behaviour trees, got 2 (classic, gz)"),
        ("time_limit_s", "expected runs with one time limit, got 2 (classic, gz)"),
    ],
)
def test_results_of_two_simulators_parameters_or_time_limits_are_no_sample(files, capsys, column, message):
    head, first, *rows = SAMPLE.splitlines()
    (files / "results.csv").write_text(
        "\n".join([f"{head},{column}", f"{first},classic", *(f"{one},gz" for one in rows)])
    )
    assert main(["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]) == 2
    assert message in capsys.readouterr().err


def test_changed_order_is_said():
    ours = {("a", "x"): (10.0,), ("a", "y"): (10.0,), ("b", "x"): (10.0,), ("b", "y"): (20.0,)}
    theirs = {("a", "x"): (10.0,), ("a", "y"): (40.0,), ("b", "x"): (10.0,), ("b", "y"): (20.0,)}
    assert compare(ours, theirs).order_kept == {"a": False, "b": False}


@pytest.mark.parametrize("names", ["abc", "acb"])
def test_equal_maps_share_a_rank_whatever_their_order(names):
    ours, theirs = ({(name, "x"): (10.0,) for name in names} for _ in range(2))
    ours |= {("a", "y"): (10.0,), ("b", "y"): (20.0,), ("c", "y"): (30.0,)}
    theirs |= {("a", "y"): (10.0,), ("b", "y"): (30.0,), ("c", "y"): (30.0,)}
    assert compare(ours, theirs).order_kept == {"a": True, "b": True, "c": False}


def test_an_error_is_no_run_and_its_map_has_no_rank(files):
    """An interrupted benchmark leaves a map with fewer controllers, whose Gini score means something else."""
    sample = SAMPLE.replace("map_2,rpp,0,goal,20.0", "map_2,rpp,0,error,0.0") + "\nmap_2,dwb,1,error,900.0,1.0\n"
    (files / "results.csv").write_text(sample)
    theirs = times_of_results(read_runner_results(files / "results.csv"))
    assert theirs["map_2", "dwb"] == (40.0,)
    comparison = compare(our_times(read_bench(files / "bench.json")), theirs)
    assert "map_2/rpp: not in the results" in comparison.missing
    assert comparison.order_kept == {}  # map_1 is left, and a rank among one map says nothing


def test_one_controller_ranks_no_map():
    """Its Gini coefficient is 0 on each map."""
    assert compare(*[{(name, "x"): (time,) for name, time in (("a", 1.0), ("b", 2.0))}] * 2).order_kept == {}


@pytest.mark.parametrize(
    ("theirs", "words"),
    [({("b", "x"): (1.0,)}, r"\(a/x\), got others \(b/x\)"), ({}, r"got no run \(an error is none\)")],
)
def test_nothing_in_common_is_refused(theirs, words):
    with pytest.raises(MapFormatError, match=words):
        compare({("a", "x"): (1.0,)}, theirs)


def test_the_command(files, capsys):
    argv = ["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]
    assert main(argv) == 0
    printed = capsys.readouterr().out
    assert "rank correlation" in printed
    assert "0/1" in printed  # their DWB on map_3
    assert main([*argv, "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["order_kept"] == {"map_1": True, "map_2": True}


def test_their_contacts_are_said(files, capsys):
    argv = ["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]
    rows = zip(SAMPLE.splitlines(), ("contacts", "2", "0", "1", "0", "0", "0", "0", "0"), strict=True)
    (files / "results.csv").write_text("\n".join(f"{line},{contacts}" for line, contacts in rows) + "\n")
    assert main(argv) == 0
    assert "2 of their 8 runs touched something" in capsys.readouterr().out
    assert main([*argv, "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["touched"] == 2


def test_a_file_that_was_joined_to_itself_is_refused(files, capsys):
    error = "map_1,dwb,0,error,0.0,0.0"
    argv = ["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]
    (files / "results.csv").write_text("\n".join([SAMPLE, error, error]))
    assert main(argv) == 0
    (files / "results.csv").write_text("\n".join([SAMPLE, SAMPLE.splitlines()[2]]))
    assert main(argv) == 2
    assert "expected one line for each run, got 2 of map_1/dwb, repeat 1" in capsys.readouterr().err


def test_two_times_of_one_run_are_refused(files, capsys):
    """An error and the run that ``--resume`` drove again are one run."""
    argv = ["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]
    map_, controller, repeat, _, _, length = SAMPLE.splitlines()[2].split(",")
    (files / "results.csv").write_text("\n".join([SAMPLE, f"{map_},{controller},{repeat},error,3.0,{length}"]))
    assert main(argv) == 0
    (files / "results.csv").write_text("\n".join([SAMPLE, f"{map_},{controller},{repeat},goal,99.5,{length}"]))
    assert main(argv) == 2
    assert "expected one line for each run, got 2 of map_1/dwb, repeat 1" in capsys.readouterr().err


def test_a_table_that_a_windows_program_saved_is_read(files):
    (files / "results.csv").write_text(SAMPLE, encoding="utf-8-sig")
    assert len(read_runner_results(files / "results.csv")) == 8


def test_a_comparison_is_no_benchmark(files, capsys):
    rows = [{**row, "configuration": "a"} for row in OURS["runs"]]
    (files / "bench.json").write_text(json.dumps({"runs": rows, "parameters": []}))
    assert main(["import-results", str(files / "results.csv"), "--ours", str(files / "bench.json")]) == 2
    assert "expected a run or a benchmark, got" in (error := capsys.readouterr().err)
    assert error.endswith("bench.json, a comparison\n")


def test_files_of_another_kind(files, capsys):
    bench = files / "bench.json"
    for text, reason in (
        ("[]", "expected a JSON object, got list"),
        ("{", "not a JSON file"),
        ('{"runs": [{"map": "a"}]}', "line 1: controller: is missing"),
        (None, "expected the directory of a run (config.json), study"),
    ):
        bench.write_text(text) if text else bench.unlink()
        assert main(["import-results", str(files / "results.csv"), "--ours", str(bench)]) == 2
        line = capsys.readouterr().err
        assert f"{bench}: {reason}" in line
        assert "Error" not in line


def test_directory_of_a_benchmark(files, capsys):
    argv = ["import-results", str(files / "results.csv"), "--format", "json", "--ours"]
    assert main([*argv, str(files)]) == 0
    of_directory = capsys.readouterr().out
    assert main([*argv, str(files / "bench.json")]) == 0
    assert of_directory == capsys.readouterr().out


@pytest.mark.parametrize(
    ("count", "said"),
    [(1, "none"), (3, "1.000 (too few pairs for an interval)"), (4, "too few"), (6, "95 % interval 0.360 to 1.000")],
)
def test_interval_only_of_enough_pairs(count, said, files, capsys):
    ours, theirs = files / "ours.json", files / "theirs.csv"
    rows = [
        {"map": name, "controller": "rpp", "outcome": "goal", "time_s": 10.0 + i} for i, name in enumerate("abcdef")
    ]
    ours.write_text(json.dumps({"runs": rows[:count]}))
    theirs.write_text(HEADER + "".join(f"{row['map']},rpp,0,goal,{row['time_s']},8.0\n" for row in rows[:count]))
    assert main(["import-results", str(theirs), "--ours", str(ours)]) == 0
    assert said in capsys.readouterr().out
