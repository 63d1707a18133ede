"""The registry of the layers: what third parties can add, and what they can do wrong."""

from __future__ import annotations

import sys
import types

import numpy as np
import pytest

from gym_mapbench.costmap import LAYERS, CostmapParams, Layer, LayeredCostmap, LayerEntry
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.ros_params import RosPlugin, since
from gym_mapbench.settings import Settings
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

POINT = Footprint.from_radius(0.01, 0.0)
EMPTY = GridMap.from_rows(["....", "....", "...."])


class Options(Settings):
    enabled: bool = True
    cost: int = 200


class Column(Layer):
    """Writes a cost into the first column."""

    def __init__(self, options, context):
        self.cost = options.cost

    def update_bounds(self, window, robot, box):
        (box[0], box[1]), (_, box[3]) = window.corners
        box[2] = max(box[2], box[0] + window.resolution)

    def update_costs(self, window, master, cells):
        master[cells[0] : cells[2], 0] = self.cost


class Broken(Column):
    def update_costs(self, window, master, cells):
        raise RuntimeError("no cells left")


class Returning(Column):
    def update_costs(self, window, master, cells):
        return np.full(master.shape, self.cost, np.uint8)


class Nowhere(Column):
    def update_bounds(self, window, robot, box):
        box[:] = np.nan


class Moving(Column):
    def update_costs(self, window, master, cells):
        super().update_costs(window, master, cells)
        window.origin_x += 1.0


@pytest.fixture
def third_party(monkeypatch):
    """A module of a third party with three layers."""
    module = types.ModuleType("strange_layers")
    module.column, module.broken = LayerEntry(Options, Column), LayerEntry(Options, Broken)
    module.newer = LayerEntry(Options, Column, nav2=RosPlugin(since("jazzy", "strange::Newer"), "it", Options))
    module.returning, module.nowhere = LayerEntry(Options, Returning), LayerEntry(Options, Nowhere)
    module.moving, module.no_layer = LayerEntry(Options, Moving), LayerEntry(Options, lambda *_: 5)
    module.number, module.unlike = 5, LayerEntry(dict, Column)
    monkeypatch.setitem(sys.modules, "strange_layers", module)


def params(name, **options):
    return CostmapParams.example_global(plugins=("static_layer", name), **({name: options} if options else {}))


@pytest.mark.usefixtures("third_party")
class TestOfThirdParties:
    def test_a_layer_is_named_like_a_module_and_an_attribute(self):
        made = params("strange_layers:column", cost=7)
        assert LayeredCostmap(made, EMPTY, POINT).update(Pose(0.1, 0.1)).costs[:, 0].tolist() == [7, 7, 7]
        assert CostmapParams(**made.model_dump(mode="json")) == made

    def test_a_layer_that_is_no_longer_listed_is_forgotten(self):
        made = params("strange_layers:column", cost=7).replace(plugins=("static_layer",))
        assert "strange_layers:column" not in made.layers
        assert CostmapParams(**made.model_dump(mode="json")) == made

    def test_a_layer_can_be_switched_off(self):
        made = params("strange_layers:column", enabled=False)
        assert not LayeredCostmap(made, EMPTY, POINT).update(Pose(0.1, 0.1)).costs.any()

    def test_a_layer_that_fails_is_reported_in_one_line(self):
        costmap = LayeredCostmap(params("strange_layers:broken"), EMPTY, POINT)
        with pytest.raises(PluginError, match=r"^costmap layer 'strange_layers:broken': RuntimeError: no cells left"):
            costmap.update(Pose(0.1, 0.1))

    @pytest.mark.parametrize(
        ("name", "message"),
        [
            ("returning", r"expected update_costs to write into its argument and return None, got array\("),
            ("nowhere", r"expected a box of numbers, got \[nan, nan, nan, nan\]"),
            ("no_layer", "expected a Layer, got 5"),
        ],
    )
    def test_a_wrong_answer_is_reported_in_one_line(self, name, message):
        with pytest.raises(PluginError, match=f"^costmap layer 'strange_layers:{name}': {message}"):
            LayeredCostmap(params(f"strange_layers:{name}"), EMPTY, POINT).update(Pose(0.1, 0.1))

    def test_a_layer_cannot_move_the_costmap(self):
        made = LayeredCostmap(params("strange_layers:moving"), EMPTY, POINT).update(Pose(0.1, 0.1))
        assert (made.origin_x, made.origin_y) == EMPTY.origin

    @pytest.mark.parametrize(
        ("name", "options", "message"),
        [
            ("strange_layers:column", {"cost": "much"}, "strange_layers:column: cost: expected"),
            ("strange_layers:colum", {}, "plugins: costmap layer 'strange_layers:colum' cannot be loaded"),
            ("strange_layers:number", {}, "plugins: .* expected LayerEntry, got int"),
            ("strange_layers:unlike", {}, r"plugins: .* expected a subclass of .*Settings, got <class"),
            ("strange_layers:newer", {}, "strange_layers:newer: Nav2 Humble has no Newer; --nav2 jazzy has"),
            ("inflation_layer", {"enabled": 1}, "inflation_layer: .*expected true or false, got 1"),
        ],
    )
    def test_what_cannot_be_is_refused_in_one_line(self, name, options, message):
        with pytest.raises(ConfigError, match=message):
            params(name, **options)


@pytest.mark.parametrize("options", [{"layers": 5}, {"plugins": 5}, {"plugins": [5]}, {"inflaton_layer": {}}])
def test_options_of_another_form_are_refused_in_one_line(options):
    (key,) = options
    with pytest.raises(ConfigError, match=key):
        CostmapParams(**options)


def test_every_layer_of_nav2_says_so_itself():
    for name in LAYERS.built_in:
        entry = LAYERS.get(name)
        assert entry.nav2 is not None
        assert entry.nav2.params is entry.params
        assert {*entry.nav2.names.values()} == {f"nav2_costmap_2d::{entry.params.__name__}"}
