"""From a job to its result: the function that worker processes call."""

from __future__ import annotations

import logging
import sys
import threading
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Future
from contextlib import AbstractContextManager, nullcontext
from contextvars import copy_context
from typing import Any

from controllers.base import Controller
from controllers.navigator.navigator import Navigator
from controllers.registry import CONTROLLERS, make_controller
from evolution.driving.jobs import ControllerSpec, Job, RunResult
from evolution.driving.one_run import OnStep, environment_for, run_episode
from evolution.driving.settings import DriveSettings
from evolution.driving.unknown_map import check_observed, without_map
from evolution.files import counted
from gym_mapbench.costmap import LAYERS
from gym_mapbench.errors import ConfigError
from gym_mapbench.metrics import measure
from gym_mapbench.metrics.episode import Episode
from gym_mapbench.planners import PLANNERS
from gym_mapbench.smoothers import SMOOTHERS
from gym_mapbench.world.clearance import check_clearance
from gym_mapbench.world.motions import MOTIONS
from gym_mapbench.world.scenario import Scenario

LOG = logging.getLogger(__name__)
BUILD_SECONDS = 60.0
"""How long a third party's controller may take to be made before the first run."""
MODEL = ".zip"
COARSE = 0.5
"""Largest side of a cell without a warning, m."""


def build_controller(spec: ControllerSpec, settings: DriveSettings) -> Controller:
    """Make the controller that ``spec`` names, with the navigation of ``settings``.

    Raises:
        ConfigError: If there is no such controller, parameter or model file, or it observes the map where that is
            unknown.
    """
    params: dict[str, Any] = dict(spec.params)
    controller = make_controller(spec.registered_name, navigation=settings.navigation, label=spec.name, **params)
    if settings.unknown_map:
        check_observed(controller, spec.name)
    return controller


def try_controllers(specs: Iterable[ControllerSpec], settings: DriveSettings) -> None:
    """Make every controller once, so that errors are reported before the first run.

    Raises:
        ConfigError: Naming the first that cannot be made, that workers cannot find, or that does not fit the control
            frequency or the sensors of the world.
    """
    PLANNERS.for_workers(settings.navigation.planner.name)
    for smoother in settings.navigation.smoothers.values():
        SMOOTHERS.for_workers(smoother.kind)
    for costmap in settings.navigation.costmaps.values():
        for layer in costmap.plugins:
            LAYERS.for_workers(layer)
    for spec in specs:
        CONTROLLERS.for_workers(spec.registered_name)
        with _blaming(spec, settings):
            controller = _built_in_time(spec, settings)
            environment_for(settings.environment, controller)
        if isinstance(controller, Navigator):
            controller.check_frequency(1.0 / settings.environment.control_hz)


def _built_in_time(spec: ControllerSpec, settings: DriveSettings) -> Controller:
    """Make a controller; one of a third party in a thread, which is left behind if its constructor hangs.

    In a worker the time limit of a run ends such a constructor, but nothing else ends it in this process.
    """
    name = spec.registered_name
    if _is_nav2(spec, settings) or name.endswith(MODEL):
        return build_controller(spec, settings)
    built: Future[Controller] = Future()

    def build() -> None:
        try:
            built.set_result(build_controller(spec, settings))
        except BaseException as error:
            built.set_exception(error)

    threading.Thread(target=copy_context().run, args=(build,), daemon=True).start()
    try:
        return built.result(BUILD_SECONDS)
    except TimeoutError:
        raise ConfigError(f"controller {name!r}: was not made within {BUILD_SECONDS:g} s") from None


def _is_nav2(spec: ControllerSpec, settings: DriveSettings) -> bool:
    """Whether a controller is one of Nav2's, and not a third party's or a model."""
    return spec.registered_name in CONTROLLERS.built_in or spec.registered_name in settings.navigation.controllers


def _blaming(spec: ControllerSpec, settings: DriveSettings) -> AbstractContextManager[None]:
    """Say in one line what a third party's controller, or a policy, raises."""
    return nullcontext() if _is_nav2(spec, settings) else CONTROLLERS.blamed(spec.registered_name)


def check_room(scenarios: Iterable[Scenario], settings: DriveSettings) -> None:
    """Refuse maps if the robot can stand at start and goal on none of them.

    If it can on some of them, runs on the others end in ``error`` with the reason; a warning says how many. Another
    warning names options of the env that controllers do not use.

    Raises:
        ConfigError: Naming the first of the maps, or a motion of a body that workers cannot find.
    """
    scenarios = list(scenarios)
    _warn_of_coarse_cells(scenarios)
    _warn_of_unused_options(settings)
    problems = [f"{scenario.name}: {why}" for scenario in scenarios if (why := _why_no_room(scenario, settings))]
    if not problems:
        return
    if len(problems) == len(scenarios):
        raise ConfigError(problems[0])
    LOG.warning(
        "no room for the robot in %d of %s, where every run ends in an error and counts as a failure; the first is %s",
        len(problems),
        counted(len(scenarios), "task"),
        problems[0],
    )


def _warn_of_coarse_cells(scenarios: Sequence[Scenario]) -> None:
    coarse = [scenario for scenario in scenarios if scenario.map.resolution > COARSE]
    if coarse:
        LOG.warning(
            "%s has cells of %g m, on which controllers may stand still; see 'mapbench maps convert --split'",
            coarse[0].name,
            coarse[0].map.resolution,
        )


def _warn_of_unused_options(settings: DriveSettings) -> None:
    if settings.unused:
        LOG.warning(
            "environment: %s %s no effect here: maps and tasks are given apart from it, and controllers have "
            "observations and actions of their own",
            ", ".join(settings.unused),
            "has" if len(settings.unused) == 1 else "have",
        )


def _why_no_room(scenario: Scenario, settings: DriveSettings) -> str:
    """Say why the robot cannot stand at start and goal of a task; empty if it can."""
    for body in scenario.bodies:
        MOTIONS.for_workers(body.motion.name)
    try:
        check_clearance(scenario, settings.environment.robot)
    except ConfigError as error:
        return str(error)
    return ""


def record(job: Job, watch: Callable[[Controller], object] | None = None, on_step: OnStep | None = None) -> Episode:
    """Run a job and return the recorded episode; what a third party's controller raises passes as it is.

    Args:
        job: The run.
        watch: Called with the controller after every command.
        on_step: Called with the observation and the info of the reset and of every step.
    """
    settings = job.settings
    if settings.unknown_map:
        settings = settings.replace(navigation=without_map(settings.navigation, job.scenario.map))
    controller = build_controller(job.controller, settings)
    env = environment_for(settings.environment, controller, own_goal_check=settings.own_goal_check)
    _seed_pytorch(job.seed)
    return run_episode(
        env,
        controller,
        job.scenario,
        name=job.controller.name,
        seed=job.seed,
        noise_seed=job.noise_seed,
        watch=watch,
        on_step=on_step,
    )


def drive(job: Job, watch: Callable[[Controller], object] | None = None) -> Episode:
    """Run a job and return the recorded episode, where nothing else reports what a controller raises.

    Args:
        job: The run.
        watch: As for :func:`record`.

    Raises:
        PluginError: If a third party's controller fails.
    """
    with _blaming(job.controller, job.settings):
        return record(job, watch)


def _seed_pytorch(seed: int) -> None:
    """Let the global generator of PyTorch, from which a policy may sample, start from a seed, if it is loaded."""
    if (torch := sys.modules.get("torch")) is not None:
        torch.manual_seed(seed)


def run_job(job: Job, on_step: OnStep | None = None) -> RunResult:
    """Run a job and return its result; wall-clock values are apart from the values that a seed reproduces.

    Args:
        job: The run.
        on_step: As for :func:`record`.
    """
    return result_of(record(job, on_step=on_step), job.metrics)


def result_of(episode: Episode, also: Iterable[str] = ()) -> RunResult:
    """Return the result of an episode, with further metrics besides the project's own."""
    metrics = measure(episode, also)
    steps = max(1, len(episode.commands))
    return RunResult(
        outcome=episode.outcome,
        time_s=episode.time,
        path_length_m=metrics.pop("path_length"),
        reason=episode.reason,
        metrics=metrics,
        timings={"controller_ms": 1000 * episode.controller_seconds / steps},
        seed=episode.seed,
    )
