"""MapBenchEnv: a differential-drive robot among the walls of a grid map, as a Gymnasium environment."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.env.action import action_space, to_command
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import Observer, observation_space
from gym_mapbench.env.render import Snapshot, Window, draw
from gym_mapbench.env.scenario_source import ScenarioSource
from gym_mapbench.env.task import TOUCHED, Standing, Task
from gym_mapbench.errors import unknown_name
from gym_mapbench.world.clearance import check_clearance, sample_start
from gym_mapbench.world.noise import Streams, Wander
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Pose, Scenario
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.state import Worlds
from gym_mapbench.world.world import World

Observation = dict[str, NDArray[Any]]


class MapBenchEnv(gymnasium.Env[Any, Any]):
    """Drive from start to goal.

    Action: ``(v m/s, omega rad/s)``, or -1 to 1 where ``action="normalized"``. Observation: see
    :func:`gym_mapbench.env.observation.observation_space`. Reward: the weighted terms of
    :class:`gym_mapbench.env.groups.RewardSettings`. An episode terminates at the goal or at the first touch of a wall
    (``goal_ends_episode``, ``collision_ends_episode``), and is truncated after ``time_limit`` simulated seconds.

    ``info`` of every reset and step: ``time`` (s), ``outcome`` (running, goal, collision or timeout), ``contact``
    (whether a wall was touched during the step), ``pose`` and ``velocity`` (true, ``(3,)`` and ``(2,)`` float64),
    ``reward_terms``.

    Args:
        config: An EnvConfig, a mapping, or the name of a YAML file.
        scenarios: Drive on these (a MapSet or any scenarios) instead of the configured maps.
        render_mode: ``rgb_array``, ``human`` or None.
        **options: Fields of :class:`~gym_mapbench.env.config.EnvConfig`, on top of ``config``.

    Raises:
        ConfigError: On an unknown key, a bad value, or an impossible task.
        MapFormatError: If a map file is not what it claims to be.
    """

    metadata = {"render_modes": ["rgb_array", "human"], "render_fps": 20}  # noqa: RUF012, Gymnasium declares it so

    def __init__(
        self,
        config: EnvConfig | Mapping[str, Any] | str | Path | None = None,
        *,
        scenarios: Iterable[Scenario] | None = None,
        render_mode: str | None = None,
        **options: Any,
    ) -> None:
        if render_mode is not None and render_mode not in self.metadata["render_modes"]:
            raise unknown_name("render mode", render_mode, self.metadata["render_modes"])
        self.config = EnvConfig.build(config, **options)
        self.render_mode = render_mode
        self.observation_space = observation_space(self.config)
        self.action_space = action_space(self.config)
        self._source = ScenarioSource(self.config, scenarios)
        self._late_ticks = self.config.late_ticks
        self._prompt_ticks = self.config.ticks - self._late_ticks
        self.task: Task | None = None
        self._window: Window | None = None
        self._worlds = Worlds()

    @property
    def robot(self) -> RobotSpec:
        """Shape and limits of the robot."""
        return self.config.robot

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode.

        Args:
            seed: Seeds the env's own generator, from which maps and noise are drawn.
            options: ``scenario`` (a Scenario, or the index of one of the env's), or ``map`` (GridMap); ``start`` and
                ``goal`` poses. What is not given is drawn, or the map's own.

        Raises:
            ConfigError: If start or goal is off the map, or the robot would touch a wall there.
            NoPathError: If ``path`` is observed and there is none.
        """
        super().reset(seed=seed)
        self.task = None
        self.scenario = self._source.choose(options or {}, self.np_random)
        check_clearance(self.scenario, self.robot)
        config, noise = self.config, self.config.noise
        streams = Streams.spawn(self.np_random, noise)
        start = sample_start(self.scenario, self.robot, noise, streams.start)
        world = World(self.scenario.map, self.scenario.bodies, config.physics_hz, config.ticks)
        self.simulation = Simulation(
            world,
            self.robot,
            start,
            rests=config.physics_may_rest,
            nearby=config.collision_ends_episode,
            worlds=self._worlds,
        )
        self.observer = Observer(config, self.scenario, world, start, streams)
        gains = noise.actuation_v, noise.actuation_w
        self._actuation = Wander(gains, noise.actuation_time_constant, 1.0 / config.control_hz, streams.actuation)
        self._worlds.commands[0] = 0.0
        self._trail = [start]
        self.task = Task(config, self.scenario, start, self._worlds)
        if self.render_mode == "human":
            self.render()
        pose, velocity = self.simulation.state()
        return self.observer.observe(pose, velocity), _info(self.task.standing(), 0, pose, velocity)

    def step(self, action: ArrayLike) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Drive for one control period.

        Args:
            action: Two finite numbers; values beyond the robot's limits are clipped.

        Raises:
            ConfigError: If the action is anything else.
            gymnasium.error.ResetNeeded: If no episode is running.
        """
        task = self.task
        if task is None or task.over:
            raise ResetNeeded("step: no episode is running; call reset first")
        touched = self._drive(*to_command(action, self.config))
        pose, velocity = self.simulation.state()
        task.step(pose, touched)
        self.picture()
        now = task.standing()
        observation, info = self.observer.observe(pose, velocity), _info(now, touched, pose, velocity)
        return observation, now.reward, now.outcome in ("goal", "collision"), now.outcome == "timeout", info

    def picture(self) -> None:
        """Add the present state to what is rendered, if anything is; :meth:`step` does."""
        if self.render_mode is not None:
            self._trail.append(self.simulation.pose)
            if self.render_mode == "human":
                self.render()

    def render(self) -> NDArray[np.uint8] | None:
        """Draw the present state: ``(height, width, 3)`` uint8 for ``rgb_array``, a window for ``human``.

        Raises:
            gymnasium.error.ResetNeeded: Before the first reset.
        """
        if self.task is None:
            raise ResetNeeded("render: no episode has begun; call reset first")
        if self.render_mode is None:
            return None
        frame = draw(self.snapshot())
        if self.render_mode == "rgb_array":
            return frame
        self._window = self._window or Window()
        self._window.show(frame, 1.0 / self.config.control_hz)
        return None

    def snapshot(self) -> Snapshot:
        """Return what a picture of the present state needs."""
        sensor, scan = self.observer.beams(self.simulation.pose) or (None, None)
        return Snapshot(
            scenario=self.scenario,
            robot=self.robot,
            pose=self.simulation.pose,
            trail=np.array(self._trail)[:, :2],
            path=self.observer.path,
            scan=scan,
            sensor=sensor,
            bodies=self.simulation.world.poses,
        )

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()
            self._window = None

    def carried_out(self, v: float, w: float) -> tuple[float, float]:
        """Return a command (m/s, rad/s) as the motors carry it out in this control period; call it once in each."""
        gain_v, gain_w = self._actuation.advance()
        return v * (1 + gain_v), w * (1 + gain_w)

    def _drive(self, v: float, w: float) -> int:
        """Drive for one control period, at first still by the previous command; return what was touched."""
        command = self.carried_out(v, w)
        last = self._worlds.commands[0]
        before_v, before_w = last.tolist()
        touched = self.simulation.advance(before_v, before_w, self._late_ticks) if self._late_ticks else 0
        last[:] = command
        return self.simulation.advance(*command, self._prompt_ticks) | touched


def _info(now: Standing, touched: int, pose: Pose, velocity: tuple[float, float]) -> dict[str, Any]:
    return {
        "time": now.time,
        "outcome": now.outcome,
        "contact": touched > 0,
        "touched": TOUCHED[touched],
        "pose": np.array(pose),
        "velocity": np.array(velocity),
        "reward_terms": now.terms,
    }
