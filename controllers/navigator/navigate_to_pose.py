"""NavigateToPose: the leaves of Nav2's default behaviour tree, and the blackboard that they share.

Source: the nodes of nav2_behavior_tree (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

from controllers.navigator import error_codes
from controllers.navigator.action_nodes import ActionNode, ServiceNode
from controllers.navigator.actions import ActionServer, Outcome, Result
from controllers.navigator.behaviors import Behavior
from controllers.navigator.latency import Latency
from controllers.navigator.rate import Clock
from controllers.navigator.robot_state import RobotOnMap
from gym_mapbench.metrics.episode import Event
from gym_mapbench.metrics.episode import Outcome as RunOutcome
from gym_mapbench.world.scenario import Pose

NO_PATH: tuple[()] = ()
"""What is on the blackboard while there is no path."""
PATH = "path"
"""The variable of the path that is followed, unless a tree names another."""


class Square(NamedTuple):
    """A square around the robot.

    Args:
        side: Its side, m.
        outside: Whether all but the square is meant.
    """

    side: float
    outside: bool


class Clear(NamedTuple):
    """What a service that clears a costmap is asked for.

    Args:
        costmap: ``local`` or ``global``.
        plugins: Names of the layers that are cleared; none for all.
        square: What is cleared of them; None for everything.
    """

    costmap: str
    plugins: tuple[str, ...] = ()
    square: Square | None = None


@dataclass
class Servers:
    """The servers that the leaves of the tree ask.

    Attributes:
        planner: Computes paths.
        controller: Follows paths.
        behaviors: Run the recoveries, by kind; one that does not exist fails.
        clear: Clears a costmap; returns how long the answer takes, s.
        keeps: Whether a path is kept near the goal instead of a new plan (Lyrical).
        is_path_valid: Whether a path is free from the pose nearest to the robot on.
        robot: What is measured of the robot.
        smoother: Smooths paths.
    """

    planner: ActionServer
    controller: ActionServer
    behaviors: Mapping[str, ActionServer]
    clear: Callable[[Clear], float]
    keeps: Callable[[Any], bool]
    is_path_valid: Callable[[Any], bool]
    robot: RobotOnMap
    smoother: ActionServer

    @cached_property
    def actions(self) -> tuple[ActionServer, ...]:
        """All servers of actions, in the order in which they advance."""
        return self.planner, self.smoother, self.controller, *self.behaviors.values()


@dataclass
class Blackboard:
    """What the leaves of the tree share during one run.

    Attributes:
        goal: The goal, on the map.
        clock: The time at which the tree is.
        paths: Global paths by the names of their variables, ``(n, 3)``.
        followed: Name of the path that is followed.
        plan_ends: Positions at which the plans of this run end; empty if there was none.
        goal_reached: Whether the controller server reached the end of a plan.
        failure: Kind and reason of the last failure of the planner, the smoother or the controller.
        codes: Jazzy's error codes of the last plan, smoothing and path followed, by the names of their variables.
        events: What happened so far, in order.
    """

    goal: Pose
    clock: Clock = field(default_factory=Clock)
    paths: dict[str, Any] = field(default_factory=dict)
    followed: str = PATH
    plan_ends: set[tuple[float, float]] = field(default_factory=set)
    goal_reached: bool = False
    failure: tuple[RunOutcome, str] = ("controller_failure", "")
    codes: dict[str, int] = field(default_factory=dict)
    events: list[Event] = field(default_factory=list)

    @property
    def path(self) -> Any:
        """The path that is followed; of no length before the first one and after a failed plan."""
        return self.path_named(self.followed)

    def path_named(self, name: str) -> Any:
        """Return the path in a variable; of no length if there is none."""
        return self.paths.get(name, NO_PATH)

    def write(self, name: str, path: Any) -> None:
        """Put a path in a variable."""
        self.paths[name] = path

    def has_had_path(self) -> bool:
        """Whether there was a path at any time."""
        return bool(self.plan_ends)

    def ends_at_goal(self, path: Any) -> bool:
        """Whether a path ends where a plan does; a path whose end was cut off does not."""
        return any(end in self.plan_ends for end in _ends_of(path))

    def would_recovery_help(self, variable: str, helped: Collection[int]) -> bool:
        """Whether the error code in a variable is one against which a recovery may help."""
        return self.codes.get(variable, error_codes.NONE) in helped

    def log(self, kind: str, detail: str = "") -> None:
        """Record an event that happens now."""
        self.events.append(Event(round(self.clock.now, 9), kind, detail))


class ComputePathToPose(ActionNode):
    """Asks the planner for a path from here to the goal.

    Args:
        board: The blackboard.
        server: The planner.
        latency: How long messages take.
        path: The variable that gets the path.
        code: The variable that gets the error code; none if empty.
    """

    def __init__(self, board: Blackboard, server: ActionServer, latency: Latency, path: str, code: str) -> None:
        super().__init__(board.clock, server, latency)
        self._board, self._path, self._code = board, path, code

    def make_goal(self) -> Pose:
        """Return the goal of the run."""
        return self._board.goal

    def on_result(self, outcome: Outcome) -> None:
        """Take the path; without one the blackboard has none."""
        board = self._board
        board.codes[self._code] = outcome.code
        if outcome.result is Result.SUCCEEDED:
            board.paths[self._path] = outcome.value
            board.plan_ends.update(_ends_of(outcome.value))
            board.log("replan")
            return
        board.paths[self._path] = NO_PATH
        if outcome.result is Result.ABORTED:
            board.failure = "planner_failure", outcome.reason
            board.log("replan_failure", outcome.reason)

    def halt(self) -> None:
        """Cancel the plan and forget the old one."""
        super().halt()
        self._board.paths[self._path] = NO_PATH


class FollowPath(ActionNode):
    """Has the controller server follow the newest path.

    Args:
        board: The blackboard.
        server: The controller server.
        latency: How long messages take.
        code: The variable that gets the error code; none if empty.
    """

    def __init__(self, board: Blackboard, server: ActionServer, latency: Latency, code: str) -> None:
        super().__init__(board.clock, server, latency)
        self._board, self._code = board, code

    def make_goal(self) -> Any:
        """Return the newest path, even if that is none: the server then aborts."""
        self._path = self._board.path
        return self._path

    def newer_goal(self) -> Any:
        """Return the newest path if it is another one than the path that is followed."""
        path = self._board.path
        return None if path is self._path or not len(path) else self.make_goal()

    def on_result(self, outcome: Outcome) -> None:
        """Remember whether the goal was reached, or why the path could not be followed."""
        board = self._board
        board.codes[self._code] = outcome.code
        if outcome.result is Result.SUCCEEDED:
            board.goal_reached |= board.ends_at_goal(self._path)
        elif outcome.result is Result.ABORTED:
            board.failure = "controller_failure", outcome.reason
            board.log(*board.failure)


def _ends_of(path: Any) -> list[tuple[float, float]]:
    """Return the position at which a path ends; none if it has no pose."""
    return [(float(x), float(y)) for x, y, _ in path[-1:]]


class ClearCostmap(ServiceNode):
    """Clears the global or the local costmap.

    Args:
        board: The blackboard.
        service: Clears it, as in :class:`Servers`.
        request: What is cleared.
    """

    def __init__(self, board: Blackboard, service: Callable[[Clear], float], request: Clear) -> None:
        super().__init__(board.clock)
        self._board, self._service, self._request = board, service, request

    def call(self) -> float:
        """Clear the costmap; returns how long the answer takes, s."""
        self._board.log(f"clear_{self._request.costmap}")
        return self._service(self._request)


class RunBehavior(ActionNode):
    """Has a behaviour server run the behaviour that ``make_behavior`` makes."""

    def __init__(
        self,
        board: Blackboard,
        kind: str,
        make_behavior: Callable[[], Behavior],
        server: ActionServer,
        latency: Latency,
        *,
        is_recovery: bool = True,
    ) -> None:
        super().__init__(board.clock, server, latency)
        self._board, self._kind, self._make_behavior = board, kind, make_behavior
        self._is_recovery = is_recovery

    def make_goal(self) -> Behavior:
        """Make the behaviour; as a recovery it is an event."""
        if self._is_recovery:
            self._board.log(self._kind)
        return self._make_behavior()

    def on_result(self, outcome: Outcome) -> None:
        """Do nothing: only the status counts."""
