"""Warm-up of a new worker: it loads the kernels before its first job, so that no run is charged for that.

On a machine without compiled kernels, loading compiles them. Workers that start together share this work: one worker
at a time does a drill, and the others then load its kernels from numba's cache.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from controllers.base import ControllerAbort, ControllerError, FollowerSetup, Twist
from controllers.nav2_params import NavigationParams, load_preset
from controllers.navigator.navigator import Navigator
from controllers.registry import FOLLOWERS
from evolution.driving.jobs import ControllerSpec, JobPlan
from evolution.driving.kernel_archive import import_shipped_kernels
from evolution.driving.kernel_files import is_compiling_off
from evolution.driving.one_run import context_of, environment_for, run_episode
from evolution.driving.settings import DriveSettings
from evolution.driving.worker import build_controller
from gym_mapbench.costmap import Costmap
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.task import distance_to_goal
from gym_mapbench.kernels.inflation import inflate
from gym_mapbench.releases import Release
from gym_mapbench.world.clearance import measure_clearance
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose, Scenario

try:
    import fcntl
except ImportError:  # not on Windows, where every worker compiles for itself
    fcntl = None  # type: ignore[assignment]

ROOM = ("#" * 50, *["#" + "." * 48 + "#"] * 48, "#" * 50)
TASK = Pose(0.6, 0.6), Pose(1.9, 1.9)
WORLD, MEASURES = "world", "measures"
BY_COST = ("mppi", "dwb", WORLD, MEASURES, "graceful", "rpp")
"""Drills by compile time, the longest first, so that two workers end at about the same time."""
PRESET_OF: dict[Release, str] = {"humble": "thesis", "jazzy": "jazzy", "lyrical": "lyrical"}
PAUSE_SECONDS = 0.05


def preparation_of(plans: Iterable[JobPlan]) -> Callable[[], None]:
    """Return a warm-up for workers that loads the kernels that some runs need, and no others.

    If nothing is compiled yet, the kernels that came with the package are taken where they are this machine's.
    """
    if not is_compiled():
        import_shipped_kernels()
    kinds: dict[Release, set[str]] = {}
    for plan in plans:
        navigation = plan.settings.navigation
        kinds.setdefault(navigation.release, set()).update(_kinds(plan.controllers, navigation))
    return partial(_warm_up_all, tuple((tuple(sorted(some)), release) for release, some in kinds.items()))


def _kinds(controllers: Iterable[ControllerSpec], navigation: NavigationParams) -> set[str]:
    """Return the kinds of those controllers that are Nav2's."""
    names = [spec.registered_name for spec in controllers]
    return {navigation.controller(name).kind for name in names if name in FOLLOWERS or name in navigation.controllers}


def _warm_up_all(of_releases: Iterable[tuple[tuple[str, ...], Release]]) -> None:
    for kinds, release in of_releases:
        warm_up(kinds, release)


def warm_up(kinds: Iterable[str] = ("dwb", "mppi", "rpp"), release: Release = "humble") -> None:
    """Load the kernels of the world and those of Nav2's controllers of these kinds, in the form a release needs."""
    settings = DriveSettings(
        environment=EnvConfig(time_limit=0.5, noise="nominal"), navigation=load_preset(PRESET_OF[release])
    )
    scenario = Scenario(GridMap.from_rows(ROOM), *TASK)
    drills: dict[str, Callable[[], None]] = {kind: partial(_decide, kind, settings, scenario) for kind in kinds}
    drills[WORLD] = partial(_drive, settings, scenario)
    drills[MEASURES] = partial(_measure, settings, scenario)
    _share({name: drills[name] for name in sorted(drills, key=_place)})


def is_compiled() -> bool:
    """Whether this machine seems to have compiled the kernels of this version of the code before, or must not."""
    if is_compiling_off():
        return True
    line = inflate.py_func.__code__.co_firstlineno  # type: ignore[attr-defined]
    return any(_cache().glob(f"inflation.inflate-{line}.*.nbi"))


def _cache() -> Path:
    """Return the directory in which the compiled kernels of one module are, as a sign of all."""
    return Path(inflate.stats.cache_path)  # type: ignore[attr-defined]


def _place(name: str) -> int:
    return BY_COST.index(name) if name in BY_COST else len(BY_COST)


def _share(drills: dict[str, Callable[[], None]]) -> None:
    """Do every drill, but never one that another worker is doing right now."""
    left = dict(drills)
    while left:
        for name in tuple(left):
            with _claim(name) as free:
                if free:
                    left.pop(name)()
        if left:
            time.sleep(PAUSE_SECONDS)


@contextmanager
def _claim(name: str) -> Iterator[bool]:
    """Whether no other process with these kernel files does the drill; none begins it while the ``with`` block lasts.

    The lock of a process ends with the process. Where files cannot be locked, every drill is free.
    """
    try:
        lock = (_cache() / f"{name}.lock").open("w")
    except OSError:
        yield True
        return
    with lock:
        yield _is_ours(lock)


def _is_ours(lock: IO[str]) -> bool:
    """Take a lock unless another process has it; whether it is ours, or there are no locks here."""
    if fcntl is None:
        return True
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True


def _drive(settings: DriveSettings, scenario: Scenario) -> None:
    """Drive for half a second through an empty room."""
    navigator = Navigator(_Turning(), settings.navigation, WORLD)
    run_episode(environment_for(settings.environment, navigator), navigator, scenario, name=WORLD, seed=0)


def _measure(settings: DriveSettings, scenario: Scenario) -> None:
    """Compute the map metrics: the shortest path and the clearance."""
    robot = settings.environment.robot
    distance_to_goal(scenario, robot).at(scenario.start.x, scenario.start.y)
    measure_clearance(scenario.map, robot, scenario.start)


def _decide(kind: str, settings: DriveSettings, scenario: Scenario) -> None:
    """Ask a controller for commands: on the way, facing away from the path, and at its end."""
    controller = build_controller(ControllerSpec(name=kind), settings)
    if not isinstance(controller, Navigator):
        raise TypeError(f"expected one of Nav2's controllers, got {kind}")
    follower = controller.follower
    follower.reset(controller.follower_setup(context_of(settings.environment, scenario, seed=0)))
    path = np.zeros((41, 3))
    path[:, 0] = np.linspace(0.0, 1.0, len(path))
    follower.set_plan(path)
    free = Costmap(np.zeros((60, 60), np.uint8), 0.05, -1.5, -1.5)
    for cycle, pose in enumerate((Pose(0.0, 0.0), Pose(0.0, 0.0, math.pi / 2), Pose(0.9, 0.0))):
        with suppress(ControllerError, ControllerAbort):
            follower.compute_velocity_commands(pose, Twist(0.1, 0.0), free, 0.05 * cycle)


class _Turning:
    """A path follower without kernels."""

    def reset(self, setup: FollowerSetup) -> None:
        """Forget nothing: nothing is known."""

    def set_plan(self, path: NDArray[np.float64]) -> None:
        """Ignore the plan."""

    move_plan = set_plan

    def compute_velocity_commands(self, pose: Pose, velocity: Twist, costmap: Costmap, now: float) -> Twist:
        """Drive a curve."""
        return Twist(0.1, 0.3)
