"""Trees: ours are ticked with scripted servers, and all events compared with the recorded ones."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from controllers.base import STOP, Twist
from controllers.behaviors import default_tree
from controllers.nav2_params.navigation import NavigationParams
from controllers.navigator.behavior_tree import Status, halt_tree
from controllers.navigator.costmap_wait import ScheduledCostmap
from controllers.navigator.latency import Latency
from controllers.navigator.navigate_to_pose import Blackboard, Clear, Servers
from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from controllers.navigator.tree_builder import build_tree
from controllers.navigator.tree_loop import TreeLoop
from evolution.validation.around.recordings import AroundOracle, Record
from evolution.validation.around.script import ACTIONS, LoggedServer, ScriptedExecutor
from evolution.validation.measures import Cases, Measure
from gym_mapbench.metrics.episode import RECOVERY_KINDS
from gym_mapbench.releases import Release
from gym_mapbench.world.scenario import Pose

TICK = 0.01
SERVICE_TIME = 0.002
GLOBAL_FREQUENCY, LOCAL_FREQUENCY = 1.0, 5.0
LIMIT = 1000.0
END = {Status.SUCCESS: "succeeded", Status.FAILURE: "failed"}

UNDEFINED = "jazzy h_follow_rejected"
"""The scenario in which Nav2 reads memory that it has never written, so that its recovery means nothing."""

Event = tuple[int, str, str]


class Run(NamedTuple):
    """One navigation to one goal; times in us."""

    start_us: int
    end_us: int
    status: str
    number_recoveries: int


class Standing(NamedTuple):
    """A robot that does not move."""

    pose: Pose = Pose(0.0, 0.0)
    odometry: Twist = STOP
    acceleration: float = 0.0


class ReplayedCostmap(ScheduledCostmap):
    """A costmap without cells, which is cleared and updated when it is due."""

    def is_current(self, now: float) -> bool:
        """Whether the costmap, at ``now`` (s), has been updated since it was cleared."""
        while self.is_due(now):
            pass
        return super().is_current(now)


class TreeReplay:
    """Our tree on one scenario's scripted servers.

    Args:
        scenario: The scenario.
        release: The release of Nav2.
        xml: The tree; Nav2's default tree if empty.

    Attributes:
        events: What happened, in no order.
        runs: The navigations.
        ticks: Beginnings of all ticks, us.
    """

    def __init__(self, scenario: Record, release: Release, xml: str = "") -> None:
        script = scenario["script"]
        self.events: list[Event] = []
        self.runs: list[Run] = []
        self.ticks: list[int] = []
        self._script = read_script(script) if isinstance(script, list) else script
        tree = default_tree(release).replace(xml=xml)
        self._release, self._params = release, NavigationParams(release=release, bt=tree)
        self._board = Blackboard(Pose(0.0, 0.0))
        self._latency = Latency(message=self._script.get("lat", 1.0) / 2000.0)
        self._numbers = itertools.count(1)
        self._costmaps = costmaps_of(scenario)
        self._answers = {name: iter(times) for name, times in self._script.get("services", {}).items()}
        self._servers = {kind: self._make_server(kind) for kind in ACTIONS}
        servers = Servers(
            self._servers["planner"],
            self._servers["follow"],
            {kind: self._servers[kind] for kind in ("spin", "wait", "backup")},
            self._clear,
            keeps=lambda path: False,
            is_path_valid=lambda path: True,
            robot=Standing(),
            smoother=self._servers["smoother"],
        )
        self._tree = build_tree(self._board, self._params, servers, self._latency)
        self._goals = 1
        self._changes = [time / 1000.0 for time in self._script.get("goals", [])]
        self._cancels = [time / 1000.0 for time in self._script.get("cancels", [])]

    def run(self) -> TreeReplay:
        """Navigate to all goals."""
        count, pause = self._script.get("runs", [1, 0])
        for number in range(count):
            if number:
                self._board.clock.now += pause / 1000.0
                self._goals += 1
            self.runs.append(self._navigate())
            if self.runs[-1].status == "limit":
                break
        for server in self._servers.values():
            server.advance(self._board.clock.now)
            server.log_answers()
        return self

    def _navigate(self) -> Run:
        """Navigate to one goal."""
        start = self._board.clock.now
        self._board.events.clear()
        self._log(start, "navigate", f"goal {self._goals}")
        loop = TreeLoop(self._tree, self._board.clock, TICK, self._change_goal, self._release)
        status = self._tick(loop)
        self._board.clock.now = loop.next_tick if status in END.values() else self._board.clock.now
        if self._release == "jazzy":
            halt_tree(self._tree)
        elif status != "canceled":
            self._tree.stop()
        end = self._board.clock.now
        self._log(end, "end", status)
        recoveries = sum(event.kind in RECOVERY_KINDS for event in self._board.events)
        return Run(microseconds(start), microseconds(end), status, recoveries)

    def _tick(self, loop: TreeLoop) -> str:
        """Tick until the navigation ends; returns how it ended."""
        limit = self._script.get("limit", LIMIT * 1000.0) / 1000.0
        while loop.status is Status.RUNNING:
            if self._cancels and self._cancels[0] <= loop.next_tick + TIME_RESOLUTION:
                self._cancels.pop(0)
                loop.cancel()
                return "canceled"
            if loop.next_tick >= limit - TIME_RESOLUTION:
                self._board.clock.now = loop.next_tick
                return "limit"
            loop.tick()
        return END[loop.status]

    def _change_goal(self, now: float) -> None:
        """Write the tick down, and change the goal on the blackboard if that is due."""
        self.ticks.append(microseconds(now))
        while self._changes and self._changes[0] <= now + TIME_RESOLUTION:
            self._changes.pop(0)
            self._goals += 1
            self._log(now, "goal_changed", f"goal {self._goals}")

    def _clear(self, clear: Clear) -> float:
        """Clear a costmap; returns how long the answer takes, s."""
        which = clear.costmap
        name = f"{which}_costmap/clear_entirely_{which}_costmap"
        now = self._board.clock.now
        self._log(now, "service", name)
        if which in self._costmaps:
            self._costmaps[which].is_current(now)
            self._costmaps[which].outdate()
        answer = next(self._answers.get(name, iter(())), SERVICE_TIME * 1000.0)
        return NEVER if answer < 0 else answer / 1000.0

    def _make_server(self, kind: str) -> LoggedServer:
        waits_for = {"planner": "global", "follow": "local"}.get(kind, "")
        executor = ScriptedExecutor(kind, self._script, self._release, self._log, self._costmaps.get(waits_for))
        number = self._numbers.__next__
        return LoggedServer(executor, self._latency, self._log, ACTIONS[kind], number, self._describer(kind))

    def _describer(self, kind: str) -> Callable[[Any], str]:
        bt = self._params.bt
        allowance = f"time_allowance {bt.time_allowance:g}"
        texts = {
            "planner": "",
            "spin": f"target_yaw {bt.spin_dist:g} {allowance}",
            "wait": f"time {bt.wait_duration:g}",
            "backup": f"target {bt.backup_dist:g} speed {bt.backup_speed:g} {allowance}",
        }
        return describe_path if kind == "follow" else lambda goal: texts[kind]

    def _log(self, now: float, kind: str, text: str) -> None:
        self.events.append((microseconds(now), kind, text))


def describe_path(path: tuple[Pose, ...]) -> str:
    """Return the number of a path, the x of its only pose."""
    return f"path {path[0].x:g}" if path else "path empty"


def costmaps_of(scenario: Record) -> dict[str, ReplayedCostmap]:
    """Return the costmaps that planner and controller wait for; none if the scenario knows none."""
    if "global_update_phase_ms" not in scenario:
        return {}
    return {
        "global": ReplayedCostmap(GLOBAL_FREQUENCY, scenario["global_update_phase_ms"] / 1000.0),
        "local": ReplayedCostmap(LOCAL_FREQUENCY, scenario["local_update_phase_ms"] / 1000.0),
    }


def read_script(lines: list[str]) -> dict[str, Any]:
    """Return a script that is written in lines such as ``F follow_path 350 6 0``, what becomes of every attempt."""
    kinds = {action: kind for kind, action in ACTIONS.items()}
    rests = (line.split()[1:] for line in lines)
    return {f"{kinds[action]}_rest": [float(time), int(code), int(error)] for action, time, code, error in rests}


def microseconds(seconds: float) -> int:
    """Return a time in whole us."""
    return round(seconds * 1e6)


def in_order(events: list[Any]) -> list[Event]:
    """Return events by time; those of one time by their text, because their order does not matter."""
    return sorted((int(time), str(text), str(kind)) for time, kind, text in events)


def each_tree(oracle: AroundOracle) -> Iterator[tuple[str, Record, NDArray[np.int64], TreeReplay]]:
    """Yield name, recording, recorded ticks (us) and replay of every scenario that is defined."""
    for release in oracle.releases:
        tree = oracle.tree(release)
        steps, offset = tree.changes["tick_step_us"].astype(np.int64), tree.changes["tick_offset"]
        for scenario, (first, last) in zip(tree.scenarios, itertools.pairwise(offset), strict=True):
            name = f"{release} {scenario['id']}"
            if name != UNDEFINED:
                yield name, scenario, np.cumsum(steps[first:last]), TreeReplay(scenario, release).run()


def is_identical(scenario: Record, ticks: NDArray[np.int64], replay: TreeReplay) -> bool:
    """Whether all events, ticks and runs are the recorded ones, to the us."""
    recorded = [Run(*(run[name] for name in Run._fields)) for run in scenario["runs"]]
    return (
        recorded == replay.runs
        and in_order(scenario["events"]) == in_order(replay.events)
        and np.array_equal(ticks, replay.ticks)
    )


def end_error(scenario: Record, replay: TreeReplay) -> float:
    """Largest difference of the ends of the runs, s; infinite if their number differs."""
    if len(scenario["runs"]) != len(replay.runs):
        return NEVER
    ends = zip(scenario["runs"], replay.runs, strict=True)
    return float(max(abs(recorded["end_us"] - ours.end_us) for recorded, ours in ends)) / 1e6


def tree_measures(oracle: AroundOracle) -> list[Measure]:
    """Share of scenarios with the recorded events; largest and median errors of the ends."""
    events, ends = Cases("tree_events_identical", ">= 1"), Cases("tree_end_time_err_ms_max", "<= 10")
    waits = Cases("costmap_wait_end_time_err_s_median", "<= 0.01")
    for name, scenario, ticks, replay in each_tree(oracle):
        events.add(float(not is_identical(scenario, ticks, replay)), name)
        ends.add(1000.0 * end_error(scenario, replay), name)
    for scenario in oracle.costmap_waits:
        waits.add(end_error(scenario, TreeReplay(scenario, "humble").run()), str(scenario["id"]))
    return [events.agreement(), ends.largest(), waits.median()]
