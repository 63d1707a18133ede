"""Costmap filters: masks, the keepout filter behind all layers, the limits of the speed filter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from gym_mapbench.costmap import (
    CostmapParams,
    FilterMask,
    InflationLayer,
    KeepoutFilter,
    LayeredCostmap,
    SpeedFilter,
    SpeedLimit,
)
from gym_mapbench.costmap.keepout_filter import mask_costs
from gym_mapbench.errors import ConfigError
from gym_mapbench.kernels.filters import NO_OVERRIDE, write_mask
from gym_mapbench.releases import RELEASES
from gym_mapbench.world.footprint import Footprint
from gym_mapbench.world.frames import compose
from gym_mapbench.world.gridmap import GridMap
from gym_mapbench.world.scenario import Pose

POINT = Footprint.from_radius(0.05, 0.0)
EMPTY = GridMap(np.zeros((40, 40), bool), 0.1)
CENTRE = Pose(2.0, 2.0)
MAP_FRAME = Pose(0.0, 0.0)

values = arrays(np.int8, array_shapes(min_dims=2, max_dims=2, max_side=7), elements=st.integers(-1, 100))


def zone(row0=10, row1=20, col0=10, col1=30, value=100, **changes):
    """A mask of the empty map with one zone."""
    cells = np.zeros((40, 40), np.int8)
    cells[row0:row1, col0:col1] = value
    return FilterMask.from_values(cells, 0.1, **changes)


def overall(mask, release="jazzy", plugins=("static_layer", "inflation_layer"), inflation_layer=None, **changes):
    options = {"keepout_filters": {"keepout": KeepoutFilter(mask=mask, **changes)}}
    options |= {"inflation_layer": inflation_layer or InflationLayer()}
    return CostmapParams(plugins=plugins, resolution=0.1, release=release, **options)


def costs_of(params, pose=CENTRE, grid=EMPTY, frame=MAP_FRAME):
    return LayeredCostmap(params, grid, POINT).update(pose, frame).costs


class TestMask:
    @given(values, st.floats(0.01, 2.0), st.tuples(st.floats(-9, 9), st.floats(-9, 9)))
    def test_comes_back_from_its_runs_and_from_a_file(self, cells, resolution, origin):
        mask = FilterMask.from_values(cells, resolution, origin)
        assert np.array_equal(mask.values, cells)
        assert FilterMask(**mask.model_dump(mode="json")) == mask

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"runs": "0x3"}, "runs: expected 4 values, rows times cols, got 3"),
            ({"runs": "101x4"}, "runs: expected values of -1 to 100, got 101 to 101"),
            ({"runs": "zone"}, "runs: expected runs 'VALUExCOUNT VALUExCOUNT ...', got 'zone'"),
            ({"rows": 10_000, "cols": 10_000, "runs": "0x99999999"}, "rows, cols: expected at most 25000000 cells"),
            ({"resolution": 0.0}, "resolution: expected"),
        ],
    )
    def test_refuses_in_one_line(self, changes, message):
        with pytest.raises(ConfigError, match=f"^{message}") as error:
            FilterMask(**{"rows": 2, "cols": 2, "resolution": 0.1, "runs": "0x4"} | changes)
        assert "\n" not in str(error.value)

    def test_values_become_costs_as_in_the_sources(self):
        cells = np.array([[0, 1, 25, 50, 99, 100, -1]], np.int8)
        assert mask_costs(FilterMask.from_values(cells, 0.1)).tolist() == [[0, 3, 64, 127, 251, 254, 255]]

    def test_the_cell_of_a_pose_is_rounded_down_and_none_off_the_mask(self):
        mask = FilterMask.from_values(np.zeros((2, 3), np.int8), 0.5, (1.0, -1.0))
        assert mask.cell_at(Pose(1.0, -1.0)) == (0, 0)
        assert mask.cell_at(Pose(2.4, -0.1)) == (1, 2)
        assert mask.cell_at(Pose(0.99, 0.0)) is mask.cell_at(Pose(2.51, -0.5)) is mask.cell_at(Pose(1.5, 0.01)) is None


class TestKernel:
    @settings(max_examples=60, deadline=None)
    @given(
        arrays(np.uint8, (6, 7)), values, st.floats(0.05, 0.4),
        st.tuples(st.floats(-1, 1), st.floats(-1, 1), st.floats(-3, 3)), st.sampled_from([NO_OVERRIDE, 200]),
    )  # fmt: skip
    def test_is_that_of_a_plain_twin(self, master, cells, resolution, frame, override):
        mask = FilterMask.from_values(cells, resolution, (-0.5, -0.3))
        written, window = master.copy(), (1, 1, 6, 6)
        geometry = 0.2, -0.7, -0.4
        write_mask(written, *geometry, mask_costs(mask), *mask.geometry, *frame, *window, override)
        assert np.array_equal(written, plain_twin(master, geometry, mask, Pose(*frame), window, override))


def plain_twin(master, geometry, mask, frame, window, override):
    """Raise the costs cell by cell, without a kernel."""
    raised, (resolution, x0, y0), costs = master.copy(), geometry, mask_costs(mask)
    for row in range(window[0], window[2]):
        for col in range(window[1], window[3]):
            x, y = x0 + (col + 0.5) * resolution, y0 + (row + 0.5) * resolution
            cos, sin = math.cos(frame.yaw), math.sin(frame.yaw)
            cell = mask.cell_at(Pose(cos * x - sin * y + frame.x, sin * x + cos * y + frame.y))
            if cell is None or costs[cell] == 255:
                continue
            if master[row, col] == 255 or costs[cell] > master[row, col]:
                raised[row, col] = costs[cell] if override == NO_OVERRIDE else override
    return raised


class TestKeepout:
    @pytest.mark.parametrize("release", RELEASES)
    def test_zones_are_lethal_and_not_inflated(self, release):
        costs = costs_of(overall(zone(), release))
        assert (costs[10:20, 10:30] == 254).all()
        assert costs.sum() == 200 * 254

    def test_higher_costs_stay_and_unknown_cells_of_the_mask_change_nothing(self):
        grid = GridMap(EMPTY.occupancy | (np.arange(1600).reshape(40, 40) == 15 * 40 + 15), 0.1)
        plain = costs_of(CostmapParams(plugins=("static_layer", "inflation_layer"), resolution=0.1), grid=grid)
        assert np.array_equal(costs_of(overall(zone(value=-1)), grid=grid), plain)
        assert np.array_equal(costs_of(overall(zone(value=50)), grid=grid), np.maximum(plain, zone_costs(127)))

    def test_unknown_cells_of_the_costmap_give_way(self):
        params = overall(zone(value=1), plugins=("inflation_layer",)).replace(track_unknown_space=True)
        assert set(costs_of(params, Pose(0.5, 0.5))[:5, :5].ravel().tolist()) <= {0, 255}
        assert costs_of(overall(zone(value=1), plugins=()).replace(track_unknown_space=True))[15, 15] == 3

    def test_masks_of_another_resolution_and_origin_are_sampled_at_the_centres(self):
        mask = FilterMask.from_values(np.array([[0, 100], [100, 0]], np.int8), 0.5, (1.0, 1.0))
        costs = costs_of(overall(mask))
        expected = np.zeros((40, 40), int)
        expected[12:15, 15:20] = expected[15:20, 12:15] = 254
        assert np.array_equal(costs, expected), "Nav2 begins half a cell of the mask inside"

    @pytest.mark.parametrize("frame", [Pose(0.0, 0.0), Pose(0.3, -0.2, 0.5), Pose(1.0, 0.0, math.pi)])
    def test_a_local_costmap_in_another_frame_sees_the_zones_at_their_places(self, frame):
        local = CostmapParams.example_local(keepout_filters={"keepout": KeepoutFilter(mask=zone())})
        window = LayeredCostmap(local, EMPTY, POINT)
        seen = window.update(Pose(1.0, 1.0), frame)
        for row, col in np.ndindex(seen.costs.shape):
            x, y = seen.origin_x + (col + 0.5) * seen.resolution, seen.origin_y + (row + 0.5) * seen.resolution
            at = compose(frame, Pose(x, y))
            if min(abs(at.x - edge) for edge in (1.0, 3.0)) > 1e-6 and min(abs(at.y - edge) for edge in (1, 2)) > 1e-6:
                assert (seen.costs[row, col] == 254) == (1.0 < at.x < 3.0 and 1.0 < at.y < 2.0)

    def test_layers_do_not_see_the_zones_and_a_rolling_window_takes_them_along(self):
        inflation = InflationLayer(inflation_radius=1.0)
        local = CostmapParams.example_local(inflation_layer=inflation, release="jazzy")
        with_filter = local.replace(keepout_filters={"keepout": KeepoutFilter(mask=zone())})
        window, plain = LayeredCostmap(with_filter, EMPTY, POINT), LayeredCostmap(local, EMPTY, POINT)
        for step in range(8):
            pose = Pose(0.5 + 0.3 * step, 1.5)
            seen, without = window.update(pose), plain.update(pose).costs
            assert ((seen.costs == without) | (seen.costs == 254)).all()
            row, col = seen.world_to_map(1.55, 1.55)
            assert seen.costs[row, col] == 254

    def test_clearing_keeps_the_mask(self):
        window = LayeredCostmap(
            CostmapParams.example_global(keepout_filters={"k": KeepoutFilter(mask=zone())}), EMPTY, POINT
        )
        before = window.update(CENTRE).costs
        window.clear()
        assert np.array_equal(window.update(CENTRE).costs, before)

    @pytest.mark.parametrize(
        ("release", "rolling", "expected"),
        [
            ("jazzy", True, [254, 200, 200, 254, 254]),
            ("lyrical", True, [254, 200, 200, 254, 254]),
            ("lyrical", False, [254, 200, 200, 254, 254]),
            ("jazzy", False, [254, 200, 200, 200, 200]),
        ],
    )
    def test_a_robot_inside_sees_the_override(self, release, rolling, expected):
        """Jazzy's layers do not update a costmap of the map alone again when the robot leaves; Lyrical's do."""
        params = overall(zone(), release, override_lethal_cost=True, lethal_override_cost=200)
        costmap = LayeredCostmap(params.replace(rolling_window=rolling, width=6, height=6), EMPTY, POINT)
        seen = [costmap.update(Pose(x, 1.5)) for x in (0.5, 2.0, 2.5, 3.5, 3.6)]
        assert [int(one.costs[one.world_to_map(1.55, 1.55)]) for one in seen] == expected

    @pytest.mark.parametrize("release", RELEASES)
    def test_among_the_layers_the_layers_behind_see_the_zones(self, release):
        """A zone before the inflation layer is inflated as an obstacle of the map is; one behind it is not."""
        plugins, inflation = ("static_layer", "keepout", "inflation_layer"), InflationLayer(inflation_radius=0.5)
        wall = GridMap(zone_costs(254) == 254, 0.1)
        params = overall(zone(), release, plugins, inflation_layer=inflation)
        walled = params.without_filters()
        assert walled.plugins == ("static_layer", "inflation_layer")
        seen = costs_of(params)
        assert (seen[10:20, 10:30] == 254).all()
        assert seen[9, 15] > 0
        assert np.array_equal(seen, costs_of(walled, grid=wall))
        behind = costs_of(params.replace(plugins=("static_layer", "inflation_layer", "keepout")))
        assert np.array_equal(behind, costs_of(params.replace(plugins=walled.plugins)))
        assert CostmapParams(**params.model_dump(mode="json")) == params

    def test_among_the_layers_of_a_rolling_window_it_stays_at_its_place(self):
        local = CostmapParams.example_local(
            plugins=("keepout", "voxel_layer", "inflation_layer"),
            keepout_filters={"keepout": KeepoutFilter(mask=zone())},
        )
        window = LayeredCostmap(local, EMPTY, POINT)
        window.update(Pose(1.0, 1.0))
        seen = window.update(Pose(1.5, 1.0))
        cells = [seen.world_to_map(1.55, y) for y in (0.55, 0.95, 1.05, 1.95)]
        assert [int(seen.costs[cell]) > 0 for cell in cells] == [True, True, True, True]
        assert [int(seen.costs[cell]) == 254 for cell in cells] == [False, False, True, True]
        assert local.clearable == ("voxel_layer",)

    @pytest.mark.parametrize("release", RELEASES)
    def test_an_inflation_layer_behind_the_filters_inflates_the_zones_and_the_layers_do_not_see_it(self, release):
        """As among the layers before the inflation layer, but the layers' own cells stay without zones."""
        inflation = InflationLayer(inflation_radius=0.5)
        params = overall(zone(), release, inflation_layer=inflation).replace(inflation_filters={"again": inflation})
        before = overall(zone(), release, ("static_layer", "keepout", "inflation_layer"), inflation_layer=inflation)
        costmap = LayeredCostmap(params, EMPTY, POINT)
        assert np.array_equal(costmap.update(CENTRE).costs, costs_of(before))
        costmap.clear()
        assert np.array_equal(costmap.update(CENTRE).costs, costs_of(before))
        assert CostmapParams(**params.model_dump(mode="json")) == params
        assert params.without_filters() == overall(zone(), release, inflation_layer=inflation).without_filters()

    def test_an_inflation_layer_behind_the_filters_has_the_options_of_the_layer_of_its_name(self):
        with pytest.raises(ConfigError, match=r"inflation_filters\.inflation_layer: expected the options of the layer"):
            overall(zone()).replace(inflation_filters={"inflation_layer": InflationLayer(inflation_radius=0.9)})
        with pytest.raises(
            ConfigError, match=r"inflation_filters\.again\.custom_inscribed_radius: Nav2 Jazzy has none"
        ):
            overall(zone()).replace(inflation_filters={"again": InflationLayer(custom_inscribed_radius=0.1)})

    @pytest.mark.parametrize(("release", "seen"), [("humble", False), ("jazzy", True), ("lyrical", True)])
    def test_since_jazzy_a_clear_makes_the_mask_new_again(self, release, seen):
        """Without a layer that widens the update, Humble writes no zone into a cleared window."""
        params = overall(zone(), release, ()).replace(rolling_window=True, width=3, height=3)
        window = LayeredCostmap(params, EMPTY, POINT)
        window.update(CENTRE)
        window.clear()
        assert (window.update(CENTRE).costs == 254).any() == seen

    @pytest.mark.parametrize(
        "second", [{"speed_filters": {"a": SpeedFilter(mask=zone())}}, {"inflation_filters": {"a": InflationLayer()}}]
    )
    def test_each_filter_has_a_name_of_its_own(self, second):
        with pytest.raises(ConfigError, match=r"_filters\.a: expected a name that no filter in keepout_filters has"):
            CostmapParams(keepout_filters={"a": KeepoutFilter(mask=zone())}, **second)

    def test_humble_has_no_override(self):
        with pytest.raises(ConfigError, match=r"keepout_filters\.keepout\.override_lethal_cost: Nav2 Humble has no"):
            overall(zone(), "humble", override_lethal_cost=True)

    def test_no_filters_no_trace_in_files(self):
        params = CostmapParams()
        assert not {"keepout_filters", "speed_filters", "inflation_filters"} & params.model_dump().keys()
        held = overall(zone()).model_dump(mode="json")
        assert CostmapParams(**held) == overall(zone())


def zone_costs(cost):
    costs = np.zeros((40, 40), np.uint8)
    costs[10:20, 10:30] = cost
    return costs


class TestSpeed:
    @pytest.mark.parametrize(
        ("options", "value", "limit"),
        [
            ({"percentage": True, "base": 100.0, "multiplier": -1.0}, 40, 60.0),
            ({"percentage": True, "base": 0.0, "multiplier": 1.0}, 40, 40.0),
            ({"percentage": True, "base": 100.0, "multiplier": 1.0}, 1, 0.0),
            ({"percentage": True, "base": -1.0, "multiplier": 0.0}, 1, 0.0),
            ({"base": 0.0, "multiplier": 0.5}, 3, 1.5),
            ({"base": 1.0, "multiplier": -0.5}, 4, 0.0),
            ({"base": 150.0, "multiplier": 0.5}, 4, 152.0),
            ({"base": 5.0}, 0, 0.0),
            ({"base": 5.0}, -1, None),
        ],
    )
    def test_limits_of_values(self, options, value, limit):
        assert SpeedFilter(mask=zone(), **options).limit_of(value) == limit

    def test_limits_are_published_on_change_alone(self):
        costmap = self.costmap(zone(value=40), base=100.0, multiplier=-1.0, percentage=True)
        published = []
        for x in (0.5, 1.5, 1.6, 3.5, 3.6, 9.0, 1.5, 9.0):
            costmap.update(Pose(x, 1.5))
            published.append([tuple(limit) for limit in costmap.take_speed_limits()])
        slow, free = [SpeedLimit(60.0, True)], [SpeedLimit(0.0, True)]
        assert published == [[], slow, [], free, [], [], slow, []], "off the mask the limit stays"

    def test_unknown_cells_keep_the_limit(self):
        cells = zone(value=40).values.copy()
        cells[15, 20:] = -1
        costmap = self.costmap(FilterMask.from_values(cells, 0.1))
        for x in (1.5, 2.5):
            costmap.update(Pose(x, 1.55))
        assert costmap.take_speed_limits() == [SpeedLimit(40.0, False)]

    def test_costs_stay(self):
        costmap = self.costmap(zone(value=40))
        assert not costmap.update(Pose(1.5, 1.5)).costs.any()

    def test_a_filter_among_the_layers_limits_as_well(self):
        local = CostmapParams.example_local(speed_filters={"speed": SpeedFilter(mask=zone(value=40))})
        costmap = LayeredCostmap(local.replace(plugins=("voxel_layer", "speed", "inflation_layer")), EMPTY, POINT)
        costmap.update(Pose(1.5, 1.5))
        assert costmap.take_speed_limits() == [SpeedLimit(40.0, False)]

    def test_the_pose_is_moved_into_the_frame_of_the_map(self):
        costmap = self.costmap(zone(value=40))
        costmap.update(Pose(0.0, 0.0), Pose(1.5, 1.5))
        assert costmap.take_speed_limits() == [SpeedLimit(40.0, False)]

    @staticmethod
    def costmap(mask, **options):
        local = CostmapParams.example_local(speed_filters={"speed": SpeedFilter(mask=mask, **options)})
        return LayeredCostmap(local, EMPTY, POINT)
