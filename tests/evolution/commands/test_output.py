"""What a command writes where: nothing but results on standard output, and nothing where it only reads."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from evolution import bench
from evolution.benchmark import Benchmark
from evolution.cli import main
from evolution.commands.bench import print_benchmark
from evolution.report.writing import write_report
from tests.evolution.fake_study import part_of, use_fakes

OFFICE = Path(__file__).resolve().parents[3] / "examples" / "office.yaml"


def test_a_controller_that_prints_does_not_break_json():
    command = [sys.executable, "-m", "evolution", "bench", str(OFFICE), "--time-limit", "1", "--workers", "1"]
    command += ["--format", "json", "--controllers", "talker=tests.evolution.talkative:Talker"]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    (run,) = json.loads(done.stdout)["runs"]
    assert run["controller"] == "talker"
    for text in ("a controller says hello", "so does its library", "in C"):
        assert text in done.stderr


def test_several_maps_are_summed_up_with_intervals_and_one_is_not(capsys):
    def driven(controller, count, time):
        run = {"controller": controller, "repeat": 0, "outcome": "goal", "time_s": time}
        return [{**run, "map": f"map_{number}"} for number in range(count)]

    print_benchmark(Benchmark((*driven("a", 6, 10.0), *driven("b", 6, 8.0))), "table")
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert "│ success % │ 100 (61 to 100) │ 100 (61 to 100) │" in lines
    assert "│ b against a │ 6 │ 0 (-39 to 39) │ 6 │ 2 │ 0.031 │" in lines
    print_benchmark(Benchmark((*driven("a", 1, 10.0),)), "table")
    assert "success %" not in capsys.readouterr().out


def contents(path):
    return {str(one): one.read_bytes() for one in sorted(path.rglob("*")) if one.is_file()}


def test_a_report_elsewhere_writes_nothing_into_the_directory(study_path, tmp_path, monkeypatch):
    use_fakes(monkeypatch)
    study = part_of(study_path, tmp_path / "study", ["gini_6"])
    before = contents(study)
    for path in (study, study / "runs" / "gini_6" / "seed-0000"):
        page = write_report(path, tmp_path / f"{path.name}.html")
        assert page.read_text(encoding="utf-8").count("data:image/png") > 2
    assert contents(study) == before


def test_a_run_may_take_as_long_as_told(tmp_path):
    sleeper = "sleeper=tests.evolution.talkative:Sleeper"
    result = bench(OFFICE, [sleeper], run_timeout_s=0.5, workers=1)
    assert result.failures == ["office/sleeper: no answer within 0.5 s (--run-timeout)"]


@pytest.mark.parametrize("option", ["--run-timeout=0", "--run-timeout=x", "--repeats=999999999"])
def test_options_that_nobody_can_mean(option, capsys):
    try:
        code = main(["bench", str(OFFICE), option])
    except SystemExit as error:
        code = error.code
    assert code == 2
    assert len(capsys.readouterr().err.splitlines()) == 1
