"""The exported launch file and runner, driven by stand-ins for ROS that answer as ROS does."""

from __future__ import annotations

import importlib.util
import math
import subprocess
import sys
from types import ModuleType, SimpleNamespace

import pytest

from gym_mapbench.errors import MapFormatError
from gym_mapbench.mapio.gazebo import export_gazebo
from gym_mapbench.mapio.runner_results import COLUMNS, read_runner_results
from tests.mapio.test_gazebo import OPTIONS, thesis_scenario

SUCCEEDED, ABORTED = 4, 6


class World:
    """What the simulator would do: time goes on with every spin, the robot is where it was put, goals take a while."""

    def __init__(self):
        self.time = 0.0
        self.pose = (0.0, 0.0)
        self.goals = []
        self.cleared = []
        self.cancelled = 0
        self.listeners = []
        self.launched = []
        self.ending = {"dwb": (SUCCEEDED, 12.0), "mppi": (ABORTED, 20.0)}

    def spin(self):
        self.time += 0.05
        message = SimpleNamespace(
            pose=SimpleNamespace(pose=SimpleNamespace(position=SimpleNamespace(x=self.pose[0], y=self.pose[1]))),
            twist=SimpleNamespace(twist=empty_twist()),
        )
        for listener in self.listeners:
            listener(message)


def empty_twist():
    return SimpleNamespace(linear=SimpleNamespace(x=0.0), angular=SimpleNamespace(z=0.0))


def empty_pose():
    return SimpleNamespace(position=SimpleNamespace(x=0.0, y=0.0), orientation=SimpleNamespace(z=0.0, w=1.0))


class Future:
    def __init__(self, value, done=lambda: True):
        self._value, self.done = value, done

    def result(self):
        return self._value


class Service:
    """A message type with a Request."""

    @staticmethod
    def Request():
        return SimpleNamespace(state=SimpleNamespace(pose=empty_pose()))


class Client:
    def __init__(self, world, name):
        self.world, self.name = world, name

    def wait_for_service(self, timeout_sec):
        return True

    def call_async(self, request):
        if "clear" in self.name:
            self.world.cleared.append(self.name)
        if "set_entity_state" in self.name:
            assert request.state.name == "mapbench_robot"
            self.world.pose = (request.state.pose.position.x, request.state.pose.position.y)
        return Future(SimpleNamespace(success=True))


class Handle:
    accepted = True

    def __init__(self, world, goal):
        self.world = world
        self.status, self.duration = world.ending[goal.behavior_tree.rsplit("/", 1)[-1].removesuffix(".xml")]
        self.begin = world.time

    def get_result_async(self):
        done = lambda: self.world.time - self.begin >= self.duration  # noqa: E731
        return Future(SimpleNamespace(status=self.status), done)

    def cancel_goal_async(self):
        self.world.cancelled += 1
        return Future(None)


class Action:
    def __init__(self, world):
        self.world = world

    def send_goal_async(self, goal):
        self.world.goals.append(goal)
        return Future(Handle(self.world, goal))


def goal_message():
    header = SimpleNamespace(frame_id="", stamp=None)
    return SimpleNamespace(pose=SimpleNamespace(header=header, pose=empty_pose()), behavior_tree="")


def fake_node(world):
    class Node:
        def __init__(self, name, parameter_overrides):
            assert parameter_overrides == [("use_sim_time", True)]

        def create_client(self, kind, name):
            return Client(world, name)

        def create_publisher(self, kind, topic, depth):
            return SimpleNamespace(publish=lambda message: None)

        def create_subscription(self, kind, topic, callback, depth):
            world.listeners.append(callback)

        def get_clock(self):
            now = SimpleNamespace(nanoseconds=int(world.time * 1e9), to_msg=lambda: None)
            return SimpleNamespace(now=lambda: now)

        def destroy_node(self):
            world.listeners.clear()

    return Node


def install(monkeypatch, **modules):
    """Put modules with these attributes where ``import`` finds them."""
    for path, attributes in modules.items():
        name = path.replace("__", ".")
        module = ModuleType(name)
        module.__dict__.update(attributes)
        monkeypatch.setitem(sys.modules, name, module)


def load(path, name):
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runner") / "bundle"
    maps = [thesis_scenario(seed, f"map_{seed}") for seed in range(2)]
    export_gazebo(maps, folder, **OPTIONS)
    return maps, folder


@pytest.fixture
def ros(monkeypatch):
    """The stand-ins; returns the world behind them."""
    world = World()
    install(
        monkeypatch,
        rclpy={"init": lambda: None, "shutdown": lambda: None, "spin_once": lambda node, timeout_sec: world.spin()},
        rclpy__action={"ActionClient": lambda node, kind, name: Action(world)},
        rclpy__node={"Node": fake_node(world)},
        rclpy__parameter={"Parameter": lambda name, value: (name, value)},
        action_msgs={},
        action_msgs__msg={"GoalStatus": SimpleNamespace(STATUS_SUCCEEDED=SUCCEEDED)},
        geometry_msgs={},
        geometry_msgs__msg={"Twist": empty_twist},
        nav2_msgs={},
        nav2_msgs__action={"NavigateToPose": SimpleNamespace(Goal=goal_message)},
        nav2_msgs__srv={"ClearEntireCostmap": Service},
        nav_msgs={},
        nav_msgs__msg={"Odometry": None},
        std_srvs={},
        std_srvs__srv={"Trigger": Service},
        gazebo_msgs={},
        gazebo_msgs__srv={"SetEntityState": Service},
    )

    start = subprocess.Popen

    def launch(command, start_new_session):
        world.launched.append(command)
        return start(["sleep", "60"], start_new_session=start_new_session)

    monkeypatch.setattr(subprocess, "Popen", launch)
    return world


def test_the_runner_drives_everything_and_its_file_is_read_back(bundle, ros, tmp_path):
    maps, folder = bundle
    runner = load(folder / "run_benchmark.py", "exported_runner")
    runner.main(["--repeats", "2", "--out", str(tmp_path / "times.csv")])
    results = read_runner_results(tmp_path / "times.csv")
    runs = [(map_.name, controller, repeat) for map_ in maps for controller in ("dwb", "mppi") for repeat in (0, 1)]
    assert [result[:3] for result in results] == runs
    assert {(result.controller, result.outcome) for result in results} == {("dwb", "goal"), ("mppi", "aborted")}
    assert all(result.time == pytest.approx(12.0, abs=0.11) for result in results if result.success)
    assert [command[3:] for command in ros.launched] == [
        [f"map:={map_.name}", "simulator:=classic", "headless:=true"] for map_ in maps
    ]
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
    _, folder = bundle
    runner = load(folder / "run_benchmark.py", "exported_runner")
    arguments = ["--maps", "map_1", "--controllers", "mppi", "--time-limit", "5", "--out", str(tmp_path / "t.csv")]
    runner.main(arguments)
    (result,) = read_runner_results(tmp_path / "t.csv")
    assert result[:4] == ("map_1", "mppi", 0, "timeout")
    assert result.time == pytest.approx(5.0, abs=0.11)
    assert ros.cancelled == 1
    with pytest.raises(FileExistsError):
        runner.main(arguments)


def test_gz_teleport_asks_the_service(bundle, ros, monkeypatch):
    _, folder = bundle
    runner = load(folder / "run_benchmark.py", "exported_runner")
    calls = []
    monkeypatch.setattr(subprocess, "run", lambda command, check: calls.append(command))
    runner.GzTeleport("map_0")((1.0, 2.0, math.pi))
    (command,) = calls
    assert command[3] == "/world/map_0/set_pose"
    assert command[-1] == (
        'name: "mapbench_robot", position: {x: 1.0, y: 2.0, z: 0.01}, '
        f"orientation: {{z: 1.0, w: {math.cos(math.pi / 2)}}}"
    )


@pytest.mark.parametrize("simulator", ["classic", "gz"])
@pytest.mark.parametrize("headless", ["true", "false"])
def test_the_launch_file_starts_simulator_robot_and_nav2(bundle, monkeypatch, simulator, headless):
    maps, folder = bundle
    arguments = {"map": "map_1", "simulator": simulator, "headless": headless}
    install(
        monkeypatch,
        launch={"LaunchDescription": list},
        launch__actions={
            "DeclareLaunchArgument": lambda name, **fields: (name, fields),
            "ExecuteProcess": SimpleNamespace,
            "OpaqueFunction": SimpleNamespace,
        },
        launch__substitutions={
            "LaunchConfiguration": lambda key: SimpleNamespace(perform=lambda context: arguments[key])
        },
        launch_ros={},
        launch_ros__actions={"Node": SimpleNamespace},
    )
    launch = load(folder / "launch" / "benchmark.launch.py", "exported_launch")
    *_, function = launch.generate_launch_description()
    started = function.function(None)
    first = started[0].cmd
    assert first[0] == ("gzserver" if simulator == "classic" else "gz")
    world = folder / "worlds" / ("map_1.world" if simulator == "classic" else "map_1.sdf")
    assert str(world) in first
    assert str(folder / "models") in next(iter(started[0].additional_env.values()))
    nodes = {vars(item).get("name", item.executable): item for item in started if hasattr(item, "executable")}
    assert {"map_server", "planner_server", "controller_server", "behavior_server", "bt_navigator"} <= set(nodes)
    assert nodes["lifecycle_manager"].parameters[0]["node_names"][-1] == "velocity_smoother"
    assert nodes["controller_server"].remappings == [("cmd_vel", "cmd_vel_nav")]
    assert nodes["map_server"].parameters[1]["yaml_filename"] == str(folder / "maps" / "map_1.yaml")
    spawn = nodes["spawn_entity.py" if simulator == "classic" else "create"]
    assert spawn.arguments[-8:] == [
        "-x", str(maps[1].start.x), "-y", str(maps[1].start.y), "-z", "0.01", "-Y", str(maps[1].start.yaw),
    ]  # fmt: skip


HEAD = ",".join(COLUMNS) + "\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "missing: controller"),
        ("map,controller\na,b\n", "missing: outcome"),
        (HEAD + "m,dwb,0,flew,1,1\n", "outcome: expected one of goal, aborted"),
        (HEAD + "m,dwb,0,goal,soon,1\n", "time_s: expected a number, got 'soon'"),
        (HEAD + "m,dwb,0,goal,nan,1\n", "time_s: expected a number"),
        (HEAD + "m,dwb,0,goal,-1,1\n", "of 0 or more"),
        (HEAD + ",dwb,0,goal,1,1\n", "names of a map and a controller"),
        (HEAD + "m,dwb\n", "outcome"),
    ],
)
def test_bad_results(tmp_path, text, words):
    (tmp_path / "times.csv").write_text(text)
    with pytest.raises(MapFormatError, match=words):
        read_runner_results(tmp_path / "times.csv")
