"""Observations: the space of every key, and its values.

``pose``, ``odom`` and ``velocity`` are float64, because controllers that are compared with Nav2's to 1e-9 read
them; the rest is float32. Every array of every observation is new.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from gym_mapbench.costmap import NO_INFORMATION, Costmap, CostmapParams, InflationLayer, build_static_costmap
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.groups import PathWindow
from gym_mapbench.errors import NoPathError
from gym_mapbench.kernels.observation import see_goal
from gym_mapbench.kernels.path import see_path
from gym_mapbench.kernels.people import see_people
from gym_mapbench.kernels.ranges import report_ranges
from gym_mapbench.planners.navfn import NavfnPlanner
from gym_mapbench.world.lidar import Lidar, LidarSettings
from gym_mapbench.world.localisation import StateEstimator
from gym_mapbench.world.noise import NoiseSettings, Streams
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.state import Records
from gym_mapbench.world.world import World

Floats = NDArray[np.float64]

FAR = 1e8
"""Bound of every coordinate, m; beyond what maps in UTM coordinates hold. The spaces must be finite."""
FAST = 1e3
"""Bound of every speed, m/s and rad/s."""

ScanNoise = tuple[NDArray[np.float32], NDArray[np.bool_]]
NO_NORMALS, NONE_LOST = np.empty(0, np.float32), np.empty(0, np.bool_)


def observation_space(config: EnvConfig) -> spaces.Dict:
    """Return the space of the keys chosen in ``config``.

    ``pose``: x, y (m), yaw (rad) on the map, as the localisation has them. ``odom``: the same in the odom frame, as
    wheel odometry has them. ``velocity``: v (m/s), omega (rad/s). ``goal``: x, y, yaw in the robot's frame. ``scan``:
    ranges from the scanner, m. ``path``: x, y of the first point, of the second..., in the robot's frame, m.
    ``costmap``: ``(1, cells, cells)`` Nav2 cost values, row 0 at the bottom. ``people``: for each of the
    nearest moving bodies, the nearest first: x, y (m), velocity along x and y (m/s), in the robot's frame, radius (m),
    1; zeros where there are fewer.
    """
    return spaces.Dict({key: SPACES[key](config) for key in config.observation})


def _vector(high: float, count: int, dtype: type = np.float32) -> spaces.Box:
    return spaces.Box(-high, high, (count,), dtype)


def _pose_space(dtype: type) -> spaces.Box:
    bounds: NDArray[Any] = np.array([FAR, FAR, math.pi], dtype=dtype)
    # The nearest float32 to pi lies above it, so both ends of (-pi, pi] are inside.
    return spaces.Box(-bounds, bounds, dtype=dtype)


SPACES: dict[str, Callable[[EnvConfig], spaces.Box]] = {
    "pose": lambda config: _pose_space(np.float64),
    "odom": lambda config: _pose_space(np.float64),
    "velocity": lambda config: _vector(FAST, 2, np.float64),
    "goal": lambda config: _pose_space(np.float32),
    "scan": lambda config: spaces.Box(0.0, config.lidar.range_max, (config.lidar.beams,), np.float32),
    "path": lambda config: _vector(FAR, 2 * config.path.points),
    "costmap": lambda config: spaces.Box(0, 255, (1, config.costmap.cells, config.costmap.cells), np.uint8),
    "people": lambda config: _vector(FAR, 6 * config.people.nearest),
}


class Moment(NamedTuple):
    """The robot's state in one control step, true and as it is estimated.

    Args:
        true: ``(3,)`` true pose on the map, m and rad.
        true_velocity: ``(2,)`` true speed (m/s) and turn rate (rad/s).
        estimate: ``(3,)`` pose on the map as the localisation has it, m and rad.
        odom: ``(3,)`` pose in the odom frame as wheel odometry has it.
        velocity: ``(2,)`` measured speed (m/s) and turn rate (rad/s).
    """

    true: Floats
    true_velocity: Floats
    estimate: Floats
    odom: Floats
    velocity: Floats


class Observer:
    """Observes the robot on one scenario.

    Args:
        config: Keys, sensors and noise.
        scenario: Map and task.
        world: What the scanner sees.
        start: Where the robot truly starts.
        streams: Generators of the noise.
        robots: The robot, ``(1,)`` ROBOT.

    Attributes:
        path: The global path, ``(n, 3)`` x, y (m), yaw (rad); None where it is not observed.

    Raises:
        NoPathError: If ``path`` is observed and there is none.
    """

    def __init__(
        self, config: EnvConfig, scenario: Scenario, world: World, start: Pose, streams: Streams, robots: Records
    ) -> None:
        self._config = config
        self._world = world
        self._streams = streams
        self._estimator = StateEstimator(config.noise, start, 1.0 / config.control_hz, streams, robots)
        self.goal = scenario.goal
        self._keys = config.observation
        self.path: NDArray[np.float64] | None = None
        if "scan" in self._keys:
            self._mounted = config.mounted_lidar
            self._lidar = Lidar(self._mounted, world)
            rate = config.lidar.scan_rate
            self._observations_per_scan = 1 if rate is None else max(1, round(config.control_hz / rate))
            self._observations = 0
        if "costmap" in self._keys:
            self.window = CostmapView(_plan_costmap(config, scenario), config.costmap.cells)
        if "path" in self._keys:
            self.path = plan_path(config, scenario)
            self.ahead = PathView(self.path, config.path)

    def observe(self, moment: Moment) -> dict[str, NDArray[Any]]:
        """Return the observation of a moment, noise included; call it once a control step."""
        return {key: CONTENTS[key](self, moment) for key in self._keys}

    def know(self) -> Moment:
        """Return the robot's present state, true and as odometry and localisation have it; call it as often."""
        state = self._estimator.advance()
        return Moment(state[:3], state[3:5], state[5:8], state[8:11], state[11:])

    def people(self, pose: Floats) -> NDArray[np.float32]:
        """Return the nearest bodies in the frame of a robot at a true pose, see :func:`observation_space`."""
        seen, world = np.empty((self._config.people.nearest, 6), dtype=np.float32), self._world
        see_people(pose, world.poses, world.velocities, world.radii, seen)
        return seen.ravel()

    def beams(self, pose: Pose) -> tuple[Pose, NDArray[np.float64]] | None:
        """Return where the beams start, and ``(beams, 2)`` world angle (rad) and range (m) of each, without noise.

        None where no scan is observed.
        """
        if "scan" not in self._keys:
            return None
        sensor = self._mounted.sensor_pose(pose)
        return sensor, np.stack([sensor.yaw + self._mounted.angles, self._lidar.scan(pose)], axis=1)

    def scan_or_hold(self, pose: Floats) -> NDArray[np.float32]:
        """Return a new scan from a true pose if one is due, or else the last scan again, in a new array."""
        if self._observations % self._observations_per_scan == 0:
            self._last_scan = self._scan(Pose(*pose.tolist()))
        self._observations += 1
        return self._last_scan.copy()

    def _scan(self, pose: Pose) -> NDArray[np.float32]:
        """Measure: noise on every range, then the beams that are lost or too near."""
        return report_scan(self._config.noise, self._mounted, self._lidar.scan(pose), *self.sample_scan_noise())

    def sample_scan_noise(self) -> ScanNoise:
        """Sample ``(beams,)`` standard normal numbers, and which beams are lost; empty where that noise is off."""
        noise, streams, beams = self._config.noise, self._streams, self._mounted.beams
        blurs = noise.scan or noise.scan_relative
        normals = streams.scan.standard_normal(beams, dtype=np.float32) if blurs else NO_NORMALS
        lost = streams.dropout.random(beams) < noise.scan_dropout if noise.scan_dropout else NONE_LOST
        return normals, lost


def report_scan(
    noise: NoiseSettings,
    lidar: LidarSettings,
    ranges: NDArray[np.float32],
    normals: NDArray[np.float32],
    lost: NDArray[np.bool_],
) -> NDArray[np.float32]:
    """Make ``(..., beams)`` ranges those that a scanner reports, with the noise from ``sample_scan_noise``."""
    spread, limits = (noise.scan, noise.scan_relative), (lidar.range_min or 0.0, lidar.range_max, lidar.no_range)
    report_ranges(ranges.reshape(-1), normals.reshape(-1), lost.reshape(-1), *spread, *limits)
    return ranges


CONTENTS: dict[str, Callable[[Observer, Moment], NDArray[Any]]] = {
    "pose": lambda observer, moment: moment.estimate,
    "odom": lambda observer, moment: moment.odom,
    "velocity": lambda observer, moment: moment.velocity,
    "goal": lambda observer, moment: in_robot_frame(observer.goal, moment.estimate),
    "scan": lambda observer, moment: observer.scan_or_hold(moment.true),
    "path": lambda observer, moment: observer.ahead.ahead_of(moment.estimate),
    "costmap": lambda observer, moment: observer.window.around(moment.estimate),
    "people": lambda observer, moment: observer.people(moment.true),
}


def in_robot_frame(goal: Pose, pose: Floats) -> NDArray[np.float32]:
    """Return ``(3,)`` x, y (m) and yaw (rad) of a goal, seen from a pose ``(3,)``."""
    seen = np.empty(3, dtype=np.float32)
    see_goal(*goal, pose, seen)
    return seen


class PathView:
    """The next points of a path from the robot on; the view never moves backwards along the path.

    Args:
        path: ``(n, 3)`` x, y (m), yaw (rad) from start to goal.
        window: How many points, how far apart.
    """

    def __init__(self, path: NDArray[np.float64], window: PathWindow) -> None:
        steps = np.hypot(*np.diff(path[:, :2], axis=0).T)
        along = np.concatenate([[0.0], np.cumsum(steps)])
        even = np.append(np.arange(0.0, along[-1], window.spacing), along[-1])
        self._points = np.stack([np.interp(even, along, path[:, 0]), np.interp(even, along, path[:, 1])], axis=1)
        self._count = window.points
        self._nearest = 0

    def ahead_of(self, pose: Floats) -> NDArray[np.float32]:
        """Return ``(2 * points,)`` x, y in the frame of a robot at ``(3,)``, m; the goal repeats at the path's end."""
        window = np.empty((self._count, 2), dtype=np.float32)
        self._nearest = see_path(self._points, self._nearest, *pose.tolist(), window)
        return window.ravel()


class CostmapView:
    """Square windows of a costmap; cells off the map are 255, unknown.

    Args:
        costmap: The whole map's.
        cells: Rows and columns of a window.
    """

    def __init__(self, costmap: Costmap, cells: int) -> None:
        self._cells = cells
        self._costmap = costmap
        self._costs = np.pad(costmap.costs, cells, constant_values=NO_INFORMATION)

    def around(self, pose: Floats) -> NDArray[np.uint8]:
        """Return ``(1, cells, cells)`` costs around the cell of a pose, which is at ``[0, cells // 2, cells // 2]``."""
        x, y, _ = pose.tolist()
        rows, cols = self._costmap.costs.shape
        row = math.floor((y - self._costmap.origin_y) / self._costmap.resolution)
        col = math.floor((x - self._costmap.origin_x) / self._costmap.resolution)
        first_row = min(max(row, 0), rows - 1) + self._cells - self._cells // 2
        first_col = min(max(col, 0), cols - 1) + self._cells - self._cells // 2
        window = self._costs[first_row : first_row + self._cells, first_col : first_col + self._cells]
        return window[np.newaxis].copy()


def plan_path(config: EnvConfig, scenario: Scenario) -> NDArray[np.float64]:
    """Return the global path of the env's observations, ``(n, 3)`` x, y (m), yaw (rad).

    Raises:
        NoPathError: If there is none.
    """
    *wide, narrowest = config.path.rooms
    for room in wide:
        with suppress(NoPathError):
            return NavfnPlanner().plan(_plan_costmap(config, scenario, room), scenario.start, scenario.goal)
    return NavfnPlanner().plan(_plan_costmap(config, scenario, narrowest), scenario.start, scenario.goal)


def has_path(config: EnvConfig, scenario: Scenario) -> bool:
    """Whether the planner finds the global path of the env's observations."""
    try:
        plan_path(config, scenario)
    except NoPathError:
        return False
    return True


def _plan_costmap(config: EnvConfig, scenario: Scenario, room: float = 0.0) -> Costmap:
    """Build the costmap of the whole map, for a robot with some room around it: static and inflation layer."""
    inflation = InflationLayer(
        inflation_radius=config.costmap.inflation_radius, cost_scaling_factor=config.costmap.cost_scaling_factor
    )
    params = CostmapParams(plugins=("static_layer", "inflation_layer"), inflation_layer=inflation)
    params = params.replace(footprint_padding=params.footprint_padding + room)
    return build_static_costmap(scenario.map, params, params.make_footprint(config.robot))
