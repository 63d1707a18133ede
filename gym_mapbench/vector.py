"""MapBenchVectorEnv: many worlds stepped together."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import Any

from gymnasium.vector import AutoresetMode, SyncVectorEnv

from gym_mapbench.config import EnvConfig
from gym_mapbench.env import MapBenchEnv
from gym_mapbench.errors import ConfigError


class MapBenchVectorEnv(SyncVectorEnv):
    """``num_envs`` worlds in one process, without the wrappers of ``gymnasium.make`` around each.

    World ``i`` of ``reset(seed=s)`` is the world of a single env's ``reset(seed=s + i)``.

    Args:
        num_envs: Number of worlds.
        config: As for :class:`~gym_mapbench.env.MapBenchEnv`; read once.
        autoreset_mode: ``NextStep``, ``SameStep`` or ``Disabled``, as Gymnasium defines them.
        render_mode: As for MapBenchEnv.
        scenarios: As for MapBenchEnv.
        **options: Fields of :class:`~gym_mapbench.config.EnvConfig`, on top of ``config``.

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
        scenarios: Any = None,
        **options: Any,
    ) -> None:
        if num_envs < 1:
            raise ConfigError(f"num_envs: expected at least 1, got {num_envs}")
        try:
            mode = AutoresetMode(autoreset_mode)
        except ValueError:
            names = ", ".join(repr(mode.value) for mode in AutoresetMode)
            raise ConfigError(f"autoreset_mode: expected one of {names}, got {autoreset_mode!r}") from None
        built = EnvConfig.build(config, **options)
        make = partial(MapBenchEnv, built, render_mode=render_mode, scenarios=scenarios)
        super().__init__([make] * num_envs, copy=True, autoreset_mode=mode)
