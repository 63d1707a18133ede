"""Parameters of the Rotation Shim Controller, with Nav2's names and the defaults of its code.

In Humble and Jazzy, the shim and its primary controller share one block of a parameter file, and where both know a
parameter by the same name, both read it. So the parameters of a shim around a controller are those of both at once. In
Lyrical the primary controller has a block of its own, ``primary_controller``; of that block, only the parameters whose
name the shim has as well are kept apart.

Source: nav2_rotation_shim_controller: src/nav2_rotation_shim_controller.cpp (Humble, Jazzy and Lyrical).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any, ClassVar, Self

from gym_mapbench.quantities import NonNegative, Positive
from gym_mapbench.releases import RELEASES, Release
from gym_mapbench.ros_params import ReleaseSettings
from gym_mapbench.settings import ExtendedSettings, Settings

_JAZZY: dict[str, Any] = {
    "angular_disengage_threshold": 0.3925,
    "max_cost_threshold": 254.0,
    "rotate_to_heading_once": False,
    "use_path_orientations": False,
}
_ALWAYS = "Humble looks at the heading of every new path"


_ONE_BLOCK = "the shim and its primary controller share one value"
_SHARED = ("rotate_to_heading_angular_vel", "max_angular_accel")
_APART = {f"primary_controller.{name}": _ONE_BLOCK for name in _SHARED}


class PrimaryParams(Settings):
    """Parameters of the primary controller whose names the shim has as well.

    Args:
        rotate_to_heading_angular_vel: Turn rate on the spot, rad/s.
        max_angular_accel: Angular acceleration of a turn on the spot, rad/s^2.
    """

    rotate_to_heading_angular_vel: Positive | None = None
    max_angular_accel: Positive | None = None


class RotationShimParams(ReleaseSettings, ExtendedSettings):
    """The parameters that ``nav2_rotation_shim_controller`` itself reads.

    Args:
        angular_dist_threshold: Bearing of the path from which on the robot turns on the spot, rad.
        angular_disengage_threshold: Bearing at which a turn ends, rad.
        forward_sampling_distance: Distance from the path's first pose of the pose whose bearing counts, m.
        rotate_to_heading_angular_vel: Turn rate on the spot, rad/s.
        max_angular_accel: Angular acceleration of a turn on the spot, rad/s^2.
        simulate_ahead_time: How far ahead the turn is checked for collisions, s.
        rotate_to_goal_heading: Whether the shim also turns to the goal's heading, once the goal's position is reached.
        closed_loop: Whether the turn accelerates from the measured turn rate, rather than from the last command.
        max_cost_threshold: Since Jazzy: cost under the outline from which on a turn is not made.
        rotate_to_heading_once: Since Jazzy: whether the robot does not turn again for a replanned path to the same
            goal.
        use_path_orientations: Since Jazzy: whether the heading of that pose counts, not its bearing.
        primary_controller: Lyrical: parameters of the primary controller whose names the shim has as well.
    """

    newer: ClassVar[tuple[str, ...]] = ("primary_controller",)
    MISSING: ClassVar[dict[Release, dict[str, str]]] = {
        "humble": {
            "max_cost_threshold": "Humble turns unless the outline touches an obstacle (254)",
            "rotate_to_heading_once": _ALWAYS,
            "use_path_orientations": "Humble takes the bearing of a point ahead on the path",
            **_APART,
        },
        "jazzy": _APART,
    }
    DEFAULTS: ClassVar[dict[Release, dict[str, Any]]] = {"jazzy": _JAZZY, "lyrical": _JAZZY}

    angular_dist_threshold: NonNegative = 0.785
    angular_disengage_threshold: NonNegative = 0.785
    forward_sampling_distance: NonNegative = 0.5
    rotate_to_heading_angular_vel: Positive = 1.8
    max_angular_accel: Positive = 3.2
    simulate_ahead_time: NonNegative = 1.0
    rotate_to_goal_heading: bool = False
    closed_loop: bool = True
    max_cost_threshold: NonNegative | None = None
    rotate_to_heading_once: bool | None = None
    use_path_orientations: bool | None = None
    primary_controller: PrimaryParams = PrimaryParams()

    def of_primary(self) -> Self:
        """Return the parameters as the primary controller reads them."""
        own = {name: value for name, value in self.primary_controller if value is not None}
        return self.replace(**own) if own else self


def _of_both(table: str, primary: type[Settings]) -> dict[Release, dict[str, Any]]:
    """Join a table of the shim (``MISSING`` or ``DEFAULTS``) with that of its primary controller."""
    own: Mapping[Release, Mapping[str, Any]] = getattr(RotationShimParams, table)
    inner: Mapping[Release, Mapping[str, Any]] = getattr(primary, table)
    return {release: {**inner.get(release, {}), **own.get(release, {})} for release in RELEASES}


def _lyrical_defaults(primary: type[Settings]) -> dict[str, Any]:
    """Return Lyrical's defaults, in which a primary controller does not share its turn on the spot with the shim."""
    shared = [name for name in _SHARED if name in primary.model_fields]
    apart = {f"primary_controller.{name}": primary.model_fields[name].default for name in shared}
    return _of_both("DEFAULTS", primary)["lyrical"] | apart


@cache
def params_around(primary: type[Settings]) -> type[RotationShimParams]:
    """Return the class of the parameters of a shim and of its primary controller at once."""
    metaclass: Any = type(RotationShimParams)
    namespace = {
        "__module__": __name__,
        "__doc__": f"A Rotation Shim around the controller of {primary.__name__}.",
        "__reduce__": lambda self: (
            _params,
            (primary, {name: getattr(self, name) for name in type(self).model_fields}),
        ),
        "MISSING": _of_both("MISSING", primary),
        "DEFAULTS": _of_both("DEFAULTS", primary) | {"lyrical": _lyrical_defaults(primary)},
        "newer": (*RotationShimParams.newer, *getattr(primary, "newer", ())),
    }
    both: type[RotationShimParams] = metaclass(f"Shim{primary.__name__}", (RotationShimParams, primary), namespace)
    return both


def _params(primary: type[Settings], values: Mapping[str, Any]) -> RotationShimParams:
    """Make the parameters of a shim again in another process, which pickle cannot: their class is in no module."""
    return params_around(primary)(**values)
