"""How the speed limits of a costmap's filters reach a path follower."""

from __future__ import annotations

from collections.abc import Callable

from controllers.base import PathFollower
from controllers.nav2_params.navigation import NavigationParams
from gym_mapbench.errors import ConfigError

SetSpeedLimit = Callable[[float, bool], None]


def speed_limiter(follower: PathFollower, params: NavigationParams) -> SetSpeedLimit:
    """Return what sets the speed limit of a follower.

    Raises:
        ConfigError: If the follower has no ``set_speed_limit``, and a costmap has a speed filter.
    """
    setter: SetSpeedLimit | None = getattr(follower, "set_speed_limit", None)
    if setter is not None:
        return setter
    for name, costmap in params.costmaps.items():
        if costmap.speed_filters:
            kind = type(follower).__name__
            raise ConfigError(f"{name}.speed_filters: expected a controller with set_speed_limit, got {kind}")
    return _no_limits


def _no_limits(speed: float, percentage: bool) -> None:
    """Take no speed limit: no filter publishes one."""
