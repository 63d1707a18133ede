"""Makes ``MapBench-v0`` known to Gymnasium."""

from __future__ import annotations

from gymnasium.envs.registration import register, registry

ENV_ID = "MapBench-v0"


def register_envs() -> None:
    """Register ``MapBench-v0`` and its vector form, once.

    It is called by ``import gym_mapbench``, by ``gymnasium.make("gym_mapbench:MapBench-v0")``, and by
    any Gymnasium that loads the entry points of the group ``gymnasium.envs``.
    """
    if ENV_ID not in registry:
        register(
            id=ENV_ID,
            entry_point="gym_mapbench.env.single:MapBenchEnv",
            vector_entry_point="gym_mapbench.env.vector:MapBenchVectorEnv",
        )
