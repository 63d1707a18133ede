"""The plugins that are built here, by their names in ROS."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from importlib import import_module
from typing import Any

from controllers.nav2_params.keys import NAVFN, SMAC_2D, THETA_STAR, Keys
from controllers.nav2_params.section import parameter_names
from controllers.releases import Release
from gym_mapbench.errors import ConfigError
from gym_mapbench.settings import Settings


@dataclass(frozen=True)
class Plugin:
    """A plugin with parameters of its own; its module is imported when they are asked for.

    Args:
        ros_class: Its class in ROS.
        module: Where its parameters are.
        settings: Name of the parameters' class there.
        other_keys: What is known of the other keys of its section; None if the constants ``ROS_ONLY_KEYS`` and
            ``RENAMED_KEYS`` of the module and ``MISSING`` of its parameters say it.
    """

    ros_class: str
    module: str
    settings: str
    other_keys: Keys | None = None

    @cached_property
    def params(self) -> type[Settings]:
        """The class of its parameters."""
        params: type[Settings] = getattr(import_module(self.module), self.settings)
        return params

    def keys_of(self, release: Release) -> Keys:
        """What is known of the other keys of its section."""
        if self.other_keys is not None:
            return self.other_keys
        module = import_module(self.module)
        return Keys(module.ROS_ONLY_KEYS, self._missing(release), module.RENAMED_KEYS)

    def parameters_of(self, release: Release) -> list[str]:
        """Dotted names of its parameters in ROS."""
        missing = self._missing(release)
        return [name for name in parameter_names(self.params) if name != "release" and name not in missing]

    def _missing(self, release: Release) -> Mapping[str, str]:
        """Parameters of other releases -> what this one does instead."""
        missing: Mapping[str, str] = getattr(self.params, "MISSING", {}).get(release, {})
        return missing

    def complete(self, values: Mapping[str, Any]) -> dict[str, Any]:
        """Check parameters and fill in the defaults; the result is JSON-able and leaves out what is None."""
        return self.params(**values).model_dump(mode="json", exclude_none=True)


CONTROLLERS = {
    "dwb": Plugin("dwb_core::DWBLocalPlanner", "controllers.dwb.params", "DwbParams"),
    "mppi": Plugin("nav2_mppi_controller::MPPIController", "controllers.mppi.params", "MppiParams"),
    "rpp": Plugin(
        "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
        "controllers.rpp.params",
        "RppParams",
    ),
}
PLANNERS = {
    "navfn": Plugin("nav2_navfn_planner/NavfnPlanner", "gym_mapbench.planners", "NavfnParams", NAVFN),
    "smac_2d": Plugin("nav2_smac_planner/SmacPlanner2D", "gym_mapbench.planners", "Smac2DParams", SMAC_2D),
    "theta_star": Plugin(
        "nav2_theta_star_planner/ThetaStarPlanner", "gym_mapbench.planners", "ThetaStarParams", THETA_STAR
    ),
}
PROGRESS_CHECKERS = {
    "simple": "nav2_controller::SimpleProgressChecker",
    "pose": "nav2_controller::PoseProgressChecker",
}
GOAL_CHECKERS = {
    "simple": "nav2_controller::SimpleGoalChecker",
    "stopped": "nav2_controller::StoppedGoalChecker",
    "position": "nav2_controller::PositionGoalChecker",
}
COSTMAP_LAYERS = {
    "static_layer": "nav2_costmap_2d::StaticLayer",
    "obstacle_layer": "nav2_costmap_2d::ObstacleLayer",
    "voxel_layer": "nav2_costmap_2d::VoxelLayer",
    "inflation_layer": "nav2_costmap_2d::InflationLayer",
}
BEHAVIORS = {"spin": "nav2_behaviors/Spin", "backup": "nav2_behaviors/BackUp", "wait": "nav2_behaviors/Wait"}


def name_of_class(ros_class: object, classes: Mapping[str, str], where: str, what: str) -> str:
    """Return our name of a plugin class; ``/`` and ``::`` both separate its package.

    Raises:
        ConfigError: If the class is not built here.
    """
    given = str(ros_class).replace("/", "::")
    for name, known in classes.items():
        if given == known.replace("/", "::"):
            return name
    raise ConfigError(
        f"{where}: {what} {str(ros_class)!r} is not built here (expected one of: {', '.join(classes.values())})"
    )
