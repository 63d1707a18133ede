"""Stand-ins for ROS that answer as ROS does, for the exported launch file and runner."""

from __future__ import annotations

import importlib.util
import math
import sys
from types import ModuleType, SimpleNamespace

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6


class Shutdown(Exception):
    """What spinning raises after SIGTERM."""


class World:
    """What the simulator would do: time goes on with every spin, the robot is where it was put, goals take a while."""

    def __init__(self):
        self.time = 0.0
        self.pose = (0.0, 0.0)
        self.goals = []
        self.cleared = []
        self.cancelled = 0
        self.listeners = {}
        self.silent = {}  # simulated time from which on a topic is silent, by topic
        self.codes = {}  # error code of the result by controller, as releases with codes have it
        self.unplanned = set()  # controllers that get no path
        self.launched = []
        self.launch = ["sleep", "60"]  # what stands for the launch file
        self.stuck = set()  # numbers of the teleports after which the robot stays where it is
        self.teleports = 0
        self.coasting = 0.0  # seconds for which the robot moves on after a goal was cancelled
        self.at_rest = -math.inf  # the time from which on it rests
        self.touches = []  # simulated times at which the chassis touches a wall, counted from each goal
        self.goal_time = math.inf
        self.ready = self.accepts = True
        self.inactive_from = math.inf  # the time from which on Nav2 is not active
        self.interrupt_after, self.interrupt = math.inf, KeyboardInterrupt
        self.ending = {"dwb": (SUCCEEDED, 12.0), "mppi": (ABORTED, 20.0)}

    def spin(self):
        self.time += 0.05
        speed = 0.5 if self.time < self.at_rest else 0.0
        self.pose = (self.pose[0] + 0.05 * speed, self.pose[1])
        message = SimpleNamespace(
            pose=SimpleNamespace(pose=SimpleNamespace(position=SimpleNamespace(x=self.pose[0], y=self.pose[1]))),
            twist=SimpleNamespace(twist=empty_twist(speed)),
        )
        self.tell("odom", message)
        for topic in ("scan", "tf"):
            self.tell(topic, None)
        since = self.time - self.goal_time
        touching = [wall for wall in self.touches if abs(since - wall) < 0.03]
        self.tell("contacts", SimpleNamespace(states=touching, contacts=touching))
        if len(self.goals) >= self.interrupt_after:
            raise self.interrupt

    def tell(self, topic, message):
        """Send a message to those who listen to a topic."""
        if self.time < self.silent.get(topic, math.inf):
            for listener in self.listeners.get(topic, ()):
                listener(message)

    def follow(self):
        """Give the controller server a path."""
        goal_ids = [SimpleNamespace(uuid=bytes([number])) for number, _ in enumerate(self.goals)]
        statuses = [SimpleNamespace(goal_info=SimpleNamespace(goal_id=goal_id)) for goal_id in goal_ids]
        self.tell("follow_path/_action/status", SimpleNamespace(status_list=statuses))


def empty_twist(speed=0.0):
    return SimpleNamespace(linear=SimpleNamespace(x=speed), angular=SimpleNamespace(z=0.0))


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
            self.world.teleports += 1
            if self.world.teleports not in self.world.stuck:
                self.world.pose = (request.state.pose.position.x, request.state.pose.position.y)
            else:
                self.world.pose = (-9.0, -9.0)
        return Future(SimpleNamespace(success=self.world.ready and self.world.time < self.world.inactive_from))


class Handle:
    def __init__(self, world, goal):
        self.world, self.accepted = world, world.accepts
        controller = goal.behavior_tree.rsplit("/", 1)[-1].removesuffix(".xml")
        self.status, self.duration = world.ending[controller]
        code = world.codes.get(controller)
        self.result = SimpleNamespace() if code is None else SimpleNamespace(error_code=code)
        self.begin = world.time
        if controller not in world.unplanned:
            world.follow()

    def get_result_async(self):
        done = lambda: self.world.time - self.begin >= self.duration  # noqa: E731
        return Future(SimpleNamespace(status=self.status, result=self.result), done)

    def cancel_goal_async(self):
        self.world.cancelled += 1
        self.world.at_rest = self.world.time + self.world.coasting
        return Future(None)


class Action:
    def __init__(self, world):
        self.world = world

    def send_goal_async(self, goal):
        self.world.goals.append(goal)
        self.world.goal_time = self.world.time
        return Future(Handle(self.world, goal))


CODES = {
    "NavigateToPose": {"FAILED_TO_LOAD_BEHAVIOR_TREE": 9001, "TF_ERROR": 9002},
    "FollowPath": {"UNKNOWN": 100, "INVALID_CONTROLLER": 101, "TF_ERROR": 102, "NO_VALID_CONTROL": 106},
    "ComputePathToPose": {"INVALID_PLANNER": 201, "TF_ERROR": 202, "START_OUTSIDE_MAP": 203, "NO_VALID_PATH": 208},
}
"""Some error codes of Nav2's actions since Jazzy; Humble has none."""


def actions(release):
    """Return Nav2's actions as the runner uses them."""
    names = (*CODES, "BackUp", "DriveOnHeading", "SmoothPath", "Spin", "Wait")
    codes = {name: {} if release == "humble" else CODES.get(name, {}) for name in names}
    return {name: SimpleNamespace(Goal=goal_message, Result=SimpleNamespace(**codes[name])) for name in names}


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
            world.listeners.setdefault(topic, []).append(callback)

        def get_clock(self):
            now = SimpleNamespace(nanoseconds=int(world.time * 1e9), to_msg=lambda: None)
            return SimpleNamespace(now=lambda: now)

        def destroy_node(self):
            world.listeners = {}

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
