"""Many worlds driven, judged and observed together, by one kernel for all of them.

The kernels are those of the single env. Where noise is sampled or Box2D is needed, the objects of the single env do it,
world by world.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import CONTENTS, Moment, report_scan
from gym_mapbench.env.single import MapBenchEnv, Observation
from gym_mapbench.env.task import OUTCOMES, REWARD_TERMS, TOUCHED, rules_of
from gym_mapbench.env.traffic import Mask, Traffic
from gym_mapbench.kernels.motion import drive_robots
from gym_mapbench.kernels.observation import read_robots, scan_worlds, see_goals
from gym_mapbench.kernels.task import judge_worlds
from gym_mapbench.world.lidar import directions
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.state import Worlds, drive_of
from gym_mapbench.world.world import BODY, World, stands_still

OUTCOME_NAMES, TOUCHED_NAMES = np.array(OUTCOMES, dtype=object), np.array(TOUCHED, dtype=object)
Touched = NDArray[np.int64]


class Batch:
    """Steps worlds together.

    Args:
        config: Of all worlds.
        worlds: Their numbers.

    Attributes:
        begun: ``(count,)`` whether the last reset of each world has succeeded, so that it has an episode.
    """

    def __init__(self, config: EnvConfig, worlds: Worlds) -> None:
        self._config = config
        self._worlds = worlds
        self._count = len(worlds.robots)
        self.begun: Mask = np.zeros(self._count, np.bool_)
        self._drive = drive_of(config.robot, config.physics_hz, config.plant)
        self._rules = rules_of(config)
        self._lidar = lidar = config.mounted_lidar
        self._scanner = np.array(lidar.place), directions(lidar), lidar.range_max
        self._scans_exactly = config.noise.scans_exactly and not lidar.range_min
        self._late_ticks = config.late_ticks
        self._prompt_ticks = config.ticks - config.late_ticks
        self._walls = np.ones((self._count, 0), np.bool_)
        self._fields = np.zeros((self._count, 0))
        self._traffic = Traffic(worlds.clocks, config.ticks)
        self._velocities = np.zeros((self._count, 2))
        self._proximity = Proximity(config.robot)
        self.envs: Sequence[MapBenchEnv] = ()

    def settle(self, index: int, world: World, field: NDArray[np.float64]) -> None:
        """Take over a world whose episode begins, and its distances to the goal, in cells."""
        self._walls = put_row(self._walls, index, world.grid.framed)
        self._fields = put_row(self._fields, index, field)
        self._traffic.settle(index, world)
        self.begun[index] = True

    def drive(self, commands: NDArray[np.float64], running: Mask) -> Touched:
        """Drive for one control period, at first still by the previous command.

        Args:
            commands: ``(count, 2)`` m/s, rad/s.
            running: ``(count,)`` which worlds to step, here and below.

        Returns:
            ``(count,)`` what was touched: 0, or a sum of ``WALL`` and ``BODY``.
        """
        if self._config.noise.actuates_wrongly:
            for i in np.flatnonzero(running).tolist():
                commands[i] = self.envs[i].carried_out(*commands[i].tolist())
        if self._traffic:
            self._velocities = self.states()[1]
        before = self._worlds.commands.copy()
        np.copyto(self._worlds.commands, commands, where=running[:, None])
        if not self._late_ticks:
            return self._advance(commands, self._prompt_ticks, running)
        return self._advance(before, self._late_ticks, running) | self._advance(commands, self._prompt_ticks, running)

    def _advance(self, commands: NDArray[np.float64], ticks: int, running: Mask) -> Touched:
        """Advance by some ticks: with Box2D where a wall or body is within reach."""
        waiting, touched = running.copy(), np.zeros(self._count, np.int64)
        if self._config.physics_may_rest:
            self._drive_free(commands, ticks, waiting)
        for i in np.flatnonzero(waiting).tolist():
            v, w = commands[i].tolist()
            touched[i] = self.envs[i].simulation.advance_in_box2d(v, w, ticks)
        if self._traffic:
            self._traffic.advance(ticks, running)
        return touched

    def _drive_free(self, commands: NDArray[np.float64], ticks: int, waiting: Mask) -> None:
        """Drive the waiting robots that nothing is near; the others still wait afterwards."""
        worlds, walls = self._worlds, _frozen(self._walls)
        if self._traffic:
            self._traffic.drive(worlds, commands, waiting, ticks, self._drive, walls)
        else:
            drive_robots(worlds.robots, worlds.boxes, commands, waiting, ticks, self._drive, worlds.grounds, walls)

    def judge(self, touched: Touched, running: Mask) -> None:
        """Judge the step that was driven."""
        worlds = self._worlds
        judge_worlds(worlds.tasks, running, self._rules, worlds.robots, touched, worlds.grounds, self._fields)

    def observe(self, observations: Observation, running: Mask) -> None:
        """Write the observation of every running world into its row of every array."""
        poses, true_velocities = self.states()
        estimates, odoms, velocities = poses, poses, true_velocities
        if not self._config.noise.knows_its_state:
            estimates, odoms, velocities = poses.copy(), poses.copy(), true_velocities.copy()
            for i in np.flatnonzero(running).tolist():
                moment = self.envs[i].observer.know()
                estimates[i], odoms[i], velocities[i] = moment.estimate, moment.odom, moment.velocity
        states = {"pose": estimates, "odom": odoms, "velocity": velocities}
        for key, rows in observations.items():
            if key in states:
                rows[:] = states[key]
            elif key == "goal":
                see_goals(self._worlds.tasks, running, estimates, rows)
            elif key == "scan" and self._lidar.scan_rate is None:
                self._scan(rows, running)
            else:
                self._look(key, rows, running, Moment(poses, true_velocities, estimates, odoms, velocities))

    def _scan(self, ranges: NDArray[np.float32], running: Mask) -> None:
        worlds = self._worlds
        scan_worlds(worlds.robots, running, worlds.grounds, _frozen(self._walls), *self._scanner, ranges)
        if self._traffic:
            self._traffic.scan(worlds.robots, running, self._scanner, ranges)
        if not self._scans_exactly and running.any():
            chosen = np.flatnonzero(running)
            sampled = zip(*(self.envs[i].observer.sample_scan_noise() for i in chosen.tolist()), strict=True)
            normals, lost = map(np.stack, sampled)
            ranges[chosen] = report_scan(self._config.noise, self._lidar, ranges[chosen], normals, lost)

    def _look(self, key: str, rows: NDArray[Any], running: Mask, moments: Moment) -> None:
        """Observe a key world by world, of the moments of all worlds."""
        for i in np.flatnonzero(running).tolist():
            rows[i] = CONTENTS[key](self.envs[i].observer, Moment(*(state[i] for state in moments)))

    def states(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the true poses ``(count, 3)`` and velocities ``(count, 2)``."""
        poses, velocities = np.empty((self._count, 3)), np.empty((self._count, 2))
        read_robots(self._worlds.robots, poses, velocities)
        return poses, velocities

    def infos(self) -> dict[str, Any]:
        """Return the ``info`` of every world, by key."""
        poses, velocities = self.states()
        tasks = self._worlds.tasks
        by_body = tasks["touched"] & BODY > 0
        if by_body.any():
            by_body &= stands_still(self._velocities)
        return {
            "time": tasks["steps"] / self._config.control_hz,
            "outcome": OUTCOME_NAMES[tasks["outcome"]],
            "contact": tasks["touched"] > 0,
            "touched": TOUCHED_NAMES[tasks["touched"]],
            "contact_by_body": by_body,
            "pose": poses,
            "velocity": velocities,
            "nearest_body": self._traffic.gaps(self._proximity, poses),
            "reward_terms": {name: tasks[name].copy() for name in REWARD_TERMS},
        }


def put_row(rows: NDArray[Any], index: int, cells: NDArray[Any]) -> NDArray[Any]:
    """Write ``cells`` flat into a row; return the rows, in a new array where the cells need more room."""
    if cells.size > rows.shape[1]:
        rows = np.pad(rows, ((0, 0), (0, cells.size - rows.shape[1])))
    rows[index, : cells.size] = cells.reshape(-1)
    return rows


def _frozen(rows: NDArray[Any]) -> NDArray[Any]:
    """Return a read-only view: the type of array that kernels were compiled for with the walls of a single map."""
    view = rows.view()
    view.flags.writeable = False
    return view
