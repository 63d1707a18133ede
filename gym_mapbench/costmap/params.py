"""CostmapParams: all options of one costmap, with those of its layers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, cast

from pydantic import SerializeAsAny, SerializerFunctionWrapHandler, model_serializer, model_validator

from gym_mapbench.costmap.inflation_layer import InflationLayer, check_options
from gym_mapbench.costmap.keepout_filter import KeepoutFilter
from gym_mapbench.costmap.layers import LAYERS
from gym_mapbench.costmap.obstacle_layer import ObservationSource, ObstacleLayer
from gym_mapbench.costmap.options import CostmapOptions
from gym_mapbench.costmap.speed_filter import SpeedFilter
from gym_mapbench.costmap.static_layer import StaticLayer
from gym_mapbench.costmap.voxel_layer import VoxelLayer
from gym_mapbench.errors import ConfigError
from gym_mapbench.ros_params import refuse_missing
from gym_mapbench.settings import Settings

BRINGUP_SCAN = ObservationSource(clearing=True, max_obstacle_height=2.0)
COSTMAPS = ("local_costmap", "global_costmap")
"""Names of the costmaps, and of their nodes."""
FILTERS = ("keepout_filters", "speed_filters", "inflation_filters")
"""Options that are saved only if there are filters."""
ALWAYS_SAVED = ("static_layer", "obstacle_layer", "voxel_layer", "inflation_layer")
"""Layers whose options are kept and saved even if ``plugins`` does not list them."""


class CostmapParams(CostmapOptions):
    """Options of one costmap and of its layers, named and defaulted as in Nav2 Humble's code.

    The options of a layer are given, and saved, under the layer's name beside the others:
    ``CostmapParams(width=3, inflation_layer=InflationLayer(inflation_radius=0.4))``.

    Args:
        plugins: Names of the layers in the order in which they write: ``static_layer``, ``obstacle_layer``,
            ``voxel_layer``, ``denoise_layer``, ``inflation_layer``, or a third party's (see
            :mod:`gym_mapbench.costmap.layers`). A filter may stand among them.
        layers: Name of a layer -> its options.
        keepout_filters: Name of a keepout filter -> its options; a filter works behind all layers, unless ``plugins``
            lists it among them.
        speed_filters: Name of a speed filter -> its options.
        inflation_filters: Name of an inflation layer behind the filters -> its options; it inflates keepout zones as
            well.
    """

    plugins: tuple[str, ...] = ("static_layer", "obstacle_layer", "inflation_layer")
    layers: dict[str, SerializeAsAny[Settings]] = {}  # noqa: RUF012, pydantic copies it
    keepout_filters: dict[str, KeepoutFilter] = {}  # noqa: RUF012, pydantic copies it
    speed_filters: dict[str, SpeedFilter] = {}  # noqa: RUF012, pydantic copies it
    inflation_filters: dict[str, InflationLayer] = {}  # noqa: RUF012, pydantic copies it

    def __init__(self, **values: Any) -> None:
        super().__init__(**values)

    @classmethod
    def example_local(cls, **changes: Any) -> CostmapParams:
        """Return the local costmap of ``nav2_bringup/params/nav2_params.yaml``: 3 m x 3 m around the robot."""
        example: dict[str, Any] = {
            "publish_frequency": 2.0,
            "rolling_window": True,
            "width": 3,
            "height": 3,
            "resolution": 0.05,
            "plugins": ("voxel_layer", "inflation_layer"),
            "voxel_layer": VoxelLayer(z_voxels=16, z_resolution=0.05, scan=BRINGUP_SCAN),
            "inflation_layer": InflationLayer(cost_scaling_factor=3.0),
        }
        return cls(**{**example, **changes})

    @classmethod
    def example_global(cls, **changes: Any) -> CostmapParams:
        """Return the global costmap of ``nav2_bringup/params/nav2_params.yaml``: the whole map."""
        example: dict[str, Any] = {
            "update_frequency": 1.0,
            "resolution": 0.05,
            "track_unknown_space": True,
            "obstacle_layer": ObstacleLayer(scan=BRINGUP_SCAN),
            "inflation_layer": InflationLayer(cost_scaling_factor=3.0),
        }
        return cls(**{**example, **changes})

    @property
    def static_layer(self) -> StaticLayer:
        """Options of the static layer."""
        return cast(StaticLayer, self.layers["static_layer"])

    @property
    def obstacle_layer(self) -> ObstacleLayer:
        """Options of the obstacle layer."""
        return cast(ObstacleLayer, self.layers["obstacle_layer"])

    @property
    def voxel_layer(self) -> VoxelLayer:
        """Options of the voxel layer."""
        return cast(VoxelLayer, self.layers["voxel_layer"])

    @property
    def inflation_layer(self) -> InflationLayer:
        """Options of the inflation layer."""
        return cast(InflationLayer, self.layers["inflation_layer"])

    @property
    def observes(self) -> bool:
        """Whether a layer looks at scans."""
        return any(self.writes(name) for name in self.clearable)

    @property
    def follows_robot(self) -> bool:
        """Whether the costs, or the published speed limits, change with the robot's pose."""
        overrides = any(keepout.override_lethal_cost for keepout in self.keepout_filters.values())
        return self.rolling_window or bool(self.speed_filters) or overrides

    @property
    def clearable(self) -> tuple[str, ...]:
        """Names of the layers that a clear can name (``isClearable``): those that look at scans."""
        return tuple(name for name in self.plugins if name in self.layers and LAYERS.get(name).observes)

    @property
    def filters_among_layers(self) -> tuple[str, ...]:
        """Names of the filters that ``plugins`` lists, so that the layers behind them see what they write."""
        return tuple(name for name in self.plugins if name not in self.layers)

    def without_filters(self) -> CostmapParams:
        """Return the costmap with its layers alone."""
        layers = tuple(name for name in self.plugins if name in self.layers)
        return self.replace(plugins=layers, **{kind: {} for kind in FILTERS})

    @property
    def covers_map(self) -> bool:
        """Whether the map gives size and place, as Nav2's static layer has it (``processMap``), disabled or not."""
        return "static_layer" in self.plugins and not self.rolling_window

    def writes(self, layer: str) -> bool:
        """Whether a layer of this name is among the plugins and enabled."""
        return layer in self.plugins and layer in self.layers and bool(getattr(self.layers[layer], "enabled", True))

    @classmethod
    def option_names(cls) -> list[str]:
        """Names of all options, those of the layers included."""
        return [*(name for name in super().option_names() if name != "layers"), *LAYERS.built_in]

    @model_validator(mode="before")
    @classmethod
    def _collect_layers(cls, values: Any) -> Any:
        """Move the options of the layers, which stand beside the others, into ``layers``; fill in the defaults."""
        if not isinstance(values, Mapping):
            return values
        plugins, held = values.get("plugins", cls.model_fields["plugins"].default), values.get("layers", {})
        if not isinstance(plugins, list | tuple) or not isinstance(held, Mapping):
            return values
        given = {**held, **{name: options for name, options in values.items() if name not in cls.model_fields}}
        listed = [name for name in plugins if isinstance(name, str) and name not in _filters_in(values)]
        known = dict.fromkeys([*ALWAYS_SAVED, *(name for name in LAYERS.built_in if name in given), *listed])
        layers = {name: _options(name, given.get(name, {})) for name in known}
        return {**{key: value for key, value in values.items() if key not in layers}, "layers": layers}

    @model_serializer(mode="wrap")
    def _beside_the_others(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Save the options of the layers beside the others, filters if there are any, and the release last."""
        saved = serialize(self)
        for name in FILTERS:
            if not saved[name]:
                del saved[name]
        layers, release = saved.pop("layers"), saved.pop("release")
        return {**saved, **layers, "release": release}

    @model_validator(mode="after")
    def _known_in_release(self) -> CostmapParams:
        """Refuse layers, and options of layers, that the release does not have."""
        for name in filter(self.writes, self.plugins):
            entry = LAYERS.get(name)
            if entry.nav2 is not None:
                refuse_missing(entry.nav2.names, self.release, name)
            try:
                entry.check(self.layers[name], self.release)
            except ConfigError as error:
                raise ConfigError(f"{name}.{error}") from None
        for name, keepout in self.keepout_filters.items():
            if keepout.override_lethal_cost and self.release == "humble":
                raise ConfigError(f"keepout_filters.{name}.override_lethal_cost: Nav2 Humble has no such parameter")
        return self

    @model_validator(mode="after")
    def _each_filter_has_its_name(self) -> CostmapParams:
        """Refuse a name that two filters have: Nav2 lists all of them together."""
        taken: dict[str, str] = {}
        for kind in FILTERS:
            for name in getattr(self, kind):
                if name in taken:
                    raise ConfigError(f"{kind}.{name}: expected a name that no filter in {taken[name]} has")
                taken[name] = kind
        return self

    @model_validator(mode="after")
    def _inflates_as_the_layer(self) -> CostmapParams:
        """Refuse options of inflation layers behind the filters that the release or the layer's section denies."""
        for name, options in self.inflation_filters.items():
            try:
                check_options(options, self.release)
            except ConfigError as error:
                raise ConfigError(f"inflation_filters.{name}.{error}") from None
            if name in self.plugins and options != self.layers.get(name):
                raise ConfigError(
                    f"inflation_filters.{name}: expected the options of the layer of this name, got others; Nav2 reads "
                    "one section for both"
                )
        return self


def _filters_in(values: Mapping[str, Any]) -> set[str]:
    """Return the names of the filters, without those that a layer of Nav2 has."""
    held = (values.get(kind, {}) for kind in FILTERS)
    return {name for filters in held if isinstance(filters, Mapping) for name in filters} - {*LAYERS.built_in}


def _options(name: str, given: object) -> Settings:
    """Return the options of a layer; a mapping is checked.

    Raises:
        ConfigError: If ``plugins`` lists a layer that does not exist, or an option is wrong.
    """
    try:
        options = LAYERS.get(name).params
    except ConfigError as error:
        raise ConfigError(f"plugins: {error}") from None
    return given if isinstance(given, options) else options.from_mapping(given, name)
