"""Nav2's local navigation on Box2D grid maps, as a Gymnasium environment: ``gymnasium.make("MapBench-v0")``."""

from __future__ import annotations

from gym_mapbench.registration import register_envs

register_envs()
