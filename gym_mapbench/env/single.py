"""MapBenchEnv: a differential-drive robot among walls and moving bodies, as a Gymnasium environment."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any, NoReturn, SupportsIndex

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.env.action import action_space, to_command
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.observation import Moment, Observer, observation_space
from gym_mapbench.env.render import Snapshot, Window, draw
from gym_mapbench.env.scenario_source import ScenarioSource
from gym_mapbench.env.task import TOUCHED, Standing, Task
from gym_mapbench.errors import unknown_name
from gym_mapbench.world.clearance import check_clearance, sample_start
from gym_mapbench.world.noise import Streams, Wander
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.robot import RobotSpec
from gym_mapbench.world.scenario import Scenario
from gym_mapbench.world.simulation import Simulation
from gym_mapbench.world.state import Worlds
from gym_mapbench.world.world import BODY, World, stands_still

Observation = dict[str, NDArray[Any]]


def refuse_copy(env: object, protocol: SupportsIndex) -> NoReturn:
    """Refuse ``copy``, ``deepcopy`` and ``pickle`` of an env, as its ``__reduce_ex__``.

    Raises:
        TypeError: Always. Box2D's state cannot be copied, and the worlds of a vector env share their arrays.
    """
    raise TypeError(
        "an env of MapBench cannot be copied or pickled: make another one with the same options, reset it with the "
        "same seed, and repeat the actions"
    )


class MapBenchEnv(gymnasium.Env[Any, Any]):
    """A differential-drive robot drives from start to goal, among walls and moving bodies.

    Numbers in the tables are the defaults: a TurtleBot3 Waffle, 20 actions per second. All options are fields of
    :class:`~gym_mapbench.env.config.EnvConfig`.

    An env cannot be copied or pickled (TypeError). Another env with the same options, seed and actions is in the same
    state.

    **Action space**: `Box((2,), float32)`. Values beyond the limits are clipped.

    | index | action | lowest | highest | unit |
    |---|---|---|---|---|
    | 0 | forward speed | -0.35 | 0.5 | m/s |
    | 1 | turn rate, counter-clockwise | -1.9 | 1.9 | rad/s |

    With `action="normalized"` both run from -1 to 1: 1 is the robot's limit, 0 is rest.

    **Observation space**: `Dict` of the keys in `observation`, by default `pose`, `velocity`, `goal` and `scan`.

    | key | shape | type | lowest | highest | content |
    |---|---|---|---|---|---|
    | `pose` | (3,) | float64 | -1e8, -1e8, -pi | 1e8, 1e8, pi | x, y (m), yaw (rad) on the map, by localisation |
    | `odom` | (3,) | float64 | -1e8, -1e8, -pi | 1e8, 1e8, pi | x, y (m), yaw (rad) in the odom frame, by the wheels |
    | `velocity` | (2,) | float64 | -1000 | 1000 | measured forward speed (m/s) and turn rate (rad/s) |
    | `goal` | (3,) | float32 | -1e8, -1e8, -pi | 1e8, 1e8, pi | x, y (m), yaw (rad) of the goal in the robot's frame |
    | `scan` | (360,) | float32 | 0 | 3.5 | ranges of the lidar (m), counter-clockwise from straight ahead |
    | `path` | (40,) | float32 | -1e8 | 1e8 | x, y (m) of the next 20 points of the global path, in the robot's frame |
    | `costmap` | (1, 60, 60) | uint8 | 0 | 255 | Nav2's costs around the robot, row 0 at the bottom |
    | `people` | (30,) | float32 | -1e8 | 1e8 | the nearest bodies in the robot's frame, see below |

    `people` has six numbers for each moving body, the nearest first: x, y (m), velocity along x and y (m/s), radius
    (m), and 1. The numbers beyond the last body are 0.

    **Reward**: the sum of the terms, with the weights of `reward`.

    | term | when | default |
    |---|---|---|
    | `progress` | every step | 1 per metre that the geodesic distance to the goal shrinks |
    | `time` | every step | -0.05 per simulated second |
    | `collision` | a contact begins | -10 |
    | `goal` | the robot reaches the goal for the first time | 10 |

    **Starting state**: the robot stands still at the start of a scenario, plus the error of `noise.start_xy` and
    `noise.start_yaw`. The scenario is sampled from `maps` at every reset, or given in the options of `reset`. Without
    `maps`, every reset samples a new map. Bodies are where their motion says at time 0.

    **Episode end**

    | outcome | signal | when | switched off by |
    |---|---|---|---|
    | `goal` | terminated | within 0.25 m of the goal, then within 0.25 rad of its heading | `goal_ends_episode` |
    | `collision` | terminated | the robot touches a wall or a body | `collision_ends_episode` |
    | `timeout` | truncated | after `time_limit`, 150 simulated seconds | |

    **Info** of every reset and step, without noise:

    | key | content |
    |---|---|
    | `time` | simulated seconds since the start |
    | `outcome` | `running`, `goal`, `collision` or `timeout` |
    | `contact` | whether the robot touched anything during the step |
    | `touched` | `nothing`, `wall`, `body`, or `wall and body` |
    | `contact_by_body` | whether a body touched the robot while it stood still before the step |
    | `pose` | (3,) float64, true x, y (m), yaw (rad) |
    | `velocity` | (2,) float64, true forward speed (m/s) and turn rate (rad/s) |
    | `nearest_body` | distance between the outlines of robot and nearest moving body (m); infinite without bodies |
    | `reward_terms` | the terms of the reward by name |

    Args:
        config: An EnvConfig, a mapping, or the name of a YAML file.
        scenarios: Drive on these (a MapSet or any scenarios) instead of the configured maps.
        render_mode: ``rgb_array``, ``human`` or None. ``metadata["render_fps"]`` is ``control_hz``, to the next whole
            number, so that a film of a frame for each step runs in real time.
        **options: Fields of :class:`~gym_mapbench.env.config.EnvConfig`, on top of ``config``; a group of options such
            as ``lidar`` replaces the whole group of ``config``.

    Raises:
        ConfigError: On an unknown key, a bad value, or an impossible task.
        MapFormatError: If a map file is not in the format that its name states.
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
        self.metadata = {**self.metadata, "render_fps": max(1, round(self.config.control_hz))}
        self.render_mode = render_mode
        self._source = ScenarioSource(self.config, scenarios)
        self._late_ticks = self.config.late_ticks
        self._prompt_ticks = self.config.ticks - self._late_ticks
        self.task: Task | None = None
        self._window: Window | None = None
        self._proximity = Proximity(self.config.robot)
        self._worlds = Worlds()

    @cached_property
    def observation_space(self) -> spaces.Dict:  # type: ignore[override]
        """Space of the observations; made when it is first asked for, as a run of a controller never does."""
        return observation_space(self.config)

    @cached_property
    def action_space(self) -> spaces.Box:  # type: ignore[override]
        """Space of the actions, likewise."""
        return action_space(self.config)

    @property
    def robot(self) -> RobotSpec:
        """Shape and limits of the robot."""
        return self.config.robot

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode; if that fails, none is running until the next reset.

        Args:
            seed: Seed of the env's generator, from which maps and noise are sampled.
            options: ``scenario`` (a Scenario, or the index of one of the env's), or ``map`` (GridMap); ``start`` and
                ``goal`` poses. What is not given is sampled, or taken from the map.

        Raises:
            ConfigError: If start or goal is off the map, or the robot would touch a wall or a body there.
            NoPathError: If ``path`` is observed and there is none.
        """
        self.task = None
        super().reset(seed=seed)
        self.scenario = self._source.choose(options, self.np_random)
        check_clearance(self.scenario, self.robot)
        config, noise = self.config, self.config.noise
        streams = Streams.spawn(self.np_random, noise)
        start = sample_start(self.scenario, self.robot, noise, streams.start)
        world = World(self.scenario.map, self.scenario.bodies, config.physics_hz, config.ticks, self._worlds.clocks)
        self.simulation = Simulation(
            world,
            self.robot,
            start,
            plant=config.plant,
            rests=config.physics_may_rest,
            nearby=config.collision_ends_episode,
            worlds=self._worlds,
        )
        self.observer = Observer(config, self.scenario, world, start, streams, self._worlds.robots)
        gains = noise.actuation_v, noise.actuation_w
        self._actuation = Wander(gains, noise.actuation_time_constant, 1.0 / config.control_hz, streams.actuation)
        self._worlds.commands[0] = 0.0
        self._trail, self._velocity = [start], [0.0, 0.0]
        self.task = Task(config, self.scenario, start, self._worlds)
        if self.render_mode == "human":
            self.render()
        moment = self.observer.know()
        return self.observer.observe(moment), self._info(self.task.standing(), 0, moment)

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
        touched = self._drive(*to_command(action, self.robot, self.config.action))
        now, moment = task.step(touched), self.observer.know()
        self.picture()
        observation, info = self.observer.observe(moment), self._info(now, touched, moment)
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
        """Return the content of a picture of the present state."""
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

    __reduce_ex__ = refuse_copy

    def carried_out(self, v: float, w: float) -> tuple[float, float]:
        """Return a command (m/s, rad/s) as the motors carry it out in this control period; call it once in each."""
        gain_v, gain_w = self._actuation.advance()
        return v * (1 + gain_v), w * (1 + gain_w)

    def _drive(self, v: float, w: float) -> int:
        """Drive for one control period, at first by the previous command; return what was touched."""
        v, w = self.carried_out(v, w)
        last = self._worlds.commands[0]
        last_v, last_w = last.tolist()
        touched = self.simulation.advance(last_v, last_w, self._late_ticks) if self._late_ticks else 0
        last[0], last[1] = v, w
        return self.simulation.advance(v, w, self._prompt_ticks) | touched

    def _info(self, now: Standing, touched: int, moment: Moment) -> dict[str, Any]:
        before, self._velocity = self._velocity, moment.true_velocity.tolist()
        return {
            "time": now.time,
            "outcome": now.outcome,
            "contact": touched > 0,
            "touched": TOUCHED[touched],
            "contact_by_body": bool(touched & BODY) and bool(stands_still(before)),
            "pose": moment.true,
            "velocity": moment.true_velocity,
            "nearest_body": self._nearest_body(moment.true),
            "reward_terms": now.terms,
        }

    def _nearest_body(self, state: NDArray[np.float64]) -> float:
        """Return the distance to the nearest body, m; infinite without bodies."""
        world = self.simulation.world
        if not world.bodies:
            return math.inf
        return self._proximity.gap(state, world.poses, world.radii)
