"""Nav2's local navigation on Box2D grid maps, as a Gymnasium environment: ``gymnasium.make("MapBench-v0")``.

Rooms, each of which imports only those below it:

===========================  ========================================================================
``metrics``                  metrics of recorded runs, measures of maps
``env``                      the Gymnasium envs: task, action, observation, reward
``mapio``                    map files in and out
``generator``                families of maps
``smoothers``                Nav2's path smoothers
``planners``, ``costmap``    Nav2's global planners and costmap layers
``world``                    walls, moving bodies, robot, physics, sensors, noise
``files``                    bounded reading of untrusted files
``kernels``                  compiled functions of arrays
===========================  ========================================================================

Modules that all rooms use and no room owns: ``errors``, ``settings`` (validated options), ``registry`` (things by
name), ``trust`` (which code may run), ``releases`` of Nav2, and ``registration`` with Gymnasium.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from gym_mapbench.registration import register_envs

if TYPE_CHECKING:
    from gym_mapbench.env.config import EnvConfig
    from gym_mapbench.env.single import MapBenchEnv
    from gym_mapbench.env.vector import MapBenchVectorEnv
    from gym_mapbench.errors import MapBenchError
    from gym_mapbench.metrics.episode import Episode
    from gym_mapbench.world.gridmap import GridMap
    from gym_mapbench.world.robot import RobotSpec
    from gym_mapbench.world.scenario import MapSet, Pose, Scenario

__all__ = [
    "EnvConfig",
    "Episode",
    "GridMap",
    "MapBenchEnv",
    "MapBenchError",
    "MapBenchVectorEnv",
    "MapSet",
    "Pose",
    "RobotSpec",
    "Scenario",
]

_HOME = {
    "EnvConfig": "env.config",
    "Episode": "metrics.episode",
    "GridMap": "world.gridmap",
    "MapBenchEnv": "env.single",
    "MapBenchError": "errors",
    "MapBenchVectorEnv": "env.vector",
    "MapSet": "world.scenario",
    "Pose": "world.scenario",
    "RobotSpec": "world.robot",
    "Scenario": "world.scenario",
}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used, so that registering the env loads neither Box2D nor numba."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


register_envs()
