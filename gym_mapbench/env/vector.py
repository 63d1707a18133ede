"""MapBenchVectorEnv: many worlds stepped together."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any, cast

import numpy as np
from gymnasium.error import ResetNeeded
from gymnasium.spaces import Dict
from gymnasium.vector import AutoresetMode, SyncVectorEnv
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.env.action import to_commands
from gym_mapbench.env.batch import Batch
from gym_mapbench.env.config import EnvConfig
from gym_mapbench.env.scenario_source import read_options
from gym_mapbench.env.single import MapBenchEnv, Observation, refuse_copy
from gym_mapbench.env.traffic import Mask
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.task import COLLISION, GOAL, RUNNING, TIMEOUT
from gym_mapbench.world.scenario import MapSet, Scenario, as_scenarios
from gym_mapbench.world.state import Worlds

StepResult = tuple[Observation, NDArray[np.float64], Mask, Mask, dict[str, Any]]


class MapBenchVectorEnv(SyncVectorEnv):
    """``num_envs`` worlds in one process, stepped together by compiled code.

    World ``i`` after ``reset(seed=s)`` equals a single env after ``reset(seed=s + i)``, bit by bit. Spaces, autoreset
    and the form of ``infos`` are those of Gymnasium's SyncVectorEnv. One kernel each computes motion, reward, goal
    and scans of all worlds. World by world come Box2D, where walls or bodies are within reach or a polygon's episode
    goes on after a touch, sampled noise, ``path``, ``costmap``, and scans of a scanner with a ``scan_rate``. Like a
    single env, it cannot be copied or pickled (TypeError).

    Args:
        num_envs: Number of worlds.
        config: As for :class:`~gym_mapbench.env.single.MapBenchEnv`; read once.
        autoreset_mode: ``NextStep``, ``SameStep`` or ``Disabled``, as Gymnasium defines them.
        render_mode: As for MapBenchEnv.
        scenarios: As for MapBenchEnv.
        **options: As for MapBenchEnv.

    Raises:
        ConfigError: As MapBenchEnv, and on a bad number or mode.
    """

    def __init__(
        self,
        num_envs: int = 1,
        config: EnvConfig | Mapping[str, Any] | str | Path | None = None,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        render_mode: str | None = None,
        scenarios: Iterable[Scenario] | None = None,
        **options: Any,
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, int | np.integer) or num_envs < 1:
            raise ConfigError(f"num_envs: expected a whole number, at least 1, got {num_envs!r:.80}")
        self.config = EnvConfig.build(config, **options)
        loaded = self.config.load_scenarios() if scenarios is None else as_scenarios("scenarios", scenarios)
        self._worlds = Worlds(num_envs)
        self._batch = Batch(self.config, self._worlds)
        make = partial(_World, self.config, render_mode=render_mode, scenarios=loaded)
        members = [partial(make, batch=self._batch, worlds=self._worlds, index=i) for i in range(num_envs)]
        super().__init__(members, copy=True, autoreset_mode=_read_mode(autoreset_mode))
        self._members = cast(list[_World], self.envs)
        self._batch.envs = self._members
        self._all: Mask = np.ones(num_envs, np.bool_)
        self._last: Observation = {}

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Begin an episode in every world, or in those of ``options["reset_mask"]``.

        Args:
            seed: Of the first world; the others get the following numbers, or those of a list.
            options: As for MapBenchEnv, the same for every world; or ``scenarios``, one Scenario for each world, of
                which those of the worlds that begin are used.

        Raises:
            ConfigError: As MapBenchEnv, or if there is not one scenario for each world.
            gymnasium.error.ResetNeeded: If the mask leaves out worlds that have had no reset.
        """
        options = dict(read_options(options))
        given = options.get("scenarios", self._members)
        if not isinstance(given, Sequence | MapSet) or len(given) != self.num_envs:
            raise ConfigError(f"scenarios: expected one for each of {self.num_envs} worlds")
        mask = options.get("reset_mask")
        if mask is not None and not self._last and not np.all(mask):
            raise ResetNeeded("reset: the mask leaves out worlds that have had no reset; call reset without it first")
        # A masked reset returns the last observations of the worlds that it leaves alone.
        kept: list[Any] = [{key: rows[i] for key, rows in self._last.items()} for i in range(self.num_envs)]
        self._env_obs = kept
        result: tuple[Observation, dict[str, Any]] = super().reset(seed=seed, options=options)
        self._last = _copied(result[0])
        return result

    def step(self, actions: ArrayLike) -> StepResult:
        """Drive every world for one control period.

        Args:
            actions: ``(num_envs, 2)`` finite numbers; values beyond the robot's limits are clipped.

        Returns:
            Observations, rewards, terminations, truncations and infos, all new arrays. With ``NextStep``, a world
            whose episode ended in the last step begins a new one, whatever its action.

        Raises:
            ConfigError: If the actions are anything else.
            gymnasium.error.ResetNeeded: If a world has no running episode and does not begin one by itself, or its last
                reset has failed.
        """
        ended: Mask = self._worlds.tasks["outcome"] != RUNNING
        if not self._batch.begun.all() or (ended.any() and self.autoreset_mode is not AutoresetMode.NEXT_STEP):
            raise ResetNeeded("step: a world has no running episode; call reset first")
        running = ~ended
        touched = self._batch.drive(to_commands(actions, self.config, running), running)
        self._batch.judge(touched, running)
        spaces = cast(Dict, self.observation_space)
        observations = {key: np.empty(space.shape or (), space.dtype) for key, space in spaces.items()}
        self._batch.observe(observations, running)
        if self.render_mode is not None:
            for i in np.flatnonzero(running).tolist():
                self._members[i].picture()
        if self.autoreset_mode is AutoresetMode.NEXT_STEP:
            self._begin(ended, observations)
        rewards, outcomes = self._worlds.tasks["reward"].copy(), self._worlds.tasks["outcome"].copy()
        infos: dict[str, Any] = {}
        if self.autoreset_mode is AutoresetMode.SAME_STEP and outcomes.any():
            infos = self._final_infos(outcomes != RUNNING, observations)
            self._begin(outcomes != RUNNING, observations)
        self._last = _copied(observations)
        infos |= _masked(self._batch.infos(), self._all)
        return observations, rewards, (outcomes == GOAL) | (outcomes == COLLISION), outcomes == TIMEOUT, infos

    __reduce_ex__ = refuse_copy

    def _begin(self, chosen: Mask, observations: Observation) -> None:
        """Begin an episode in the chosen worlds, and write their observations."""
        for i in np.flatnonzero(chosen).tolist():
            first, _ = self._members[i].reset()
            for key, rows in observations.items():
                rows[i] = first[key]

    def _final_infos(self, ended: Mask, observations: Observation) -> dict[str, Any]:
        """Return the last observation and info of worlds whose episodes have ended."""
        last = np.full(self.num_envs, None, dtype=object)
        for i in np.flatnonzero(ended).tolist():
            last[i] = {key: observations[key][i].copy() for key in self.config.observation}
        info = self._batch.infos()
        _blank(info, ~ended)
        info = _masked(info, ended)
        return {"final_obs": last, "_final_obs": ended.copy(), "final_info": info, "_final_info": ended.copy()}


class _World(MapBenchEnv):
    """One of the worlds of a batch."""

    def __init__(self, config: EnvConfig, *, batch: Batch, worlds: Worlds, index: int, **options: Any) -> None:
        super().__init__(config, **options)
        self._worlds = worlds.only(index)
        self._batch, self._index = batch, index

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """As :meth:`MapBenchEnv.reset`."""
        self._batch.begun[self._index] = False
        if options is not None and "scenarios" in options:
            others = {name: value for name, value in options.items() if name != "scenarios"}
            options = {**others, "scenario": options["scenarios"][self._index]}
        result = super().reset(seed=seed, options=options)
        if self.task is not None:
            self._batch.settle(self._index, self.simulation.world, self.task.field)
        return result


def _read_mode(mode: AutoresetMode | str) -> AutoresetMode:
    try:
        return AutoresetMode(mode)
    except ValueError:
        names = ", ".join(repr(mode.value) for mode in AutoresetMode)
        raise ConfigError(f"autoreset_mode: expected one of {names}, got {mode!r}") from None


def _copied(observations: Observation) -> Observation:
    return {key: rows.copy() for key, rows in observations.items()}


def _masked(infos: dict[str, Any], known: Mask) -> dict[str, Any]:
    """Return infos as Gymnasium's vector envs give them: every key with a mask of the worlds that it is known of."""
    masked: dict[str, Any] = {}
    for key, value in infos.items():
        masked[key] = _masked(value, known) if isinstance(value, dict) else value
        masked[f"_{key}"] = known.copy()
    return masked


def _blank(infos: dict[str, Any], unknown: Mask) -> None:
    """Write 0, False or None where nothing is known."""
    for value in infos.values():
        if isinstance(value, dict):
            _blank(value, unknown)
        else:
            value[unknown] = None if value.dtype == object else 0
