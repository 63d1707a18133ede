"""Families of maps by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, JsonValue, model_validator

from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.generator.base import Family
from gym_mapbench.generator.cellular import Cellular
from gym_mapbench.generator.corridors import Corridors
from gym_mapbench.generator.doors import Doors
from gym_mapbench.generator.motifs import MOTIFS, USUAL_WIDTH, AlongRoute, Sequences
from gym_mapbench.generator.pillars import Pillars
from gym_mapbench.generator.random_shapes import RandomShapes
from gym_mapbench.generator.shapes import Cells, ShapeSettings, checked_cells
from gym_mapbench.generator.slaloms import Slaloms
from gym_mapbench.generator.sparse import Sparse
from gym_mapbench.generator.u_traps import UTraps
from gym_mapbench.registry import Registry, must_be_callable
from gym_mapbench.settings import Settings
from gym_mapbench.world.robot import RobotSpec

_OWN: dict[str, Callable[..., Family]] = {
    "doors": Doors,
    "pillars": Pillars,
    "corridors": Corridors,
    "slaloms": Slaloms,
    "u_traps": UTraps,
    "cellular": Cellular,
    "sparse": Sparse,
    "shapes": RandomShapes,
    **{name: MOTIFS[name] for name in MOTIFS.built_in},
    "sequences": Sequences,
}

FAMILIES: Registry[Callable[..., Family]] = Registry("family", "families", _OWN, check=must_be_callable)
"""The families by name; each is made of its options by keyword."""

WITHOUT_ROUTE = ("shapes", "doors", "pillars", "corridors", "slaloms", "u_traps", "cellular", "sparse")
"""The families whose maps follow no route, in the order in which benchmarks and the tuner sample them."""


def make_family(name: str, **options: Any) -> Family:
    """Make a family by name.

    Args:
        name: One of :data:`FAMILIES`.
        options: Its options, most of them ranges of its genes; the family's own where they are not given.

    Raises:
        ConfigError: If there is no such family, or it has no such option.
    """
    make = FAMILIES.get(name)
    try:
        with FAMILIES.blamed(name):
            return make(**options)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from None


def sample_genes(name: str, family: Family, rng: np.random.Generator) -> Settings:
    """Return the genes of one map of a family.

    Raises:
        PluginError: If a third-party family fails, or returns anything but genes.
    """
    with FAMILIES.blamed(name):
        genes: object = family.draw_genes(rng)
    if not isinstance(genes, Settings):
        raise PluginError(f"family {name!r}: expected genes of a subclass of Settings, got {genes!r:.80}")
    return genes


def build_map(name: str, family: Family, genes: Settings, shapes: ShapeSettings) -> Cells:
    """Return the ``(size, size)`` occupancy of a map of a family.

    Raises:
        PluginError: If a third-party family fails, or returns anything but cells of this size.
    """
    with FAMILIES.blamed(name):
        cells = family.build(genes, shapes)
    return checked_cells(cells, (shapes.size, shapes.size), f"family {name!r}: expected cells")


class FamilySpec(Settings):
    """A family of maps as data, JSON-able.

    Args:
        name: One of :data:`FAMILIES`.
        options: What differs from the family's own options.
    """

    name: Annotated[str, Field(min_length=1)]
    options: dict[str, JsonValue] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _exists(self) -> FamilySpec:
        self.make()
        return self

    def make(self) -> Family:
        """Make the family."""
        return make_family(self.name, **self.options)

    def for_robot(self, robot: RobotSpec) -> FamilySpec:
        """Return the family with as much room beside this robot as motifs leave beside one of the usual width."""
        wider = robot.width - USUAL_WIDTH
        if wider == 0.0 or not isinstance(family := self.make(), AlongRoute):
            return self
        return FamilySpec(name=self.name, options=self.options | family.options_for(wider))


def _as_specs(value: object) -> object:
    """Read one family or several, each by name or as a mapping."""
    if value is None:
        return ()
    items = list(value) if isinstance(value, Sequence) and not isinstance(value, str) else [value]
    for item in items:
        if not isinstance(item, str | Mapping | FamilySpec):
            raise ConfigError(f"expected the name of a family, or a mapping of name and options, got {item!r:.80}")
    return tuple(FamilySpec(name=item) if isinstance(item, str) else item for item in items)


FamilySpecs = Annotated[tuple[FamilySpec, ...], BeforeValidator(_as_specs)]
"""None (empty), a name, a mapping of ``name`` and ``options``, or several of these."""
