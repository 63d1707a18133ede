"""Replies: what the server sends while it works."""

from __future__ import annotations

from typing import Literal

from pydantic import BaseModel, ConfigDict

from evolution.play.messages.requests import Point, PoseTuple, Scene


class Data(BaseModel):
    """What the server sends; made by this package, so its values are not checked for being in range."""

    model_config = ConfigDict(frozen=True)


class Way(Data):
    """A further part of the way of a run, while it is computed.

    Args:
        id: The ``drive``.
        variant: Name of the variant.
        repeat: Number of the run, from 0.
        first: Number of poses of this run that were sent before.
        poses: ``(t, x, y, yaw)`` after each control cycle, true values; the first is the start.
    """

    type: Literal["way"] = "way"
    id: int
    variant: str
    repeat: int
    first: int
    poses: list[tuple[float, float, float, float]]


class Run(Data):
    """The result of a run.

    Args:
        id: The ``drive``.
        variant: Name of the variant.
        repeat: Number of the run, from 0.
        outcome: ``goal``, ``collision``, ``timeout``, ``planner_failure``, ``controller_failure`` or ``error``.
        time: Simulated seconds until the end.
        length: Driven distance, m.
        clearance: Least distance to an obstacle, m; None if it was not measured.
        recoveries: Number of recoveries.
        sentence: Why the run did not reach the goal, as ``mapbench bench`` says it; empty if it did.
        where: Where the run ended, if it did not reach the goal.
    """

    type: Literal["run"] = "run"
    id: int
    variant: str
    repeat: int
    outcome: str
    time: float
    length: float
    clearance: float | None
    recoveries: int
    sentence: str
    where: Point | None


class AnswerRow(Data):
    """The runs of one variant together; times, lengths and clearances are of the runs at the goal.

    Args:
        variant: Name of the variant.
        runs: Number of runs.
        outcomes: Share of each outcome that occurred.
        time: Median time, s; None without a run at the goal, as for the following.
        time_from: Lower quartile of the time, s.
        time_to: Upper quartile of the time, s.
        length: Median length, m.
        clearance: Median of the least distance to an obstacle, m.
        recoveries: Mean number of recoveries of all runs.
    """

    variant: str
    runs: int
    outcomes: dict[str, float]
    time: float | None
    time_from: float | None
    time_to: float | None
    length: float | None
    clearance: float | None
    recoveries: float


class Answer(Data):
    """What all runs of a ``drive`` say together.

    Args:
        id: The ``drive``.
        table: A row for each variant, in their order.
        verdict: Sentences: who is better, and how certain that is with these repeats.
        gini: Gini coefficient of the median times; None if a variant has no run at the goal, or there is only one.
        command: The lines that repeat these runs in a terminal, in the folder of the saved files.
        files: Names of the files that the command reads; ``save/session`` gives all of them.
    """

    type: Literal["answer"] = "answer"
    id: int
    table: list[AnswerRow]
    verdict: list[str]
    gini: float | None
    command: list[str]
    files: list[str]


class CostGrid(Data):
    """A costmap.

    Args:
        origin: Position of the lower-left corner of cell (0, 0) in the map, m.
        yaw: Turn of the grid around that corner, rad: where the robot believes to be may differ from where it is.
        resolution: Side of a cell, m.
        height: Number of rows.
        width: Number of columns.
        costs: Base64 of the costs, a byte a cell: 0 free, 253 inscribed, 254 lethal, 255 unknown.
    """

    origin: Point
    yaw: float
    resolution: float
    height: int
    width: int
    costs: str


class Candidate(Data):
    """A command that DWB has considered.

    Args:
        linear: m/s.
        angular: rad/s.
        score: Sum of all critics, the lower the better; None if a critic refused the command.
        shares: What each critic adds to the score; empty if a critic refused the command.
        refused: The critic that refused it; empty if none did.
        points: Its trajectory in the map.
    """

    linear: float
    angular: float
    score: float | None
    shares: list[float]
    refused: str
    points: list[Point]


class DwbThoughts(Data):
    """What DWB considers: its candidates.

    Args:
        critics: Names of the critics, in the order of the shares.
        candidates: All commands of the cycle.
        chosen: Number of the best candidate; None if all were refused.
    """

    kind: Literal["dwb"] = "dwb"
    critics: list[str]
    candidates: list[Candidate]
    chosen: int | None


class MppiThoughts(Data):
    """What MPPI considers: its sampled trajectories.

    Args:
        samples: Some of the sampled trajectories, evenly chosen from the cheapest to the most expensive.
        costs: Cost of each of them.
        chosen: The trajectory of the weighted mean, whose first command is driven.
    """

    kind: Literal["mppi"] = "mppi"
    samples: list[list[Point]]
    costs: list[float]
    chosen: list[Point]


class RppThoughts(Data):
    """What RPP, or another follower of a carrot, considers.

    Args:
        carrot: The point of the path that it drives at.
        lookahead: Distance to look ahead, m.
        curvature: Of the arc to the carrot, 1/m.
        desired: Speed without regulation, m/s; the speed of the command is the regulated one.
    """

    kind: Literal["rpp"] = "rpp"
    carrot: Point
    lookahead: float
    curvature: float
    desired: float


Thoughts = DwbThoughts | MppiThoughts | RppThoughts


class Instant(Data):
    """What a robot believes and considers at an instant.

    Args:
        id: The ``drive``.
        variant: Name of the variant.
        repeat: Number of the run, from 0.
        time: Time of the control cycle, s.
        pose: Where the robot is.
        believed: Where the robot believes to be.
        velocity: Speeds at the beginning of the cycle: m/s, rad/s.
        command: The command of the cycle: m/s, rad/s; None if the controller does not say.
        plan: The global path in the map.
        local: The local costmap; None if the controller has none, as for the following.
        global_costmap: The inflated global costmap.
        lidar: Where the beams of the last scan ended, placed where the robot believes to be.
        thoughts: What the controller considers; None if it does not say.
    """

    type: Literal["instant"] = "instant"
    id: int
    variant: str
    repeat: int
    time: float
    pose: PoseTuple
    believed: PoseTuple
    velocity: tuple[float, float]
    command: tuple[float, float] | None
    plan: list[Point]
    local: CostGrid | None
    global_costmap: CostGrid | None
    lidar: list[Point]
    thoughts: Thoughts | None


class Offer(Data):
    """A changed map.

    Args:
        scene: The map.
        text: What changed, and what the controllers do there.
        gini: As in ``answer``.
        times: Median time of each variant, s; None without a run at the goal.
    """

    scene: Scene
    text: str
    gini: float | None
    times: dict[str, float | None]


class Offers(Data):
    """Progress of a ``search`` or of a ``why``, with the best changes so far.

    Args:
        id: The ``drive``.
        task: Which of the two.
        done: Runs so far.
        of: Most runs.
        finished: Whether these are the last offers.
        offers: The best changes, at most three, the best first.
        text: One sentence on what was found.
    """

    type: Literal["offers"] = "offers"
    id: int
    task: Literal["search", "why"]
    done: int
    of: int
    finished: bool
    offers: list[Offer]
    text: str


class Error(Data):
    """One line that says what cannot be done. ``id`` is None if the message could not be read."""

    type: Literal["error"] = "error"
    id: int | None
    message: str
