"""run_episode: one run of one controller on one scenario, recorded."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from controllers.base import Context, Controller
from controllers.diagnosis import diagnose
from controllers.navigator.navigator import Navigator
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.groups import RewardSettings
from gym_mapbench.env.single import MapBenchEnv
from gym_mapbench.env.task import TOUCHED
from gym_mapbench.errors import ConfigError, NoPathError
from gym_mapbench.metrics.episode import Episode, Event, Outcome
from gym_mapbench.world.scenario import Scenario

Floats = NDArray[np.float64]
FAILURE_KINDS = tuple(kind for kind in get_args(Outcome) if kind != "goal")
"""How a controller may say that its run failed."""
OnStep = Callable[[dict[str, Any], dict[str, Any]], object]
"""Takes the observation and the info of an env."""


def environment_for(config: EnvConfig, controller: Controller, *, own_goal_check: bool = True) -> MapBenchEnv:
    """Build the env a controller needs: what it observes, in SI units, and who decides that the goal is reached.

    A controller with a ``scan_rate`` gets its scans at that rate; those in between are not computed. Nor is the
    progress that the env would reward. One with ``fit`` says itself which sensors it needs.

    Args:
        config: The env without regard to the controller.
        controller: Who will drive.
        own_goal_check: Whether a controller with ``decides_goal`` decides when the goal is reached, and not the env.
            Nav2's goal checker starts afresh with every new path and the env's does not, so the two may disagree.
    """
    fit = getattr(controller, "fit", None)
    if fit is not None:
        config = fit(config)
        if not isinstance(config, EnvConfig):
            raise ConfigError(f"fit of a controller: expected an EnvConfig, got {config!r:.80}")
    keys = controller.observation_keys
    if isinstance(keys, str) or not isinstance(keys, Iterable):
        raise ConfigError(f"observation_keys of a controller: expected a tuple of names, got {keys!r:.80}")
    changes: dict[str, Any] = {
        "observation": tuple(keys),
        "action": "physical",
        "reward": RewardSettings(progress=0.0),
    }
    if own_goal_check and getattr(controller, "decides_goal", False):
        changes["goal_ends_episode"] = False
    scan_rate = getattr(controller, "scan_rate", None)
    if scan_rate is not None and config.lidar.scan_rate is None:
        changes["lidar"] = config.lidar.replace(scan_rate=scan_rate)
    return MapBenchEnv(config=config.replace(**changes))


def run_episode(
    env: MapBenchEnv,
    controller: Controller,
    scenario: Scenario,
    *,
    name: str,
    seed: int,
    noise_seed: int | None = None,
    watch: Callable[[Controller], object] | None = None,
    on_step: OnStep | None = None,
) -> Episode:
    """Run a controller on ``scenario`` once, from reset to the end.

    Args:
        env: An env made by :func:`environment_for` for this controller.
        controller: The policy; it is reset here.
        scenario: Map, start and goal.
        name: Name under which the controller is reported.
        seed: Seed of the controller's generator, and of the env's unless ``noise_seed`` is given.
        noise_seed: Seed of the env's own noise; the same for all controllers gives common random numbers.
        watch: Called with the controller after every command that is driven.
        on_step: Called with the observation and the info of the reset and of every step.

    Returns:
        The recorded run; one of outcome ``planner_failure`` where the controller observes a path and there is none.
    """
    try:
        observation, info = env.reset(seed=seed if noise_seed is None else noise_seed, options={"scenario": scenario})
    except NoPathError as error:
        return _without_path(env, scenario, name, seed, str(error))
    context = context_of(env.config, scenario, seed)
    controller.reset(context)
    log, info = _drive(env, controller, observation, info, watch, on_step)
    outcome, reason = _outcome(controller, info)
    trajectory, events = log.trajectory, _events(controller, log)
    if outcome != "goal":
        reason = f"{reason}; {diagnose(trajectory, context.control_period, events, _explanation(controller))}"
    return Episode(
        scenario=scenario,
        controller=name,
        seed=seed,
        outcome=outcome,
        reason=reason,
        time=float(info["time"]),
        control_period=context.control_period,
        trajectory=trajectory,
        commands=_rows(log.commands, 2),
        path=np.asarray(getattr(controller, "first_path", np.empty((0, 3)))),
        first_contact_time=log.first_contact_time,
        events=events,
        controller_seconds=log.controller_seconds,
        robot=env.robot,
    )


def _drive(
    env: MapBenchEnv,
    controller: Controller,
    observation: dict[str, Any],
    info: dict[str, Any],
    watch: Callable[[Controller], object] | None,
    on_step: OnStep | None,
) -> tuple[_Log, dict[str, Any]]:
    """Run from the observation of a reset to the end; return the log and the information of the last step."""
    log = _Log(info)
    if on_step is not None:
        on_step(observation, info)
    while info["outcome"] == "running":
        began = time.perf_counter()
        answer = controller.act(observation)
        log.controller_seconds += time.perf_counter() - began
        if getattr(controller, "status", "running") != "running":
            break
        if watch is not None:
            watch(controller)
        command = _command(answer)
        observation, _, _, _, info = env.step(command)
        log.add(command, info)
        if on_step is not None:
            on_step(observation, info)
    return log, info


def _command(answer: Any) -> Floats:
    """Return the answer of a controller as an array of its own, which the env checks."""
    try:
        if answer is not None:  # which NumPy takes for a number
            return np.array(answer, dtype=np.float64)
    except (TypeError, ValueError):
        pass
    raise ConfigError(f"action: expected two numbers, got {answer!r:.80}")


def _without_path(env: MapBenchEnv, scenario: Scenario, name: str, seed: int, reason: str) -> Episode:
    """Return the run of a controller that could not begin, as the path that it observes cannot be planned."""
    return Episode(
        scenario=scenario,
        controller=name,
        seed=seed,
        outcome="planner_failure",
        reason=reason,
        time=0.0,
        control_period=1.0 / env.config.control_hz,
        trajectory=np.array([[*scenario.start, 0.0, 0.0]]),
        commands=np.empty((0, 2)),
        path=np.empty((0, 3)),
        first_contact_time=None,
        events=(),
        controller_seconds=0.0,
        robot=env.robot,
    )


def _explanation(controller: Controller) -> str:
    """Return the controller's own explanation of its run."""
    return controller.explain() if isinstance(controller, Navigator) else ""


def context_of(config: EnvConfig, scenario: Scenario, seed: int) -> Context:
    """Return the context that a controller gets before a run."""
    return Context(
        robot=config.robot,
        grid=scenario.map,
        start=scenario.start,
        goal=scenario.goal,
        control_period=1.0 / config.control_hz,
        rng=np.random.default_rng(seed),
        lidar=config.mounted_lidar,
    )


class _Log:
    """The log of a run."""

    def __init__(self, info: dict[str, Any]) -> None:
        self.poses: list[Floats] = [info["pose"]]
        self.velocities: list[Floats] = [info["velocity"]]
        self.commands: list[Floats] = []
        self.contacts: list[tuple[float, str]] = []
        self.touched = 0
        self.controller_seconds = 0.0

    @property
    def first_contact_time(self) -> float | None:
        return self.contacts[0][0] if self.contacts else None

    @property
    def trajectory(self) -> Floats:
        return np.hstack([_rows(self.poses, 3), _rows(self.velocities, 2)])

    def add(self, command: Floats, info: dict[str, Any]) -> None:
        self.commands.append(command)
        self.poses.append(info["pose"])
        self.velocities.append(info["velocity"])
        touched = TOUCHED.index(info["touched"])
        if began := touched & ~self.touched:  # a body may come while the robot slides along a wall
            self.contacts.append((float(info["time"]), TOUCHED[began]))
        self.touched = touched


def _rows(recorded: list[Any], width: int) -> Floats:
    """Stack the recorded arrays, read-only; their bytes, as NumPy would look at each array."""
    return np.frombuffer(b"".join(recorded)).reshape(-1, width)


def _outcome(controller: Controller, info: dict[str, Any]) -> tuple[Outcome, str]:
    """Return outcome and reason, as the env or a controller with its own goal checker decides."""
    status = getattr(controller, "status", "running")
    if status == "succeeded":
        return "goal", ""
    if status == "failed":
        kind: Outcome = getattr(controller, "failure_kind", "controller_failure")
        if kind not in FAILURE_KINDS:
            raise ConfigError(f"failure_kind of a controller: expected one of {FAILURE_KINDS}, got {kind!r:.80}")
        return kind, str(getattr(controller, "failure_reason", ""))
    if status != "running":
        raise ConfigError(f"status of a controller: expected running, succeeded or failed, got {status!r:.80}")
    outcome: Outcome = info["outcome"]
    reasons = {
        "goal": "",
        "collision": f"the robot touched a {info['touched']}",
        "timeout": "the time limit was reached",
    }
    return outcome, reasons[outcome]


def _events(controller: Controller, log: _Log) -> tuple[Event, ...]:
    contacts = [Event(time, "contact", "" if touched == "wall" else touched) for time, touched in log.contacts]
    return tuple(sorted([*getattr(controller, "events", ()), *contacts], key=lambda event: event.time))
