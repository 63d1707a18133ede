"""The command as a user meets it: what it prints, what it writes, and one line for every mistake."""

from __future__ import annotations

import csv
import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from controllers.nav2_params import read_nav2_params
from evolution.__main__ import run
from evolution.api import bench
from evolution.cli import build_parser, main
from evolution.commands import WITH_WORKERS
from evolution.driving import DriveSettings, check_room
from evolution.runs.loading import load_run
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.errors import ConfigError
from gym_mapbench.generator import ShapeSettings, make_family
from gym_mapbench.mapio import load_scenarios
from gym_mapbench.world.scenario import Pose
from tests.evolution import fake_runs
from tests.mapio.samples import barn_world

EXAMPLES = Path(__file__).resolve().parents[3] / "examples"
OFFICE = str(EXAMPLES / "office.yaml")


@pytest.fixture
def office(tmp_path):
    """A copy of the example map that a test may spoil."""
    for file in EXAMPLES.glob("office*"):
        shutil.copy(file, tmp_path)
    return tmp_path / "office.yaml"


def refused(capsys, *argv):
    """Run a command that must be refused: exit code 2, one line, no traceback; returns the line."""
    try:
        code = main([str(arg) for arg in argv])
    except SystemExit as stop:
        code = stop.code
    output = capsys.readouterr()
    assert code == 2
    assert output.err.startswith("mapbench")
    assert output.err.count("\n") == 1, output.err
    assert "Traceback" not in output.err
    return output.err


def test_commands_that_drive_in_workers_are_those_with_an_option_for_them():
    (subparsers,) = [action for action in build_parser()._actions if isinstance(action.choices, dict)]
    with_option = {name for name, parser in subparsers.choices.items() if "--workers" in parser.format_help()}
    assert with_option == WITH_WORKERS


@pytest.mark.parametrize("place", ["start", "load_command", "build_parser"])
def test_ctrl_c_before_a_command_runs_is_one_line(monkeypatch, capsys, place):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(f"evolution.cli.{place}", interrupt)
    monkeypatch.setattr("sys.argv", ["mapbench", "list", "maps"])
    assert run() == 130
    assert capsys.readouterr().err == "mapbench: interrupted\n"


@pytest.mark.parametrize(
    ("argv", "expected"),
    [
        (["bench", "nowhere.yaml"], "nowhere.yaml"),
        (["bench", OFFICE, "--controllers", "mpi"], "did you mean 'mppi'"),
        (["bench", OFFICE, "--controllers", "dwb,,rpp"], "--controllers"),
        (["bench", OFFICE, "--scheduler", "tcp://host:1"], "executor 'processes': takes no scheduler, got 'tcp://host"),
        (["bench", OFFICE, "--controllers", "=dwb"], "expected NAME or NAME=KIND, got '=dwb'"),
        (["bench", OFFICE, "--controllers", "dwb="], "expected NAME or NAME=KIND, got 'dwb='"),
        (["bench", OFFICE, "--controllers", "sac=nowhere.zip"], "nowhere.zip"),
        (["bench", OFFICE, "--start", "1,2,3,4"], "x,y,yaw"),
        (["bench", OFFICE, "--start", "nan,1,0"], "finite"),
        (["bench", OFFICE, "--goal", "-inf,1,0"], "finite"),
        (["bench", OFFICE, "--start", "-2,-1,0"], "on the map"),
        (["bench", OFFICE, "--goal", "99,99,0"], "on the map"),
        (["bench", OFFICE, "--start", "0.01,0.01,0"], "obstacle"),
        (["bench", OFFICE, "--robot-radius", "3"], "office: start: expected room for the robot"),
        (["drive", OFFICE, "--controller", "rpp", "--start", "0.1,3,0"], "office: start: expected room for the robot"),
        (["evolve", "--robot-radius", "2"], "generated maps: start: expected room for the robot"),
        (["bench", OFFICE, "--repeats", "0"], "at least 1"),
        (["bench", OFFICE, "--robot", "turtlebot"], "turtlebot3"),
        (["bench", OFFICE, "--robot-radius", "-1"], "--robot-radius: expected a finite number above 0"),
        (["bench", OFFICE, "--robot", "jackal", "--robot-radius", "0.2"], "--robot"),
        (["bench", OFFICE, "--time-limit", "0"], "--time-limit: expected a finite number above 0"),
        (["bench", OFFICE, "--lo", "nan"], "--lo: expected a finite number above 0"),
        (["bench", OFFICE, "--out", "/dev/null/results"], "/dev/null/results: cannot be made"),
        (["bench", OFFICE, "--resume"], "--resume: expected the directory to continue, --out DIR"),
        (["bench", OFFICE, "--resume", "--out", "/nowhere"], "/nowhere: not a benchmark directory"),
        (["bench", OFFICE, "--params", "nowhere.yaml"], "nowhere.yaml"),
        (
            ["bench", OFFICE, "--params", "fairr"],
            "a file or one of the presets thesis, fair, jazzy, jazzy_fair, lyrical, lyrical_fair, got 'fairr'",
        ),
        (["bench", OFFICE, "barn:somewhere"], "BARN"),
        (["drive", OFFICE, "--controller", "rpp,dwb"], "one controller"),
        (["drive", OFFICE, "--controller", "rpp", "--scenario", "7"], "1 to 1"),
        (["drive", OFFICE, "--controller", "rpp", "--gif", "film.avi"], ".gif"),
        (["drive", OFFICE, "--controller", "rpp", "--gif", "/nope/film.gif"], "a directory that can be written"),
        (["evolve", "--preset", "quik"], "quick"),
        (["evolve", "--family", "doors,dors"], "unknown family 'dors'; did you mean 'doors'"),
        (["evolve", "--family", "doors", "--robot-radius", "0.5"], "doors: expected maps that custom can drive"),
        (["evolve", "--resume", "nowhere", "--family", "doors"], "--family"),
        (["maps", "draw", "--family", "doors,", "--out", "x"], "--family: expected names separated by commas"),
        (["maps", "draw", "--family", "pillar", "--out", "x"], "did you mean 'pillars'"),
        (["maps", "draw", "--count", "0", "--out", "x"], "at least 1"),
        (["evolve", "--pop-size", "9", "--evaluations", "3"], "evaluations"),
        (["evolve", "--objectives", "my:Own,n_obstacles"], "or another one with --fitness, got my:Own, n_obstacles"),
        (["evolve", "--objectives", "gini,gini"], "--objectives: expected different names, got gini, gini"),
        (["evolve", "--metric", "foo"], "(expected one of: barn_score, curvature,"),
        (["evolve", "--controllers", "rpp"], "expected two or more to compare, got rpp alone"),
        (["evolve", "--metric", "time", "--failures", "never"], "never"),
        (["evolve", "--resume", "nowhere"], "nowhere"),
        (["evolve", "--resume", "nowhere", "--pop-size", "9"], "--pop-size"),
        (["evolve", "--resume", "nowhere", "--seed", "0"], "--seed"),
        (["evolve", "--resume", "nowhere", "--people", "0"], "--people"),
        (["bench", OFFICE, "--lo", "4"], "--lo: expected barn:DIR beside it"),
        (["evolve", "--config", "nowhere.yaml"], "nowhere.yaml"),
        (["validate", "nowhere"], "nowhere"),
        (["maps", "info", "nowhere.map"], "nowhere.map"),
        (["export", OFFICE, "--format", "gazeboo", "--out", "x"], "gazebo"),
        (["import-results", "nowhere.csv", "--ours", "nowhere"], "nowhere"),
        (["evolv"], "evolve"),
        (["--quiet", "bench", OFFICE], "mapbench: --quiet: expected COMMAND first, as in mapbench bench --quiet"),
        (["evolve", "foo"], "mapbench evolve: unrecognized arguments: foo"),
        (["bench", OFFICE, "--contrllers=dwb"], "--contrllers=dwb; did you mean '--controllers'?"),
        (["bnch", OFFICE], "; did you mean 'bench'?"),
        (["maps", "convert", OFFICE, "b.yaml", "--start", "1,1,0"], "mapbench maps convert: unrecognized arguments"),
    ],
    ids=lambda value: " ".join(Path(part).name for part in value) if isinstance(value, list) else "",
)
def test_mistakes_get_one_line(argv, expected, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert expected in refused(capsys, *argv)
    assert not list(tmp_path.iterdir())


def test_poses_may_be_negative(tmp_path, capsys):
    (tmp_path / "room.pgm").write_bytes(b"P5 200 120 255\n" + bytes([254]) * 24000)
    room = tmp_path / "room.yaml"
    room.write_text(
        "{image: room.pgm, resolution: 0.05, origin: [-5, -3, 0], negate: 0, occupied_thresh: 0.65, free_thresh: 0.2}"
    )
    assert main(["maps", "info", str(room), "--start", "-2,-1,0", "--goal", "-.5,2,-1", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["tasks"] == 1


def test_what_cannot_be_written_gets_one_line(tmp_path, capsys, monkeypatch):
    def fail(*_):
        raise OSError(28, "No space left on device", "film.gif")

    monkeypatch.setattr("evolution.commands.maps.write_map_file", fail)
    line = refused(capsys, "maps", "convert", OFFICE, tmp_path / "b.yaml")
    assert line == "mapbench maps: film.gif: No space left on device\n"


def test_one_map_without_room_spoils_no_benchmark(caplog):
    (free,), settings = load_scenarios(OFFICE), DriveSettings(navigation="thesis")
    blocked = replace(free, start=Pose(0.1, 3.0, 0.0))
    check_room([free], settings)
    assert not caplog.messages
    check_room([blocked, free, blocked], settings)
    (said,) = caplog.messages
    assert said.startswith("no room for the robot in 2 of 3 tasks,")
    assert "the first is office: start: expected room" in said
    with pytest.raises(ConfigError, match="office: start: expected room"):
        check_room([blocked, blocked], settings)


def test_options_of_the_environment_without_an_effect_on_controllers_are_named(caplog):
    settings = DriveSettings(navigation="thesis", environment={"robot": "jackal", "noise": "nominal"})
    check_room(load_scenarios(OFFICE), settings)
    assert not caplog.messages
    changed = settings.environment.replace(family="doors", start=(1.0, 1.0, 0.0), reward={"time": 1.0})
    check_room(load_scenarios(OFFICE), settings.replace(environment=changed))
    (said,) = caplog.messages
    assert said.startswith("environment: start, family, reward have no effect here: maps and tasks are given apart")


def test_controllers_faster_than_the_world_are_refused(tmp_path, capsys):
    params, config = tmp_path / "fast.yaml", tmp_path / "config.yaml"
    params.write_text("controller_server: {ros__parameters: {controller_frequency: 100.0}}\n")
    config.write_text(f"run: {{navigation: {params}}}\n")
    line = refused(capsys, "evolve", "--config", config, "--out", tmp_path / "out")
    assert "controller_frequency: expected at most the env's rate of control, 20 Hz, got 100" in line
    assert not (tmp_path / "out").exists()


@pytest.fixture
def fake_robot(monkeypatch):
    """Runs without a robot, of which those of the controller ``raises`` end in an error."""
    for place in ("evolution.api.searches", "evolution.api.benchmarks"):
        monkeypatch.setattr(f"{place}.run_job", fake_runs.misbehave)
    for place in ("evolution.api.searches", "evolution.runs.exclusive"):
        monkeypatch.setattr(f"{place}.preparation_of", lambda *_: fake_runs.touch_warm_up)
    monkeypatch.setattr("evolution.api.searches.write_run_figures", lambda *_, **__: None)


SMALL_SEARCH = ["evolve", "--preset", "quick", "--pop-size", "2", "--evaluations", "2", "--maps-per-set", "2"]
WITH_ERRORS = ["--controllers", "rpp,raises=rpp", "--workers", "1"]


@pytest.mark.usefixtures("fake_robot")
def test_errors_are_listed_under_the_table(tmp_path, capsys):
    assert main(["bench", OFFICE, "--repeats", "2", *WITH_ERRORS, "--out", str(tmp_path / "kept")]) == 0
    said = capsys.readouterr()
    assert said.out.count("office/raises: ValueError: the costmap is upside down, fake_runs.py") == 1
    assert "2 of 4 runs ended in an error" in said.err
    assert "To repeat them as they are, delete them first: sqlite3" in said.err


@pytest.mark.usefixtures("fake_robot")
@pytest.mark.parametrize("compared", [[], ["--params", "a=thesis", "--params", "b=fair"]])
def test_a_benchmark_whose_runs_all_end_in_an_error_has_not_succeeded(capsys, compared):
    """A CI without rules would take it for done."""
    assert main(["bench", OFFICE, "--controllers", "raises=rpp", "--workers", "1", "--format", "csv", *compared]) == 2
    said = capsys.readouterr()
    assert "error" in said.out
    assert "every run ended in an error, the first because: ValueError: the costmap is upside down" in said.err


@pytest.mark.usefixtures("fake_robot")
def test_barns_scores_say_that_the_global_costmap_knows_the_map(tmp_path, capsys):
    (tmp_path / "world_0.world").write_text(barn_world([(0, 0), (1, 0)]))
    np.save(tmp_path / "path_0.npy", np.array([[15, 0], [15, 29]]))
    argv = ["bench", f"barn:{tmp_path}", "--controllers", "rpp", "--workers", "1"]
    assert main(argv) == 0
    assert "--unknown-map runs without the map" in capsys.readouterr().err
    assert main([*argv, "--unknown-map"]) == 0
    said = capsys.readouterr().err
    assert "BARN rpp: " in said
    assert "--unknown-map" not in said


@pytest.mark.usefixtures("fake_robot")
def test_one_world_of_barn_is_scored_as_its_folder(tmp_path, capsys):
    (tmp_path / "world_0.world").write_text(barn_world([(0, 0), (1, 0)]))
    np.save(tmp_path / "path_0.npy", np.array([[15, 0], [15, 29]]))
    for source in (f"barn:{tmp_path}", f"barn:{tmp_path / 'world_0.world'}"):
        assert main(["bench", source, "--controllers", "rpp", "--workers", "1"]) == 0
        assert "  world_0: " in capsys.readouterr().err


@pytest.mark.parametrize("option", ["--robot jackal", "--robot-radius 1", "--time-limit 9", "--contact ends"])
@pytest.mark.parametrize("command", [["bench"], ["drive", "--controller", "rpp"]])
def test_options_that_barns_rules_set_are_refused_beside_it(tmp_path, capsys, command, option):
    (tmp_path / "world_0.world").write_text(barn_world([(0, 0)]))
    assert main([*command, f"barn:{tmp_path}", *option.split()]) == 2
    assert f"{option.split()[0]}: expected none beside barn:DIR" in capsys.readouterr().err


def test_a_single_run_on_a_world_of_barn_is_that_of_the_benchmark(tmp_path, capsys):
    (tmp_path / "world_0.world").write_text(barn_world([(0, 0)]))
    assert main(["drive", f"barn:{tmp_path}", "--controller", "rpp"]) == 0
    (row,) = bench(f"barn:{tmp_path}", "rpp", workers=1).rows
    assert f"rpp: goal after {row['time_s']:.2f} s" in capsys.readouterr().out


@pytest.mark.usefixtures("fake_robot")
def test_a_missing_path_of_barn_is_told_before_the_runs(tmp_path, capsys):
    (tmp_path / "world_0.world").write_text(barn_world([(0, 0)]))
    assert main(["bench", f"barn:{tmp_path}", "--controllers", "rpp", "--workers", "1"]) == 2
    said = capsys.readouterr()
    assert "expected its published path (path_0.npy) nearby" in said.err
    assert said.out == ""


@pytest.mark.usefixtures("fake_robot")
def test_errors_of_a_search_are_counted(tmp_path, capsys):
    assert main([*SMALL_SEARCH, *WITH_ERRORS, "--out", str(tmp_path / "run")]) == 0
    last = (
        "4 of 8 runs ended in an error, the first because: ValueError: the costmap is upside down, fake_runs.py line "
    )
    *_, counted, how = capsys.readouterr().err.splitlines()
    assert last in counted
    assert how.startswith("--resume does not repeat them, as the search has selected by them.")


@pytest.mark.usefixtures("fake_robot")
def test_controllers_of_a_users_parameters_drive_unless_others_are_named(tmp_path, capsys):
    def searched(name, *argv):
        out = tmp_path / name
        assert main([*SMALL_SEARCH, *argv, "--params", params, "--workers", "1", "--out", str(out)]) == 0
        return load_run(out).controllers

    params, config = str(EXAMPLES / "nav2_params.yaml"), tmp_path / "config.yaml"
    assert main(["bench", OFFICE, "--params", params, "--workers", "1", "--format", "json"]) == 0
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert [run["controller"] for run in runs] == ["FollowPath", "Pursuit"]
    config.write_text("controllers: [mppi, dwb]\n")
    assert searched("listed") == ("FollowPath", "Pursuit")
    assert searched("configured", "--config", str(config)) == ("mppi", "dwb")
    assert searched("named", "--config", str(config), "--controllers", "dwb,Pursuit") == ("dwb", "Pursuit")
    bundle = tmp_path / "bundle"
    assert main(["export", OFFICE, "--format", "gazebo", "--params", params, "--out", str(bundle)]) == 0
    (exported,) = bundle.rglob("nav2_params.yaml")
    assert list(read_nav2_params(exported).navigation.controllers)[:2] == ["FollowPath", "Pursuit"]


def test_truncated_picture_is_refused(office, capsys):
    picture = office.with_suffix(".pgm")
    picture.write_bytes(picture.read_bytes()[:1000])
    assert "office.pgm" in refused(capsys, "bench", office)


def test_used_directories_are_refused(tmp_path, capsys):
    used = tmp_path / "used"
    used.mkdir()
    (used / "precious.txt").write_text("mine")
    for argv in (
        ["evolve", "--out", used],
        ["bench", OFFICE, "--out", used],
        ["export", OFFICE, "--format", "map_server", "--out", used],
    ):
        refused(capsys, *argv)
    assert [path.name for path in used.iterdir()] == ["precious.txt"]


def test_unknown_keys_of_a_config_file(tmp_path, capsys):
    config = tmp_path / "config.yaml"
    config.write_text("search: {pop_sise: 4}\n")
    assert "pop_size" in refused(capsys, "evolve", "--config", config)
    config.write_text("serch: {}\n")
    assert "'search'" in refused(capsys, "evolve", "--config", config)
    config.write_text("search: {pop_size: 4}\nrun:\n")
    expected = f"{config}: run: expected a mapping of options, got nothing"
    assert expected in refused(capsys, "evolve", "--config", config)


def test_bench_as_json_and_csv(tmp_path, capsys):
    out = tmp_path / "out"
    argv = ["bench", OFFICE, "--controllers", "rpp,slow=rpp", "--repeats", "2", "--workers", "1", "--out", str(out)]
    assert main([*argv, "--format", "json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    runs = printed["runs"]
    assert [(run["controller"], run["repeat"]) for run in runs] == [("rpp", 0), ("rpp", 1), ("slow", 0), ("slow", 1)]
    assert {run["outcome"] for run in runs} == {"goal"}
    assert runs[0]["time_s"] == runs[1]["time_s"]  # no noise: nothing differs
    assert all(run["path_length_m"] > 8 for run in runs)
    assert json.loads((out / "bench.json").read_text()) == printed
    with (out / "bench.csv").open() as file:
        assert [row["outcome"] for row in csv.DictReader(file)] == ["goal"] * 4
    assert main([*argv, "--resume", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out) == printed


def test_a_users_parameters_say_what_is_ignored(capsys):
    params = str(EXAMPLES / "nav2_params.yaml")
    argv = ["bench", OFFICE, "--controllers", "Pursuit", "--params", params, "--workers", "1", "--time-limit", "5"]
    code = main(argv)
    output = capsys.readouterr()
    assert code == 0
    assert "read as Nav2 Humble" in output.err
    assert "that mean nothing without ROS" in output.err
    assert "FollowPath.debug_trajectory_details" not in output.err
    assert "Pursuit" in output.out
    assert main([*argv, "--verbose"]) == 0
    assert "FollowPath.debug_trajectory_details" in capsys.readouterr().err


def test_drive_writes_a_film(tmp_path, capsys):
    film = tmp_path / "film.gif"
    argv = ["drive", OFFICE, "--controller", "rpp", "--time-limit", "2", "--gif", str(film)]
    assert main(argv) == 0
    assert film.read_bytes().startswith(b"GIF89a")
    assert "timeout" in capsys.readouterr().out
    assert "nothing is overwritten" in refused(capsys, *argv)


@pytest.mark.usefixtures("fake_robot")
def test_the_maps_of_a_run_are_driven_in_its_world_by_its_controllers(tmp_path, monkeypatch, capsys):
    out, jobs = tmp_path / "run", []
    search = [
        *SMALL_SEARCH,
        "--noise",
        "rough",
        "--time-limit",
        "33",
        "--controllers",
        "mine=rpp,dwb",
        "--workers",
        "1",
    ]
    assert main([*search, "--out", str(out)]) == 0
    monkeypatch.setattr("evolution.commands.drive.drive", lambda job, _: jobs.append(job) or sys.exit(7))
    for more in (["mine"], ["mine", "--noise", "none"], ["dwb"]):
        with pytest.raises(SystemExit, match="7"):
            main(["drive", str(out), "--controller", *more])
    assert [job.controller.registered_name for job in jobs] == ["rpp", "rpp", "dwb"]
    assert [job.settings.environment.noise == EnvConfig.build(noise="rough").noise for job in jobs] == [
        True,
        False,
        True,
    ]
    assert {job.settings.environment.time_limit for job in jobs} == {33.0}
    assert "expected names separated by commas" in refused(capsys, "drive", out, "--controller", "")
    capsys.readouterr()
    argv = ["bench", str(out), "--controllers", "mine,dwb", "--workers", "1", "--format", "csv"]
    assert main(argv) == 0
    assert {line.split(",")[1] for line in capsys.readouterr().out.splitlines()[1:]} == {"mine", "dwb"}
    assert "mine" in refused(capsys, *argv, "--params", "fair")


def test_a_film_shows_the_costmap(tmp_path, capsys):
    films = {}
    for option in ([], ["--show-costmap"]):
        film = tmp_path / f"film{len(option)}.gif"
        argv = ["drive", OFFICE, "--controller", "rpp", "--noise", "nominal", "--time-limit", "1", "--gif", str(film)]
        assert main([*argv, *option]) == 0
        with Image.open(film) as frames:
            films[len(option)] = np.asarray(frames.convert("RGB")).astype(int)
    magenta = [((one - (196, 0, 196)) ** 2).sum(axis=2).min() for one in films.values()]
    assert magenta[1] < 8000 < magenta[0]
    assert "--gif, --mp4 or --show" in refused(capsys, "drive", OFFICE, "--controller", "rpp", "--show-costmap")


def test_films_and_windows_that_cannot_be_are_refused_first(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("evolution.commands.drive.drive", lambda _: pytest.fail("driven"))
    monkeypatch.setenv("PATH", str(tmp_path))
    line = refused(capsys, "drive", OFFICE, "--controller", "rpp", "--mp4", tmp_path / "film.mp4")
    assert "needs the program ffmpeg" in line
    monkeypatch.setattr("matplotlib.pyplot.get_backend", lambda: "agg")
    assert "expected a display" in refused(capsys, "drive", OFFICE, "--controller", "rpp", "--show")


def test_maps_info_and_convert(tmp_path, capsys):
    assert main(["maps", "info", OFFICE, "--format", "json"]) == 0
    (office,) = json.loads(capsys.readouterr().out)["maps"]
    assert (office["rows"], office["cols"]) == (140, 200)
    target = tmp_path / "office.mapset.json"
    assert main(["maps", "convert", OFFICE, str(target)]) == 0
    assert load_scenarios(target)[0].map == load_scenarios(OFFICE)[0].map


def test_maps_convert_splits_cells(tmp_path, capsys, caplog):
    rows = ["@@@@@@", "@....@", "@.@..@", "@....@", "@@@@@@"]
    coarse, fine = tmp_path / "hall.map", tmp_path / "hall.json"
    coarse.write_text("\n".join(["type octile", "height 5", "width 6", "map", *rows, ""]))
    (tmp_path / "hall.map.scen").write_text("version 1\n0 hall.map 6 5 1 1 4 3 5.0\n")
    scen = str(tmp_path / "hall.map.scen")
    assert main(["maps", "convert", scen, str(fine), "--split", "4"]) == 0
    ((before,), (after,)) = load_scenarios(scen), load_scenarios(fine)
    assert (after.map.resolution, after.map.bounds) == (0.25, before.map.bounds)
    assert (after.map.occupancy == np.kron(before.map.occupancy, np.ones((4, 4), bool))).all()
    assert (after.start, after.goal) == (before.start, before.goal)
    check_room([after], DriveSettings(navigation="thesis"))
    assert not caplog.messages
    check_room([before], DriveSettings(navigation="thesis"))
    assert caplog.messages[0].startswith("hall has cells of 1 m,")
    line = refused(capsys, "maps", "convert", scen, tmp_path / "finer.json", "--split", "1000")
    assert line == "mapbench maps: hall split by 1000: expected at most 25000000 cells, got 30000000\n"


PARAMS = """
controller_server:
  ros__parameters:
    controller_plugins: [FollowPath]
    FollowPath: {plugin: "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController"}
local_costmap: {local_costmap: {ros__parameters: {robot_radius: RADIUS}}}
global_costmap:
  global_costmap: {ros__parameters: {robot_radius: RADIUS, inflation_layer: {inflation_radius: 0.25}}}
"""


def measured(capsys, *arguments):
    assert main(["maps", "info", *map(str, arguments), "--format", "json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["maps"]
    return row


def test_maps_info_measures_for_the_robot_of_a_parameter_file(tmp_path, capsys):
    small, large = (tmp_path / f"{name}.yaml" for name in ("small", "large"))
    small.write_text(PARAMS.replace("RADIUS", "0.2"))
    large.write_text(PARAMS.replace("RADIUS", "0.31"))
    fits = measured(capsys, OFFICE, "--params", small)
    assert (fits["solvable"], fits["narrowest_passage"]) == (1.0, pytest.approx(0.6))
    assert (fits["inflation_radius"], fits["uninflated_width"]) == (0.25, pytest.approx(0.1))
    alone = measured(capsys, OFFICE, "--robot-radius", 0.2)
    assert alone == {name: fits[name] for name in alone}
    assert "inflation_radius" not in alone
    assert measured(capsys, OFFICE, "--params", large)["solvable"] == 0.0
    assert measured(capsys, OFFICE, "--params", large, "--robot", "turtlebot3_burger")["solvable"] == 1.0
    assert measured(capsys, OFFICE, "--params", "thesis")["uninflated_width"] == 0.0
    assert "got both" in refused(capsys, "maps", "info", OFFICE, "--robot", "jackal", "--robot-radius", "0.2")
    assert "expected a file or one of the presets" in refused(capsys, "maps", "info", OFFICE, "--params", "nowhere")


def test_maps_draw(tmp_path, capsys):
    command = ["maps", "draw", "--family", "doors,sparse", "--count", "3", "--seed", "1"]
    for name in ("first", "again"):
        assert main([*command, "--out", str(tmp_path / name)]) == 0
    assert "look at" in capsys.readouterr().out
    first, again = (sorted((tmp_path / name).iterdir()) for name in ("first", "again"))
    assert [file.read_bytes() for file in first] == [file.read_bytes() for file in again]
    genes = json.loads((tmp_path / "first" / "genes.json").read_text())
    assert len(genes) == 3
    for name, drawn in genes.items():
        (scenario,) = load_scenarios(tmp_path / "first" / f"{name}.yaml")
        family = make_family(drawn["family"])
        cells = family.build(family.genes.from_mapping(drawn["genes"], name), ShapeSettings())
        assert np.array_equal(scenario.map.occupancy, cells)
    assert "expected a new or empty" in refused(capsys, *command, "--out", tmp_path / "first")


@pytest.mark.usefixtures("fake_robot")
def test_a_search_over_families_is_recorded(tmp_path, capsys):
    assert main([*SMALL_SEARCH, "--family", "doors,shapes", *WITH_ERRORS, "--out", str(tmp_path / "run")]) == 0
    config = json.loads((tmp_path / "run" / "config.json").read_text())
    assert [family["name"] for family in config["search"]["families"]] == ["doors", "shapes"]


def test_help_teaches_by_example(capsys):
    for command in ("evolve", "bench", "drive", "maps", "export", "import-results", "validate"):
        with pytest.raises(SystemExit) as stop:
            main([command, "--help"])
        assert stop.value.code == 0
        assert f"mapbench {command}" in capsys.readouterr().out.split("examples:")[1]
