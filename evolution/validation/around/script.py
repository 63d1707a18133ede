"""Scripted servers: they do what a recorded scenario says, by the rules of our own action servers."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

from controllers.navigator.actions import ActionServer, GoalHandle, Outcome, Result
from controllers.navigator.costmap_wait import CostmapWait, UpdatedCostmap
from controllers.navigator.latency import Latency
from controllers.navigator.rate import NEVER, TIME_RESOLUTION
from evolution.validation.around.recordings import Record
from gym_mapbench.releases import Release
from gym_mapbench.world.scenario import Pose

Log = Callable[[float, str, str], None]
Attempt = tuple[float, int, int]

SUCCEEDED, ABORTED, REJECTED = 4, 6, -1
DEFAULT_REST: dict[str, Attempt] = {
    "planner": (20, SUCCEEDED, 0),
    "smoother": (5, SUCCEEDED, 0),
    "follow": (10000, SUCCEEDED, 0),
    "spin": (1800, SUCCEEDED, 0),
    "wait": (5000, SUCCEEDED, 0),
    "backup": (6100, SUCCEEDED, 0),
}
ACTIONS = {
    "planner": "compute_path_to_pose",
    "smoother": "smooth_path",
    "follow": "follow_path",
    "spin": "spin",
    "wait": "wait",
    "backup": "backup",
}
LIMIT = 1e6
PERIODS = {"planner": LIMIT, "smoother": LIMIT, "follow": 0.05, "spin": 0.1, "wait": 0.1, "backup": 0.1}
"""Seconds between two looks at cancellations and new goals; planner and smoother never look."""
EMPTY: dict[Release, Attempt] = {"humble": (0, ABORTED, 0), "jazzy": (0, ABORTED, 104)}
"""What becomes of an empty path."""


class Goal(NamedTuple):
    """A goal with its number."""

    number: int
    goal: Any


def attempts_of(script: Record, kind: str) -> Iterator[Attempt]:
    """Yield what becomes of each goal of one server: duration, ms, status code and error code."""
    yield from script.get(kind, [])
    while True:
        yield script.get(f"{kind}_rest", DEFAULT_REST[kind])


class ScriptedExecutor:
    """Executes goals as scripted.

    Args:
        kind: Which server it is.
        script: The scenario's script.
        release: The release of Nav2.
        log: Takes the time, kind and text of what happens.
        costmap: The costmap that the server waits for; None for none.

    Attributes:
        next_time: When the next cycle begins, s.
    """

    def __init__(
        self, kind: str, script: Record, release: Release, log: Log, costmap: UpdatedCostmap | None = None
    ) -> None:
        self._empty = EMPTY[release]
        self._kind, self._action, self._log = kind, ACTIONS[kind], log
        self._script = attempts_of(script, kind)
        self._period = PERIODS[kind]
        self._wait = None if costmap is None else CostmapWait(costmap, NEVER)
        self._number = self._paths = 0
        self._next = next(self._script)
        self._until = NEVER
        self.next_time = NEVER

    @property
    def listens(self) -> bool:
        """Whether cancellations and new goals are looked at before the next step, unless that is the end."""
        is_waiting = self._wait is not None and self._wait.is_waiting
        is_ending = self.next_time >= self._until - TIME_RESOLUTION
        return self._kind != "planner" and not is_waiting and not is_ending

    def accepts(self, goal: Goal) -> bool:
        """Return whether the script takes the goal."""
        if self._next[1] != REJECTED:
            return True
        self._take_attempt()
        return False

    def begin(self, goal: Goal, now: float) -> None:
        """Begin the next attempt."""
        is_empty = self._kind == "follow" and not len(goal.goal)
        milliseconds, self._code, self._error = self._take_empty() if is_empty else self._take_attempt()
        self._log(now, "server_begin", f"{self._action} {goal.number} attempt {self._number}")
        self._waited, self._until, self.next_time = False, now + milliseconds / 1000.0, now
        self._began = now
        self._milliseconds = milliseconds

    def update(self, goal: Goal, now: float) -> bool:
        """Go on with the attempt if it is one of the controller's."""
        if self._kind != "follow":
            return False
        self._log(now, "server_update", f"{self._action} {goal.number}")
        return True

    def step(self, now: float) -> Outcome | None:
        """End the attempt if its time has come."""
        if self._wait is not None and not self._wait.is_over(now):
            self.next_time, self._waited = self._wait.next_time, True
            return None
        if self._waited and self._kind == "planner":
            self._waited, self._until = False, now + self._milliseconds / 1000.0
        if now >= self._until - TIME_RESOLUTION:
            return self._outcome()
        cycles = (now - self._began + TIME_RESOLUTION) // self._period + 1.0
        self.next_time = min(self._began + cycles * self._period, self._until)
        return None

    def cancel(self) -> None:
        """Do nothing: there is no robot."""

    def _take_attempt(self) -> Attempt:
        taken, self._next = self._next, next(self._script)
        self._number += 1
        return taken

    def _take_empty(self) -> Attempt:
        self._number += 1
        return self._empty

    def _outcome(self) -> Outcome:
        if self._code != SUCCEEDED:
            return Outcome(Result.ABORTED, self._error)
        self._paths += 1
        return Outcome(Result.SUCCEEDED, value=(Pose(float(self._paths), 0.0),))


class LoggedServer(ActionServer):
    """One of our action servers that writes down what happens.

    Args:
        executor: What it executes.
        latency: How long messages take.
        log: Takes the time, kind and text of what happens.
        name: Name of the action.
        number: Returns the number of the next goal.
        describe: Describes a goal.
    """

    def __init__(
        self,
        executor: ScriptedExecutor,
        latency: Latency,
        log: Log,
        name: str,
        number: Callable[[], int],
        describe: Callable[[Any], str],
    ) -> None:
        super().__init__(executor, latency)
        self._log, self._name, self._number, self._describe = log, name, number, describe
        self.handles: list[GoalHandle] = []

    def send(self, goal: Any, now: float) -> GoalHandle:
        """Send a goal to the server."""
        handle = super().send(Goal(self._number(), goal), now)
        self.handles.append(handle)
        self._log(now, "goal_sent", f"{self._name} {handle.goal.number} {self._describe(goal)}")
        return handle

    def request_cancel(self, handle: GoalHandle, now: float) -> float:
        """Ask the server to cancel a goal; returns when its answer comes, s."""
        self._log(now, "cancel_sent", f"{self._name} {handle.goal.number}")
        return super().request_cancel(handle, now)

    def end(self, handle: GoalHandle, outcome: Outcome, now: float) -> None:
        """End a goal."""
        super().end(handle, outcome, now)
        self._log(now, "server_end", f"{self._name} {handle.goal.number} {outcome.result}")

    def log_answers(self) -> None:
        """Write down what the client has got so far: refusals and results."""
        for handle in self.handles:
            text = f"{self._name} {handle.goal.number}"
            if handle.is_accepted is False:
                self._log(handle.arrives, "server_reject", text)
            if handle.seen < NEVER and handle.outcome is not None:
                code = f" {handle.outcome.code}" if handle.outcome.code else ""
                self._log(handle.seen, "result", f"{text} {handle.outcome.result}{code}")
