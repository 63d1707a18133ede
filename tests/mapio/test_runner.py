"""The exported runner, driven by stand-ins for ROS that answer as ROS does."""

from __future__ import annotations

import math
import re
import signal
import subprocess
import sys
import time
from functools import partial
from shlex import quote
from types import SimpleNamespace

import pytest

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.runner_results import ADDED_LATER, COLUMNS, read_runner_results
from tests.evolution.processes import holds_soon, is_gone
from tests.mapio.fake_ros import (
    ABORTED,
    CANCELED,
    SUCCEEDED,
    Action,
    Service,
    Shutdown,
    World,
    actions,
    empty_twist,
    fake_node,
    install,
    load,
)

HEAD = ",".join(COLUMNS) + "\n"


def simulator_of(bundle):
    return "classic" if bundle[2] == "humble" else "gz"


@pytest.fixture
def ros(monkeypatch, bundle):
    """The stand-ins; returns the world behind them."""
    world = World()
    world.codes = {} if bundle[2] == "humble" else {"dwb": 0, "mppi": 106}
    install(
        monkeypatch,
        ament_index_python={},
        ament_index_python__packages={"get_package_share_directory": {"mapbench_bundle": str(bundle[1])}.__getitem__},
        rclpy={"init": lambda: None, "try_shutdown": lambda: None, "spin_once": lambda node, timeout_sec: world.spin()},
        rclpy__qos={"qos_profile_sensor_data": None, "qos_profile_action_status_default": None},
        rclpy__action={"ActionClient": lambda node, kind, name: Action(world)},
        rclpy__executors={"ExternalShutdownException": Shutdown},
        rclpy__node={"Node": fake_node(world)},
        rclpy__parameter={"Parameter": lambda name, value: (name, value)},
        action_msgs={},
        action_msgs__msg={
            "GoalStatus": SimpleNamespace(STATUS_SUCCEEDED=SUCCEEDED, STATUS_ABORTED=ABORTED),
            "GoalStatusArray": None,
        },
        geometry_msgs={},
        geometry_msgs__msg={"Twist": empty_twist},
        nav2_msgs={},
        nav2_msgs__action=actions(bundle[2]),
        nav2_msgs__srv={"ClearEntireCostmap": Service},
        nav_msgs={},
        nav_msgs__msg={"Odometry": None},
        sensor_msgs={},
        sensor_msgs__msg={"LaserScan": None},
        tf2_msgs={},
        tf2_msgs__msg={"TFMessage": None},
        std_srvs={},
        std_srvs__srv={"Trigger": Service},
        gazebo_msgs={},
        gazebo_msgs__srv={"SetEntityState": Service},
        gazebo_msgs__msg={"ContactsState": None},
        ros_gz_interfaces={},
        ros_gz_interfaces__msg={"Contacts": None},
    )

    def teleport(command, check, stdout):
        """``gz service``."""
        world.teleports += 1
        if world.teleports in world.stuck:
            raise subprocess.CalledProcessError(1, command)
        x, y = re.search(r"x: ([-+.e0-9]+), y: ([-+.e0-9]+)", command[-1]).groups()
        world.pose = (float(x), float(y))

    monkeypatch.setattr(subprocess, "run", teleport)
    start = subprocess.Popen

    def launch(command, start_new_session):
        world.launched.append(command)
        # A shell ignores SIGINT for what it starts in the background, and children inherit that.
        heed = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
        return start(world.launch, start_new_session=start_new_session, preexec_fn=heed)

    monkeypatch.setattr(subprocess, "Popen", launch)
    return world


def test_the_runner_drives_everything_and_its_file_is_read_back(bundle, ros, tmp_path):
    maps, folder, _ = bundle
    ros.touches = [3.0, 3.05, 3.1, 3.2, 8.0]
    runner = load(folder / "run_benchmark.py", "exported_runner")
    assert runner.main(["--repeats", "2", "--out", str(tmp_path / "times.csv")]) == 0
    results = read_runner_results(tmp_path / "times.csv")
    runs = [(map_.name, controller, repeat) for map_ in maps for controller in ("dwb", "mppi") for repeat in (0, 1)]
    assert [result[:3] for result in results] == runs
    assert {(result.controller, result.outcome) for result in results} == {("dwb", "goal"), ("mppi", "aborted")}
    assert all(result.time == pytest.approx(12.0, abs=0.11) for result in results if result.success)
    assert {result.contacts for result in results} == {2}
    assert {(result.map, result.digest) for result in results} == {(map_.name, map_.digest) for map_ in maps}
    simulator = simulator_of(bundle)
    setups = {(result.simulator, result.params, result.time_limit) for result in results}
    assert setups == {(simulator, runner.digest_of_params(), "150")}
    launch = ["ros2", "launch", "mapbench_bundle", "benchmark.launch.py"]
    arguments = [f"simulator:={simulator}", "headless:=true"]
    assert ros.launched == [[*launch, f"map:={map_.name}", *arguments] for map_ in maps]
    assert len(ros.goals) == 8
    assert ros.cleared[:2] == [
        "local_costmap/clear_entirely_local_costmap",
        "global_costmap/clear_entirely_global_costmap",
    ]
    goal = ros.goals[0]
    assert (goal.pose.pose.position.x, goal.pose.pose.position.y) == maps[0].goal[:2]
    assert 2 * math.atan2(goal.pose.pose.orientation.z, goal.pose.pose.orientation.w) == pytest.approx(maps[0].goal.yaw)
    assert goal.pose.header.frame_id == "map"
    assert goal.behavior_tree == str(folder / "behavior_trees" / "dwb.xml")
    assert ros.pose == maps[1].start[:2]


def test_a_run_that_takes_too_long_is_cancelled(bundle, ros, tmp_path):
    _, folder, _ = bundle
    runner = load(folder / "run_benchmark.py", "exported_runner")
    arguments = ["--maps", "map_1", "--controllers", "mppi", "--time-limit", "5", "--out", str(tmp_path / "t.csv")]
    runner.main(arguments)
    (result,) = read_runner_results(tmp_path / "t.csv")
    assert result[:4] == ("map_1", "mppi", 0, "timeout")
    assert result.time == pytest.approx(5.0, abs=0.11)
    assert ros.cancelled == 1


def test_a_run_begins_at_the_start_though_the_robot_was_still_moving(bundle, ros, tmp_path, monkeypatch):
    """After a timeout, controller and velocity smoother take a moment to stop the robot."""
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    ros.coasting = 0.4
    arguments = ["--maps", "map_0", "--controllers", "mppi", "--repeats", "2", "--time-limit", "5"]
    assert runner.main([*arguments, "--out", str(tmp_path / "t.csv")]) == 0
    assert runs_in(tmp_path / "t.csv") == [("map_0", "mppi", repeat, "timeout") for repeat in (0, 1)]


def runs_in(path):
    return [result[:4] for result in read_runner_results(path)]


ALL = [
    (f"map_{map_}", name, 0, outcome) for map_ in range(2) for name, outcome in (("dwb", "goal"), ("mppi", "aborted"))
]


def test_one_failed_teleport_costs_one_run(bundle, ros, tmp_path, monkeypatch, capsys):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    ros.stuck = {2}
    out = tmp_path / "times.csv"
    assert runner.main(["--out", str(out)]) == 1
    failed = ("map_0", "mppi", 0, "error")
    assert runs_in(out) == [ALL[0], failed, *ALL[2:]]
    said = capsys.readouterr().err
    assert "map_0, mppi: " in said
    assert said.endswith("errors: 1; --resume drives these runs again\n")
    assert runner.main(["--out", str(out), "--resume"]) == 0
    assert sorted(runs_in(out)) == ALL
    assert len(ros.goals) == 4


@pytest.mark.parametrize("signalled", [KeyboardInterrupt, Shutdown])
@pytest.mark.parametrize("driven", [1, 2, 3])
def test_an_interrupted_benchmark_goes_on(bundle, ros, tmp_path, capsys, driven, signalled):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    out = tmp_path / "times.csv"
    ros.interrupt_after, ros.interrupt = driven, signalled
    assert runner.main(["--out", str(out)]) == 130
    assert capsys.readouterr().err == "interrupted; --resume drives what is left\n"
    assert runs_in(out) == ALL[: driven - 1]
    with out.open("a") as file:
        file.write("map_1,mp")  # a line that was not written to its end
    ros.interrupt_after, ros.goals = math.inf, []
    assert runner.main(["--out", str(out), "--resume"]) == 0
    assert runs_in(out) == ALL
    assert len(ros.goals) == 4 - (driven - 1)
    before, ros.launched = out.read_bytes(), []
    assert runner.main(["--out", str(out), "--resume"]) == 0
    assert (out.read_bytes(), ros.launched) == (before, [])


def drive_one(bundle, out, controller, *arguments):
    """Run one map with one controller; return the exit code."""
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    return runner.main(["--maps", "map_0", "--controllers", controller, "--out", str(out), *arguments])


HUMBLE, LATER = ("humble",), ("jazzy", "lyrical")
ENDS = [
    *((LATER, 106, True, "aborted", ""), (LATER, 208, False, "aborted", "")),
    (LATER, 102, True, "error", "a fault of the setup: Nav2 reports TF_ERROR (102)"),
    (LATER, 203, False, "error", "a fault of the setup: Nav2 reports START_OUTSIDE_MAP (203)"),
    (LATER, 9001, False, "error", "a fault of the setup: Nav2 reports FAILED_TO_LOAD_BEHAVIOR_TREE (9001)"),
    (LATER, 0, True, "error", "a fault of the setup: Nav2 gave up without an error code"),
    (HUMBLE, None, True, "aborted", ""),
    (HUMBLE, None, False, "error", "gave up before the controller had a path: no plan, or a fault of the setup"),
]
"""How Nav2 ends a run, with its code if the release has any and whether there was a path, and what the runner says."""


@pytest.mark.parametrize(
    ("bundle", "code", "planned", "outcome", "words"),
    [(release, *end) for releases, *end in ENDS for release in releases],
    indirect=["bundle"],
)
def test_a_fault_of_the_setup_is_no_failure_of_the_controller(
    bundle, ros, tmp_path, capsys, code, planned, outcome, words
):
    ros.codes, ros.unplanned = {} if code is None else {"mppi": code}, set() if planned else {"mppi"}
    assert drive_one(bundle, tmp_path / "t.csv", "mppi") == (outcome == "error")
    assert runs_in(tmp_path / "t.csv") == [("map_0", "mppi", 0, outcome)]
    assert words in capsys.readouterr().err


def test_a_tree_that_may_report_no_codes_counts_from_the_first_path_on(bundle, ros, tmp_path):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    runner.REPORTS_CODES, ros.codes = False, {"mppi": 0}
    arguments = ["--maps", "map_0", "--controllers", "mppi", "--out"]
    assert runner.main([*arguments, str(tmp_path / "t.csv")]) == 0
    ros.unplanned = {"mppi"}
    assert runner.main([*arguments, str(tmp_path / "u.csv")]) == 1
    assert [runs_in(tmp_path / name)[0][3] for name in ("t.csv", "u.csv")] == ["aborted", "error"]


def test_paths_of_earlier_runs_do_not_count(bundle, ros, tmp_path):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    runner.REPORTS_CODES, ros.codes, ros.unplanned = False, {}, {"mppi"}
    assert runner.main(["--maps", "map_0", "--out", str(tmp_path / "t.csv")]) == 1
    assert [run[3] for run in runs_in(tmp_path / "t.csv")] == ["goal", "error"]


@pytest.mark.parametrize("topic", ["odom", "scan", "tf"])
@pytest.mark.parametrize("arguments", [[], ["--time-limit", "15"]])
def test_a_simulator_that_falls_silent_is_no_failure_of_the_controller(bundle, ros, tmp_path, capsys, topic, arguments):
    ros.silent = {topic: 10.0}
    assert drive_one(bundle, tmp_path / "t.csv", "mppi", *arguments) == 1
    assert runs_in(tmp_path / "t.csv") == [("map_0", "mppi", 0, "error")]
    assert f"map_0, mppi: no message on {topic} for 2 s" in capsys.readouterr().err


def test_no_run_follows_when_nav2_has_ended(bundle, ros, tmp_path, capsys):
    ros.inactive_from = 10.0
    assert drive_one(bundle, tmp_path / "t.csv", "mppi", "--repeats", "3") == 1
    assert (runs_in(tmp_path / "t.csv"), len(ros.goals)) == ([], 1)
    assert "map_0: Nav2 is no longer active\nnot driven to the end: map_0" in capsys.readouterr().err


def test_a_goal_that_nav2_does_not_take_is_an_error(bundle, ros, tmp_path, capsys):
    ros.accepts = False
    assert drive_one(bundle, tmp_path / "t.csv", "dwb") == 1
    assert runs_in(tmp_path / "t.csv") == [("map_0", "dwb", 0, "error")]
    assert "map_0, dwb: Nav2 did not take the goal" in capsys.readouterr().err


def test_a_goal_that_somebody_else_cancels_is_an_error(bundle, ros, tmp_path, capsys):
    ros.ending = {"dwb": (CANCELED, 5.0)}
    assert drive_one(bundle, tmp_path / "t.csv", "dwb") == 1
    assert runs_in(tmp_path / "t.csv") == [("map_0", "dwb", 0, "error")]
    assert "expected Nav2 to reach or to abort the goal, got the status 5" in capsys.readouterr().err


def test_a_run_that_the_wall_clock_ends_is_an_error(bundle, ros, tmp_path, monkeypatch, capsys):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    arguments = ["--maps", "map_0", "--controllers", "dwb", "--wall-limit", "3", "--out", str(tmp_path / "t.csv")]
    assert runner.main(arguments) == 1
    assert runs_in(tmp_path / "t.csv") == [("map_0", "dwb", 0, "error")]
    assert "map_0, dwb: no end within 3 s by the wall clock" in capsys.readouterr().err


@pytest.mark.parametrize(("topic", "words"), [("scan", "no message on scan"), (None, "Nav2 is not active")])
def test_what_has_not_started_is_said(bundle, ros, tmp_path, monkeypatch, capsys, topic, words):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    ros.silent, ros.ready = {topic: 0.0}, topic is not None
    assert runner.main(["--maps", "map_0", "--out", str(tmp_path / "t.csv")]) == 1
    assert f"map_0: not ready within 120 s: {words}\n" in capsys.readouterr().err


def test_a_map_that_does_not_start_leaves_the_others(bundle, ros, tmp_path, monkeypatch, capsys):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    ros.ready = False
    assert runner.main(["--out", str(tmp_path / "times.csv")]) == 1
    assert "not driven to the end: map_0, map_1; --resume tries again" in capsys.readouterr().err
    assert runs_in(tmp_path / "times.csv") == []
    assert len(ros.launched) == 2
    assert ros.time == pytest.approx(2 * runner.START_TIMEOUT, abs=5.0)


def test_a_simulator_that_ends_costs_its_map_and_no_waiting(bundle, ros, tmp_path, monkeypatch, capsys):
    """The launch ends with its simulator; then no result will come, and no later run can begin."""
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(monotonic=lambda: ros.time, sleep=time.sleep))
    ros.launch, start = ["true"], subprocess.Popen

    def start_and_end(command, start_new_session):
        process = start(command, start_new_session)
        process.wait()
        return process

    monkeypatch.setattr(subprocess, "Popen", start_and_end)
    out = tmp_path / "times.csv"
    assert runner.main(["--out", str(out)]) == 1
    assert "map_0: the simulator or the launch file has ended" in capsys.readouterr().err
    assert runs_in(out) == []
    assert ros.time < 2 * runner.START_TIMEOUT


def test_a_launch_is_ended_whatever_happens_to_the_runner(bundle, ros, tmp_path, monkeypatch):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "Runner", lambda *_: 1 / 0)
    ended, stop = [], runner.stop
    monkeypatch.setattr(runner, "stop", lambda process: ended.append(process) or stop(process))
    with pytest.raises(ZeroDivisionError):
        runner.main(["--out", str(tmp_path / "times.csv")])
    assert [process.poll() for process in ended] == [-signal.SIGINT]


def test_what_outlives_the_launch_is_ended_too(bundle, ros, tmp_path, monkeypatch):
    """A simulator that is left would be there, with its walls, when the next map starts."""
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    monkeypatch.setattr(runner, "time", SimpleNamespace(sleep=lambda seconds: time.sleep(seconds / 100)))
    number = tmp_path / "number"
    number.touch()
    ros.launch = ["sh", "-c", f"(trap '' INT; exec sleep 600) & echo $! > {quote(str(number))}; wait"]
    process = subprocess.Popen([], start_new_session=True)
    assert holds_soon(lambda: number.read_text().endswith("\n"))
    runner.stop(process)
    assert is_gone(int(number.read_text()))


def test_a_missing_package_is_said_before_anything_starts(bundle, ros, tmp_path, monkeypatch, capsys):
    for name in ("gazebo_msgs.msg", "ros_gz_interfaces.msg"):
        monkeypatch.setitem(sys.modules, name, None)
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    with pytest.raises(SystemExit) as ended:
        runner.main(["--out", str(tmp_path / "times.csv")])
    assert ended.value.code == 2
    assert "README.md names the packages to install" in capsys.readouterr().err
    assert (ros.launched, list(tmp_path.iterdir())) == ([], [])


@pytest.mark.parametrize(
    ("arguments", "text", "words"),
    [
        ([], HEAD, "exists; continue it with --resume"),
        (["--resume"], "my,notes\n1,2\n", "expected a file of this benchmark"),
        (["--resume"], HEAD + "map_0,dwb,0.5,goal,1,2,3,d,gz,p,150\n", "expected a file of this benchmark"),
        (["--resume"], "\0\n", "expected a file of this benchmark"),
        (["--simulator", "webots"], None, "invalid choice: 'webots'"),
        (["--repeats", "0"], None, "--repeats: expected a whole number above 0, got '0'"),
        (["--repeats", "1.5"], None, "--repeats: expected a whole number above 0, got '1.5'"),
        (["--time-limit", "nan"], None, "--time-limit: expected a finite number above 0, got 'nan'"),
        (["--wall-limit", "-1"], None, "--wall-limit: expected a finite number above 0, got '-1'"),
    ],
)
def test_what_the_runner_refuses(bundle, ros, tmp_path, capsys, arguments, text, words):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    out = tmp_path / "times.csv"
    if text is not None:
        out.write_text(text)
    with pytest.raises(SystemExit) as ended:
        runner.main([*arguments, "--out", str(out)])
    assert ended.value.code == 2
    assert words in capsys.readouterr().err
    assert (out.read_text() if out.exists() else None) == text
    assert ros.launched == []


def test_a_file_of_other_bytes_or_a_directory_is_not_continued(bundle, ros, tmp_path, capsys):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    (tmp_path / "utf16.csv").write_text(HEAD, encoding="utf-16")
    (tmp_path / "folder").mkdir()
    for name in ("utf16.csv", "folder"):
        with pytest.raises(SystemExit):
            runner.main(["--resume", "--out", str(tmp_path / name)])
        assert f"{name}: expected a file of this benchmark" in capsys.readouterr().err
    assert ros.launched == []


@pytest.mark.parametrize("name", ["nav2_params.yaml", "behavior_trees/mppi.xml"])
def test_a_missing_tree_is_no_failure_of_its_controller(bundle, ros, tmp_path, capsys, name):
    """Nav2 would take the goal, and abort it at once."""
    file = bundle[1] / name
    aside = file.rename(tmp_path / "aside")
    try:
        runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
        with pytest.raises(SystemExit) as ended:
            runner.main(["--out", str(tmp_path / "times.csv")])
    finally:
        aside.rename(file)
    assert ended.value.code == 2
    assert f"expected the file {name}, which is missing" in capsys.readouterr().err
    assert ros.launched == []


def test_a_directory_that_does_not_exist_is_refused(bundle, ros, tmp_path, capsys):
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    with pytest.raises(SystemExit) as ended:
        runner.main(["--out", str(tmp_path / "results" / "times.csv")])
    assert ended.value.code == 2
    assert f"expected a directory that exists and is writable, got {tmp_path / 'results'}" in capsys.readouterr().err
    assert ros.launched == []


def test_gz_teleport_asks_the_service(bundle, ros, monkeypatch):
    _, folder, _ = bundle
    runner = load(folder / "run_benchmark.py", "exported_runner")
    calls = []
    monkeypatch.setattr(subprocess, "run", lambda command, check, stdout: calls.append(command))
    runner.GzTeleport("map_0")((1.0, 2.0, math.pi))
    (command,) = calls
    assert command[3] == "/world/map_0/set_pose"
    assert command[-1] == (
        'name: "mapbench_robot", position: {x: 1.0, y: 2.0, z: 0.01}, '
        f"orientation: {{z: 1.0, w: {math.cos(math.pi / 2)}}}"
    )


HEAD_OF_FIRST_RUNNERS = ",".join(column for column in COLUMNS if column not in ADDED_LATER) + "\n"
COUNTED = HEAD_OF_FIRST_RUNNERS.replace("\n", ",contacts\n")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected the columns map, .*, got '', missing: map"),
        ("map,controller\na,b\n", "got 'map,controller', missing: repeat"),
        (COUNTED.replace(",", ";"), "got 'map;.*, missing: map"),
        (COUNTED.replace("contacts", "time_s"), "expected each column once, got time_s 2 times"),
        (COUNTED + "m,dwb,0,flew,1,1,0\n", "line 2: outcome: expected one of goal, aborted, .*, got 'flew'"),
        (COUNTED + "\n\nm,dwb,0,goal,soon,1,0\n", "line 4: time_s: expected a number, got 'soon'"),
        (COUNTED + "m,dwb,0,goal,nan,1,0\n", "time_s: expected a number, got 'nan'"),
        (COUNTED + "m,dwb,0,goal,-1,1,0\n", "time_s: expected 0 or more, got '-1'"),
        (COUNTED + "m,dwb,0,goal,1,-2,0\n", "path_length_m: expected 0 or more, got '-2'"),
        (COUNTED + "m,dwb,0.5,goal,1,1,0\n", r"repeat: expected a whole number of 0 or more, got '0\.5'"),
        (COUNTED + "m,dwb,-1,goal,1,1,0\n", "repeat: expected a whole number of 0 or more, got '-1'"),
        (COUNTED + "m,dwb,0,goal,1,1,0.5\n", r"contacts: expected a whole number of 0 or more, got '0\.5'"),
        (COUNTED + "m,dwb,0,goal,1,1,often\n", "contacts: expected a number, got 'often'"),
        (COUNTED + ",dwb,0,goal,1,1,0\n", "names of a map and a controller"),
        (COUNTED + "m,dwb\n", "line 2: expected 7 cells, as in the first line, got 2"),
        (HEAD_OF_FIRST_RUNNERS + "m,dwb,0,goal,20,1,8,9\n", "expected 6 cells, as in the first line, got 8"),
        (COUNTED + "m,dwb,0,goal,1,1,0\rm,rpp,0,goal,1,1,0\r", "not a CSV file"),
    ],
)
def test_bad_results(tmp_path, text, words):
    (tmp_path / "times.csv").write_text(text)
    with pytest.raises(MapFormatError, match=words):
        read_runner_results(tmp_path / "times.csv")


def test_runs_on_other_maps_are_not_continued(bundle, ros, tmp_path, capsys):
    (tmp_path / "times.csv").write_text(HEAD + "map_0,dwb,0,goal,1,2,3,of another package,gz,any,150\n")
    runner = load(bundle[1] / "run_benchmark.py", "exported_runner")
    assert runner.main(["--out", str(tmp_path / "times.csv"), "--resume"]) == 2
    assert "expected runs on the maps of this package, got other maps named map_0" in capsys.readouterr().err
    assert "another package" in (tmp_path / "times.csv").read_text()
    assert ros.launched == []


def test_runs_with_another_setup_are_not_continued(bundle, ros, tmp_path, capsys):
    maps, folder, _ = bundle
    runner, out, simulator = (
        load(folder / "run_benchmark.py", "exported_runner"),
        tmp_path / "times.csv",
        simulator_of(bundle),
    )
    for setup, message in (
        (f"stage,{runner.digest_of_params()},150", f"expected runs with --simulator {simulator}, got runs with stage"),
        (
            f"{simulator},edited,150",
            "expected runs with the parameters and behaviour trees of this package, got others",
        ),
        (f"{simulator},{runner.digest_of_params()},60", "expected runs with --time-limit 150, got runs with 60"),
    ):
        out.write_text(f"{HEAD}map_0,dwb,0,goal,1,2,3,{maps[0].digest},{setup}\n")
        assert runner.main(["--out", str(out), "--resume"]) == 2
        assert message in capsys.readouterr().err
        assert setup in out.read_text()
    assert ros.launched == []


def test_results_of_older_runners_have_no_contacts(tmp_path):
    (tmp_path / "old.csv").write_text(HEAD_OF_FIRST_RUNNERS + "m,dwb,0,goal,1,2\n")
    (tmp_path / "new.csv").write_text(COUNTED + "m,dwb,0,goal,1,2,3\n")
    (old,), (new,) = (read_runner_results(tmp_path / name) for name in ("old.csv", "new.csv"))
    assert (old.contacts, new.contacts) == (None, 3)
