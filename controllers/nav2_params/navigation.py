"""NavigationParams: all parameters of the navigator, frozen, with Nav2's names and in Nav2's sections.

The defaults are those of Nav2's code. Most people run the values of Nav2's example files instead, which are the
presets ``thesis`` (Humble), ``jazzy`` and ``lyrical``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import BeforeValidator, Field, field_validator, model_validator

from controllers.behaviors import DRIVE_ON_HEADING, BehaviorServer, BehaviorTree, default_behaviors, default_tree
from controllers.checkers import GOAL_CHECKERS, GoalChecker, ProgressChecker
from controllers.collision_monitor import CollisionMonitor
from controllers.nav2_params.plugin_settings import ControllerPlugin, PlannerPlugin, SmootherPlugin, with_release
from controllers.nav2_params.plugins import CONTROLLERS, SHIMS
from controllers.path_handler import PathHandler
from controllers.rotation_shim.plugin import configured_inside
from controllers.tree_xml.needs import asked_behaviors, cleared_layers, plugin_names, smooths_paths
from controllers.tree_xml.reading import read_tree
from gym_mapbench.costmap import CostmapParams
from gym_mapbench.errors import ConfigError, unknown_name
from gym_mapbench.quantities import NonNegative, Positive
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.settings import ExtendedSettings, Settings


def _three(value: object) -> object:
    """Return the values for x, y and theta; of six (Kilted: positions, then angles) those of a ground robot."""
    if isinstance(value, (list, tuple)) and len(value) == 6:
        return value[0], value[1], value[5]
    if not isinstance(value, (list, tuple)) or len(value) != 3:
        raise ConfigError(f"expected three values for x, y and theta, got {value!r}")
    return value


DEFAULT_SMOOTHER = "simple_smoother"
"""The smoother of a smoother server that lists none."""
Axes = Annotated[tuple[float, float, float], BeforeValidator(_three)]


class ControllerServer(ExtendedSettings):
    """Nav2's ``controller_server``.

    Args:
        controller_frequency: Rate of the controller, Hz.
        min_x_velocity_threshold: Measured speeds up to this count as 0, m/s.
        min_y_velocity_threshold: Likewise sideways, m/s.
        min_theta_velocity_threshold: Likewise of the turn rate, rad/s.
        failure_tolerance: Seconds for which a controller may have no valid command; 0 for none, -1 for any time.
        publish_zero_velocity: Whether the robot is told to stop where an action ends; where it does not reach its goal,
            Humble's and Lyrical's robot always is.
        costmap_update_timeout: Seconds after which the server gives up to wait for a cleared costmap (since Jazzy).
        progress_checker: Parameters of the progress checker.
        goal_checker: Parameters of the goal checker.
        path_handler: Parameters of the path handler (Lyrical).
    """

    newer: ClassVar[tuple[str, ...]] = ("path_handler",)

    controller_frequency: Annotated[Positive, Field(le=1000)] = 20.0
    min_x_velocity_threshold: NonNegative = 1e-4
    min_y_velocity_threshold: NonNegative = 1e-4
    min_theta_velocity_threshold: NonNegative = 1e-4
    failure_tolerance: Annotated[float, Field(ge=-1)] = 0.0
    publish_zero_velocity: bool = True
    costmap_update_timeout: Positive = 0.3
    progress_checker: ProgressChecker = ProgressChecker()
    goal_checker: GoalChecker = GoalChecker()
    path_handler: PathHandler = PathHandler()


class VelocitySmoother(Settings):
    """Nav2's ``velocity_smoother`` between controller and base. Axes are x, y, theta.

    Humble's recoveries bypass it; for ``velocity_timeout`` after the controller's last command its zeros come between
    their commands. Since Jazzy recoveries go through it.

    Args:
        smoothing_frequency: Rate of the smoother, Hz.
        scale_velocities: Whether all axes are slowed by the ratio of the most restricted one.
        feedback: ``OPEN_LOOP`` goes on from the last output, ``CLOSED_LOOP`` from the measured velocity.
        max_velocity: Highest velocities, m/s, m/s, rad/s.
        min_velocity: Lowest velocities, m/s, m/s, rad/s; not positive.
        max_accel: Accelerations, m/s^2, m/s^2, rad/s^2.
        max_decel: Decelerations, m/s^2, m/s^2, rad/s^2; not positive.
        odom_duration: Time over which the measured velocity is averaged, s.
        deadband_velocity: Velocities below which the output becomes 0, m/s, m/s, rad/s.
        velocity_timeout: Seconds without a command after which the robot is stopped and the smoother falls silent.
    """

    smoothing_frequency: Annotated[Positive, Field(le=1000)] = 20.0
    scale_velocities: bool = False
    feedback: Literal["OPEN_LOOP", "CLOSED_LOOP"] = "OPEN_LOOP"
    max_velocity: Axes = (0.5, 0.0, 2.5)
    min_velocity: Axes = (-0.5, 0.0, -2.5)
    max_accel: Axes = (2.5, 0.0, 3.2)
    max_decel: Axes = (-2.5, 0.0, -3.2)
    odom_duration: NonNegative = 0.1
    deadband_velocity: Axes = (0.0, 0.0, 0.0)
    velocity_timeout: NonNegative = 1.0

    @field_validator("max_accel", "max_velocity")
    @classmethod
    def _not_negative(cls, value: Axes) -> Axes:
        if min(value) < 0:
            raise ConfigError(f"expected no negative value, got {list(value)}")
        return value

    @field_validator("max_decel", "min_velocity")
    @classmethod
    def _not_positive(cls, value: Axes) -> Axes:
        if max(value) > 0:
            raise ConfigError(f"expected no positive value, got {list(value)}")
        return value


class NavigationParams(ExtendedSettings):
    """All parameters of the navigator.

    Args:
        release: The release of Nav2 whose behaviour this is; controllers, NavFn and costmaps must be of the same one.
        controller_server: The controller server and its checkers.
        controllers: Controllers by name, in order.
        planner: The global planner.
        local_costmap: The local costmap.
        global_costmap: The global costmap.
        behavior_server: The recovery behaviours.
        bt: The behaviour tree.
        velocity_smoother: The velocity smoother; None if there is none between controller and base.
        collision_monitor: The collision monitor in front of the base; None if there is none.
        smoothers: Path smoothers by name, for a tree with ``SmoothPath``; if empty, the simple smoother with the
            defaults of Nav2's code.
    """

    newer: ClassVar[tuple[str, ...]] = ("collision_monitor", "smoothers")

    release: Release = "humble"
    controller_server: ControllerServer = ControllerServer()
    controllers: dict[str, ControllerPlugin] = Field(default_factory=dict)
    planner: PlannerPlugin = PlannerPlugin()
    local_costmap: CostmapParams = CostmapParams()
    global_costmap: CostmapParams = CostmapParams()
    behavior_server: BehaviorServer = BehaviorServer()
    bt: BehaviorTree = BehaviorTree()
    velocity_smoother: VelocitySmoother | None = None
    collision_monitor: CollisionMonitor | None = None
    smoothers: dict[str, SmootherPlugin] = Field(default_factory=dict)

    @model_validator(mode="before")
    @classmethod
    def _of_the_release(cls, values: Any) -> Any:
        """Fill in what depends on the release."""
        release = values.get("release", "humble") if isinstance(values, Mapping) else None
        if not isinstance(release, str) or release not in RELEASES:
            return values
        navfn, costmap = PlannerPlugin(params={"release": release}), CostmapParams(release=release)
        defaults = {
            "planner": navfn,
            "bt": default_tree(release),
            "behavior_server": default_behaviors(release),
            "local_costmap": costmap,
            "global_costmap": costmap,
        }
        return with_release({**defaults, **values}, release)

    @model_validator(mode="after")
    def _of_one_release(self) -> Self:
        releases = {f"controllers.{name}": plugin.params["release"] for name, plugin in self.controllers.items()}
        plugins: dict[str, PlannerPlugin | SmootherPlugin] = {"planner": self.planner}
        plugins |= {f"smoothers.{name}": one for name, one in self.smoothers.items()}
        releases |= {name: plugin.params.get("release", self.release) for name, plugin in plugins.items()}
        releases |= {name: costmap.release for name, costmap in self.costmaps.items()}
        for name, release in releases.items():
            if release != self.release:
                got = f"got {release}'s, as the option release says"
                raise ConfigError(f"{name}: expected parameters of Nav2's {self.release}, {got}")
        plugin = self.controller_server.goal_checker.plugin
        if self.release not in GOAL_CHECKERS[plugin]:
            known = ", ".join(name for name, names in GOAL_CHECKERS.items() if self.release in names)
            first = next(iter(GOAL_CHECKERS[plugin])).capitalize()
            raise ConfigError(f"goal_checker.plugin: expected one of {known}, got {first}'s goal checker {plugin}")
        if self.release != "lyrical" and self.controller_server.path_handler != PathHandler():
            raise ConfigError(f"path_handler: Nav2 {self.release.capitalize()} has none; its controllers cut the plan")
        return self

    @model_validator(mode="after")
    def _tree_is_whole(self) -> Self:
        if not self.bt.xml:
            return self
        try:
            plugin_names(read_tree(self.bt.xml, self.release))
        except ConfigError as error:
            raise ConfigError(f"bt.xml: {error}") from None
        usual = BehaviorTree(), default_tree(self.release)
        for name in [name for name in BehaviorTree.model_fields if name not in ("xml", "bt_loop_duration", "latency")]:
            if getattr(self.bt, name) not in (getattr(tree, name) for tree in usual):
                raise ConfigError(f"bt.{name}: expected it in the XML of the tree, which has its own numbers")
        return self

    @model_validator(mode="after")
    def _clears_existing_layers(self) -> Self:
        for which, costmap in (("local", self.local_costmap), ("global", self.global_costmap)):
            option = f"{which}_costmap of bt.xml" if self.bt.xml else f"bt.{which}_clear_plugins"
            named = self._layers_to_clear(which)
            if named and self.release != "lyrical":
                raise ConfigError(f"{option}: clears of Nav2 {self.release.capitalize()} name no layers")
            for name in named:
                if name not in costmap.clearable:
                    known = " or ".join(costmap.clearable) or "none: no layer of this costmap looks at scans"
                    raise ConfigError(f"{option}: expected {known}, got {name!r}, at which Nav2's clear fails")
        return self

    def _layers_to_clear(self, which: str) -> tuple[str, ...]:
        """Return the layers that clears of the costmap ``local`` or ``global`` name."""
        if not self.bt.xml:
            return self.bt.plugins_to_clear(which)
        return cleared_layers(read_tree(self.bt.xml, self.release), which)

    @property
    def behaviors(self) -> tuple[str, ...]:
        """Names of the behaviours that exist: the plugins, and a drive on the heading where the tree asks for it."""
        plugins = self.behavior_server.behavior_plugins
        asked = asked_behaviors(read_tree(self.bt.xml, self.release)) if self.bt.xml else ()
        return (*plugins, DRIVE_ON_HEADING) if DRIVE_ON_HEADING in asked else plugins

    @property
    def costmaps(self) -> dict[str, CostmapParams]:
        """Both costmaps by their names."""
        return {"local_costmap": self.local_costmap, "global_costmap": self.global_costmap}

    @property
    def used_smoothers(self) -> dict[str, SmootherPlugin]:
        """The path smoothers by name that the tree may ask for; none if it smooths no path."""
        if not self.bt.xml or not smooths_paths(read_tree(self.bt.xml, self.release)):
            return {}
        usual = SmootherPlugin(params={"release": self.release})
        return self.smoothers or {DEFAULT_SMOOTHER: usual}

    @property
    def command_rate(self) -> float:
        """Highest rate at which the robot is sent commands, Hz."""
        smoother = self.velocity_smoother
        return self.controller_server.controller_frequency if smoother is None else smoother.smoothing_frequency

    def controller(self, name: str) -> ControllerPlugin:
        """Return a controller by its name, or else the first of that kind.

        A Rotation Shim that is not configured has the defaults of Nav2's code and the configured controller inside.
        A controller that needs no section, such as the Graceful Controller, has the defaults of Nav2's code as well.

        Raises:
            ConfigError: If there is no such controller.
        """
        if name in self.controllers:
            return self.controllers[name]
        for plugin in self.controllers.values():
            if plugin.kind == name:
                return plugin
        if name in SHIMS:
            return ControllerPlugin(kind=name, params=configured_inside(self.controller(SHIMS[name]).params))
        unconfigured = {kind for kind, plugin in CONTROLLERS.items() if plugin.needs_no_section and kind not in SHIMS}
        if name in unconfigured:
            return ControllerPlugin(kind=name, params={"release": self.release})
        kinds = {*(plugin.kind for plugin in self.controllers.values()), *unconfigured, *SHIMS}
        raise unknown_name("controller", name, {*self.controllers, *kinds})
