"""Episode: one recorded run, the only source of metrics, figures and replays."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.world.clearance import measure_clearance
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario

Outcome = Literal["goal", "collision", "timeout", "planner_failure", "controller_failure", "error"]


class Event(NamedTuple):
    """Something that happened during a run.

    ``kind`` is one of ``replan``, ``replan_failure``, ``smoothing_failure``, ``clear_local``, ``clear_global``,
    ``spin``, ``wait``, ``backup``, ``controller_failure``, ``planner_failure``, ``contact``. The ``detail`` of a
    contact is empty if only a wall was touched, otherwise ``body`` or ``wall and body``.
    """

    time: float
    kind: str
    detail: str = ""


RECOVERY_KINDS = frozenset({"clear_local", "clear_global", "spin", "wait", "backup"})


@dataclass(frozen=True)
class Episode:
    """One run of one controller on one scenario.

    Its arrays are read-only, so that no metric changes what the next one measures.

    Args:
        scenario: Map and task; its bodies are functions of time, and so need no record of their own.
        controller: Name of the controller.
        seed: Seed of the run.
        outcome: How it ended.
        reason: One line on why it ended like this; empty if the goal was reached.
        time: Simulated seconds until the end.
        control_period: Seconds between two rows of ``trajectory``.
        trajectory: ``(n + 1, 5)`` true x, y (m), yaw (rad), v (m/s), omega (rad/s), from the start pose on.
        commands: ``(n, 2)`` commanded v (m/s), omega (rad/s) of every control step.
        path: ``(k, 3)`` first global path, x, y (m), yaw (rad); empty if there was none.
        first_contact_time: Simulated seconds of the first touch of a wall or body, None if there was none.
        events: What happened, in order.
        controller_seconds: Wall-clock seconds spent inside the controller.
        robot: Shape and limits of the robot that drove.
    """

    scenario: Scenario
    controller: str
    seed: int
    outcome: Outcome
    reason: str
    time: float
    control_period: float
    trajectory: NDArray[np.float64]
    commands: NDArray[np.float64]
    path: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 3)))
    first_contact_time: float | None = None
    events: tuple[Event, ...] = ()
    controller_seconds: float = 0.0
    robot: RobotSpec = field(default_factory=RobotSpec)

    def __post_init__(self) -> None:
        for name in ("trajectory", "commands", "path"):
            frozen = np.asarray(getattr(self, name)).view()
            frozen.flags.writeable = False
            object.__setattr__(self, name, frozen)

    @cached_property
    def clearances(self) -> NDArray[np.float64]:
        """``(n + 1,)`` distance from the robot's outline to the nearest wall at every recorded pose, m."""
        clearances = measure_clearance(self.scenario.map, self.robot, self.trajectory)
        clearances.flags.writeable = False
        return clearances

    @property
    def success(self) -> bool:
        """Whether the goal was reached."""
        return self.outcome == "goal"
