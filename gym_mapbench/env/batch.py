"""Many worlds driven, judged and observed together: one kernel for all of them, wherever no world needs its own care.

What is written here is what the single env does, by the same kernels. Where something is drawn, or Box2D is needed, the
objects of the single env do it, world by world.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import CONTENTS, Moment, report_scan
from gym_mapbench.env.single import MapBenchEnv, Observation
from gym_mapbench.env.task import OUTCOMES, REWARD_TERMS, rules_of
from gym_mapbench.kernels.motion import drive_bodies
from gym_mapbench.kernels.observation import read_bodies, scan_worlds, see_goals
from gym_mapbench.kernels.task import judge_worlds
from gym_mapbench.world.lidar import directions
from gym_mapbench.world.scenario import Pose
from gym_mapbench.world.state import Worlds, drive_of

Mask = NDArray[np.bool_]
OUTCOME_NAMES = np.array(OUTCOMES, dtype=object)


class Batch:
    """Steps worlds together.

    Args:
        config: Of all worlds.
        worlds: Their numbers.
    """

    def __init__(self, config: EnvConfig, worlds: Worlds) -> None:
        self._config = config
        self._worlds = worlds
        self._count = len(worlds.bodies)
        self._drive = drive_of(config.robot, config.physics_hz)
        self._rules = rules_of(config)
        self._lidar = lidar = config.mounted_lidar
        self._scanner = np.array(lidar.place), directions(lidar), lidar.range_max
        self._scans_exactly = config.noise.scans_exactly and not lidar.range_min
        self._late_ticks = config.late_ticks
        self._prompt_ticks = config.ticks - config.late_ticks
        self._walls = np.ones((self._count, 0), np.bool_)
        self._fields = np.zeros((self._count, 0))
        self.envs: Sequence[MapBenchEnv] = ()

    def settle(self, index: int, framed: NDArray[np.bool_], field: NDArray[np.float64]) -> None:
        """Take over the map of a world, framed, and its distances to the goal, in cells."""
        self._walls = put_row(self._walls, index, framed)
        self._fields = put_row(self._fields, index, field)

    def drive(self, commands: NDArray[np.float64], running: Mask) -> Mask:
        """Drive for one control period, at first still by the previous command.

        Args:
            commands: ``(count, 2)`` m/s, rad/s.
            running: ``(count,)`` which worlds to step, here and below.

        Returns:
            ``(count,)`` whether a wall was touched.
        """
        if self._config.noise.actuates_wrongly:
            for i in np.flatnonzero(running).tolist():
                commands[i] = self.envs[i].carried_out(*commands[i].tolist())
        before = self._worlds.commands.copy()
        np.copyto(self._worlds.commands, commands, where=running[:, None])
        if not self._late_ticks:
            return self._advance(commands, self._prompt_ticks, running)
        return self._advance(before, self._late_ticks, running) | self._advance(commands, self._prompt_ticks, running)

    def _advance(self, commands: NDArray[np.float64], ticks: int, running: Mask) -> Mask:
        """Advance by some ticks: with Box2D where a wall is within reach."""
        waiting, contacts = running.copy(), np.zeros(self._count, np.bool_)
        worlds = self._worlds
        if self._config.physics_may_rest:
            walls = _frozen(self._walls)
            drive_bodies(worlds.bodies, worlds.boxes, commands, waiting, ticks, self._drive, worlds.grounds, walls)
        for i in np.flatnonzero(waiting).tolist():
            v, w = commands[i].tolist()
            contacts[i] = self.envs[i].simulation.advance_among_walls(v, w, ticks)
        return contacts

    def judge(self, contacts: Mask, running: Mask) -> None:
        """Judge the step that was driven."""
        worlds = self._worlds
        judge_worlds(worlds.tasks, running, self._rules, worlds.bodies, contacts, worlds.grounds, self._fields)

    def observe(self, observations: Observation, running: Mask) -> None:
        """Write the observation of every running world into its row of every array."""
        poses, velocities = self.states()
        estimates, odoms = poses, poses
        if not self._config.noise.knows_its_state:
            estimates, odoms = poses.copy(), poses.copy()
            for i in np.flatnonzero(running).tolist():
                moment = self.envs[i].observer.know(Pose(*poses[i].tolist()), tuple(velocities[i].tolist()))
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
                self._look(key, rows, running, (poses, estimates, odoms, velocities))

    def _scan(self, ranges: NDArray[np.float32], running: Mask) -> None:
        worlds = self._worlds
        scan_worlds(worlds.bodies, running, worlds.grounds, _frozen(self._walls), *self._scanner, ranges)
        if not self._scans_exactly and running.any():
            chosen = np.flatnonzero(running)
            drawn = zip(*(self.envs[i].observer.draw_scan_noise() for i in chosen.tolist()), strict=True)
            normals, lost = (None if rows[0] is None else np.stack(rows) for rows in drawn)
            ranges[chosen] = report_scan(self._config.noise, self._lidar, ranges[chosen], normals, lost)

    def _look(self, key: str, rows: NDArray[Any], running: Mask, states: tuple[NDArray[np.float64], ...]) -> None:
        """Observe a key world by world."""
        for i in np.flatnonzero(running).tolist():
            true, estimate, odom, velocity = (state[i].tolist() for state in states)
            moment = Moment(Pose(*true), Pose(*estimate), Pose(*odom), tuple(velocity))
            rows[i] = CONTENTS[key](self.envs[i].observer, moment)

    def states(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return the true poses ``(count, 3)`` and velocities ``(count, 2)``."""
        poses, velocities = np.empty((self._count, 3)), np.empty((self._count, 2))
        read_bodies(self._worlds.bodies, poses, velocities)
        return poses, velocities

    def infos(self) -> dict[str, Any]:
        """Return what ``info`` holds of every world, by key."""
        poses, velocities = self.states()
        tasks = self._worlds.tasks
        return {
            "time": tasks["steps"] / self._config.control_hz,
            "outcome": OUTCOME_NAMES[tasks["outcome"]],
            "contact": tasks["touching"].copy(),
            "pose": poses,
            "velocity": velocities,
            "reward_terms": {name: tasks[name].copy() for name in REWARD_TERMS},
        }


def put_row(rows: NDArray[Any], index: int, cells: NDArray[Any]) -> NDArray[Any]:
    """Write ``cells`` flat into a row; return the rows, which are new ones where it would not fit."""
    if cells.size > rows.shape[1]:
        rows = np.pad(rows, ((0, 0), (0, cells.size - rows.shape[1])))
    rows[index, : cells.size] = cells.reshape(-1)
    return rows


def _frozen(rows: NDArray[Any]) -> NDArray[Any]:
    """Return a view that cannot be written, which is how kernels get the walls of a single map."""
    view = rows.view()
    view.flags.writeable = False
    return view
