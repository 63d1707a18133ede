"""Nav2's path smoothers: as slow twins that are plainly Nav2's, and what distinguishes the releases."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gym_mapbench.costmap import Costmap
from gym_mapbench.errors import ConfigError, PluginError
from gym_mapbench.releases import RELEASES
from gym_mapbench.smoothers import (
    SMOOTHERS,
    SavitzkyGolayParams,
    SavitzkyGolaySmoother,
    SimpleSmoother,
    SimpleSmootherParams,
    Smoothed,
    make_smoother,
)
from tests.smoothers.plain_smoothers import PlainSavitzkyGolay, PlainSimple

FREE = Costmap(np.zeros((100, 100), np.uint8), 0.1, 0.0, 0.0)
STEPS = hnp.arrays(
    np.float64,
    st.tuples(st.integers(0, 30), st.just(3)),
    elements=st.sampled_from([0.0, 0.1, -0.1, 0.05, 0.13]),
)


def path_of(*points, spacing: float = 0.05) -> np.ndarray:
    """Return a path along straight pieces, with a pose every ``spacing`` m and yaw 0, as NavFn's."""
    pieces = []
    for first, second in itertools.pairwise(points):
        count = round(float(np.hypot(*np.subtract(second, first))) / spacing)
        pieces.append(np.linspace(first, second, count, endpoint=False))
    xy = np.vstack([*pieces, [points[-1]]])
    return np.column_stack([xy, np.zeros(len(xy))])


CORNER = path_of((2.0, 2.0), (5.0, 2.0), (5.0, 5.0))


def sharpest_turn(path) -> float:
    steps = np.diff(path[:, :2], axis=0)
    steps = steps[np.hypot(*steps.T) > 1e-9]
    yaws = np.arctan2(steps[:, 1], steps[:, 0])
    return float(np.abs(np.angle(np.exp(1j * np.diff(yaws)))).max())


def simple(release: str, **params) -> SimpleSmoother:
    return SimpleSmoother(SimpleSmootherParams(release=release, **params))


def golay(release: str, **params) -> SavitzkyGolaySmoother:
    return SavitzkyGolaySmoother(SavitzkyGolayParams(release=release, **params))


@given(
    steps=STEPS,
    costs=hnp.arrays(np.uint8, (12, 12), elements=st.sampled_from([0, 0, 0, 0, 100, 252, 253, 254, 255])),
    release=st.sampled_from(RELEASES),
    do_refinement=st.booleans(),
    max_its=st.sampled_from([0, 1, 2, 7, 1000]),
    tolerance=st.sampled_from([0.0, 1e-10, 1e-3]),
    cut=st.booleans(),
)
@settings(max_examples=150)
def test_the_simple_smoother_is_its_slow_twin(steps, costs, release, do_refinement, max_its, tolerance, cut):
    options = {"enforce_path_inversion": cut} if release == "lyrical" else {}
    smoother = simple(release, do_refinement=do_refinement, max_its=max_its, tolerance=tolerance, **options)
    path = np.vstack([[[3.0, 3.0, 0.0]], 3.0 + np.cumsum(steps, axis=0)])
    costmap = Costmap(costs, 0.5, 0.0, 0.0)
    expected, completed = PlainSimple(smoother.params, release).smooth(costmap, path)
    made = smoother.smooth(costmap, path)
    np.testing.assert_allclose(made.path, expected, rtol=0, atol=1e-12)
    assert made.was_completed == completed


@given(
    steps=STEPS,
    release=st.sampled_from(RELEASES),
    do_refinement=st.booleans(),
    cut=st.booleans(),
    size=st.sampled_from([3, 5, 7, 9]),
    order=st.integers(0, 2),
)
@settings(max_examples=100)
def test_the_savitzky_golay_smoother_is_its_slow_twin(steps, release, do_refinement, cut, size, order):
    window = {"enforce_path_inversion": cut, "window_size": size, "poly_order": order} if release == "lyrical" else {}
    smoother = golay(release, do_refinement=do_refinement, **window)
    path = np.vstack([[[3.0, 3.0, 0.0]], 3.0 + np.cumsum(steps, axis=0)])
    expected, completed = PlainSavitzkyGolay(smoother.params, release).smooth(FREE, path)
    made = smoother.smooth(FREE, path)
    np.testing.assert_allclose(made.path[:, :2], expected[:, :2], rtol=0, atol=1e-9)
    steps = np.abs(np.diff(expected[:, :2], axis=0)).max(axis=1)
    moves = np.append(steps > 2e-4, False)
    # Whether a path is driven backwards is decided by one step, whose direction is rounding if it has no length.
    turn = 1j if steps.min(initial=1.0) > 1e-9 else 2j
    assert np.abs(np.exp(turn * made.path[moves, 2]) - np.exp(turn * expected[moves, 2])).max(initial=0.0) < 1e-4
    assert made.was_completed == completed


@pytest.mark.parametrize("release", RELEASES)
@pytest.mark.parametrize("make", [simple, golay])
def test_a_corner_becomes_round_and_its_ends_stay(make, release):
    before = CORNER.copy()
    made = make(release).smooth(FREE, CORNER).path
    assert sharpest_turn(made) < 0.6 < sharpest_turn(CORNER)
    assert (made[[0, -1], :2] == CORNER[[0, -1], :2]).all()
    assert made[0, 2] == pytest.approx(0.0, abs=1e-6)
    assert made[-2, 2] == pytest.approx(np.pi / 2, abs=1e-6)
    assert (before == CORNER).all()


def test_humble_refines_twice_as_often():
    turns = [sharpest_turn(simple(release).smooth(FREE, CORNER).path) for release in RELEASES]
    assert turns[0] < turns[1] == turns[2]
    again = simple("jazzy", refinement_num=4).smooth(FREE, CORNER).path
    assert (simple("humble").smooth(FREE, CORNER).path == again).all()


def test_humble_shares_its_refinements_among_the_parts_of_a_path():
    there_and_back = path_of((2.0, 2.0), (4.0, 2.0), (4.0, 4.0), (4.0, 2.0), (2.0, 2.0))
    humble, jazzy = (
        simple(release, **options).smooth(FREE, there_and_back).path
        for release, options in (("humble", {}), ("jazzy", {"refinement_num": 4}))
    )
    cusp = len(there_and_back) // 2
    assert (humble[:cusp] == jazzy[:cusp]).all()
    unrefined = simple("humble", do_refinement=False).smooth(FREE, there_and_back).path
    assert (humble[cusp:, :2] == unrefined[cusp:, :2]).all()


def test_a_smoothing_stops_before_the_first_collision_and_humble_leaves_the_rest():
    blocked = path_of((2.0, 2.0), (5.0, 2.0), (5.0, 5.0), (5.0, 2.0), (2.0, 2.0))
    costs = np.zeros((100, 100), np.uint8)
    costs[21, 49] = 254
    obstacle = Costmap(costs, 0.1, 0.0, 0.0)
    made = {release: simple(release).smooth(obstacle, blocked) for release in RELEASES}
    assert [one.was_completed for one in made.values()] == [False, True, True]
    cusp = len(blocked) // 2
    assert (made["humble"].path[cusp:] == blocked[cusp:]).all()
    assert not (made["jazzy"].path[cusp:] == blocked[cusp:]).all()


@pytest.mark.parametrize(("release", "shortest"), [("humble", 10), ("jazzy", 10), ("lyrical", 4)])
def test_short_paths_stay_as_they_are(release, shortest):
    for steps, smoothed in ((shortest - 1, False), (shortest, True)):
        bend = np.column_stack([np.linspace(2.0, 3.0, steps + 1), 2.0 + np.arange(steps + 1) % 2 * 0.01])
        path = np.column_stack([bend, np.zeros(steps + 1)])
        made = simple(release).smooth(FREE, path).path
        assert ((made != path).any()) == smoothed
    for few in (1, 2, 3):
        assert (simple(release).smooth(FREE, CORNER[:few]).path == CORNER[:few]).all()
        assert (golay(release).smooth(FREE, CORNER[:few]).path == CORNER[:few]).all()


def test_cusps_stay_unless_lyrical_is_told_to_smooth_them():
    cusp = path_of((2.0, 2.0), (4.0, 2.0), (2.0, 2.2))
    tip = int(np.argmax(cusp[:, 0]))
    for make in (simple, golay):
        for release in RELEASES:
            assert (make(release).smooth(FREE, cusp).path[tip, :2] == cusp[tip, :2]).all()
        over = make("lyrical", enforce_path_inversion=False).smooth(FREE, cusp).path
        assert over[tip, 0] < 4.0


def test_a_path_whose_headings_point_back_is_driven_backwards():
    """Nav2's NavFn leaves all headings at 0, so that a path to the west becomes a path in reverse."""
    west = path_of((5.0, 2.0), (2.0, 2.0))
    assert simple("jazzy").smooth(FREE, west).path[:-1, 2] == pytest.approx(0.0)
    west[:, 2] = np.pi
    assert np.abs(simple("jazzy").smooth(FREE, west).path[:-1, 2]) == pytest.approx(np.pi)


def test_older_windows_are_a_cubic_through_seven_points():
    assert golay("lyrical").coefficients == pytest.approx(golay("jazzy").coefficients)
    assert golay("lyrical", window_size=5, poly_order=2).coefficients == pytest.approx(
        np.array([-3.0, 12.0, 17.0, 12.0, -3.0]) / 35.0
    )


@pytest.mark.parametrize(
    ("name", "params", "why"),
    [
        ("simple", {"refinement_num": 2}, "Nav2 Humble has no such parameter: a path is refined 4 times"),
        ("simple", {"release": "jazzy", "enforce_path_inversion": True}, "Nav2 Jazzy has no such parameter"),
        ("simple", {"w_smoth": 0.1}, "did you mean 'w_smooth'"),
        ("savitzky_golay", {"release": "jazzy", "window_size": 9}, "the window has 7 points"),
        ("savitzky_golay", {"release": "lyrical", "window_size": 8}, "expected an odd number of 3 or more, got 8"),
        ("savitzky_golay", {"release": "lyrical", "poly_order": 7}, "expected less than window_size 7, got 7"),
        ("simpel", {}, "unknown smoother 'simpel'; did you mean 'simple'"),
    ],
)
def test_wrong_options_are_refused(name, params, why):
    with pytest.raises(ConfigError, match=why):
        make_smoother(name, **params)


class Clumsy:
    """A third party's smoother that changes what it is given."""

    def smooth(self, costmap, path):
        costmap.costs[:] = 254
        path[:, 2] = 1.0
        return path, 1


class Failing:
    """A third party's smoother that fails."""

    def smooth(self, costmap, path):
        raise KeyError("no spline")


class Flat:
    """A third party's smoother that loses the yaws."""

    def smooth(self, costmap, path):
        return Smoothed(path[:, :2])


class Planless:
    """No smoother at all."""


def test_third_parties_smoothers_get_copies_and_are_blamed_by_name():
    made = make_smoother(f"{__name__}:Clumsy").smooth(FREE, CORNER)
    assert made == Smoothed(made.path, True)
    assert (made.path[:, 2] == 1.0).all()
    assert not FREE.costs.any()
    assert not CORNER[:, 2].any()
    with pytest.raises(PluginError, match=r"smoother '.*:Failing': KeyError: 'no spline', test_smoothers\.py line"):
        make_smoother(f"{__name__}:Failing").smooth(FREE, CORNER)
    with pytest.raises(PluginError, match=r"^smoother '.*:Flat': expected a path of \(n, 3\) finite numbers"):
        make_smoother(f"{__name__}:Flat").smooth(FREE, CORNER)
    with pytest.raises(ConfigError, match="expected one with 'smooth', got a Planless"):
        make_smoother(f"{__name__}:Planless")
    assert set(SMOOTHERS.built_in) == {"simple", "savitzky_golay"}
