"""Costmaps, potentials and paths against all recorded cases of Nav2's own code."""

from __future__ import annotations

import numpy as np
import pytest

from evolution.validation.setup import footprint_of, make_planner
from gym_mapbench.errors import NoPathError
from gym_mapbench.world.scenario import Pose
from tests.oracle.recordings import LYRICAL, RECORDINGS

STORED = 1e-9  # paths are recorded rounded to this
NEAR = 1e-3  # cells: the target of ``mapbench validate``; Lyrical's paths differ by float32 steps, the cause is unknown


@pytest.fixture(scope="module", params=[*RECORDINGS, LYRICAL])
def recorded(request):
    return request.param


@pytest.fixture(scope="module")
def costmaps(recorded):
    return recorded.costmaps


def plan(recorded, costmap, start):
    try:
        return make_planner(recorded.oracle).plan(costmap, start, recorded.preset.goal)
    except NoPathError:
        return np.empty((0, 3))


def path_error(recorded):
    """Largest difference from a recorded path, m."""
    return NEAR * recorded.preset.resolution if recorded.oracle.release == "lyrical" else STORED


def test_footprint(recorded):
    footprint, plans = footprint_of(recorded.preset), recorded.load("plans")
    assert footprint.inscribed_radius == pytest.approx(float(plans["inscribed_radius"]), abs=1e-9)
    assert footprint.circumscribed_radius == pytest.approx(float(plans["circumscribed_radius"]), abs=1e-9)


def test_costmaps_are_identical(recorded, costmaps):
    plans = recorded.load("plans")
    for map_id, expected in zip(plans["map_id"], plans["costmap"], strict=True):
        assert np.array_equal(costmaps[int(map_id)].costs, expected[::-1])


def test_potentials_are_identical(recorded, costmaps):
    plans, preset = recorded.load("plans"), recorded.preset
    if "potential" not in plans:
        pytest.skip("potentials were not recorded")
    index = {int(map_id): k for k, map_id in enumerate(plans["potential_map_id"])}
    for i, map_id in enumerate(plans["map_id"].tolist()):
        potential = make_planner(recorded.oracle).potential(costmaps[map_id], preset.start, preset.goal)
        reached = np.isfinite(potential)
        assert reached.sum() == plans["pot_n_reached"][i]
        assert potential[reached].max() == plans["pot_max"][i]
        assert potential[reached].mean(dtype=float) == pytest.approx(plans["pot_mean"][i], rel=1e-9)
        if map_id in index:
            expected = plans["potential"][index[map_id]][::-1]
            assert np.array_equal(np.where(reached, potential, np.nan), expected, equal_nan=True)


def test_paths_are_identical(recorded, costmaps):
    plans, error = recorded.load("plans"), path_error(recorded)
    for i, map_id in enumerate(plans["map_id"].tolist()):
        path = plan(recorded, costmaps[map_id], recorded.preset.start)
        expected = plans["path"][plans["path_offset"][i] : plans["path_offset"][i + 1]]
        assert path.shape == expected.shape
        assert bool(plans["found"][i]) == (len(path) > 0)
        assert np.abs(path - expected).max(initial=0) <= error
        if len(path):
            length = np.hypot(*np.diff(path[:, :2], axis=0).T).sum()
            assert length == pytest.approx(plans["path_length"][i], abs=max(1e-6, error))


def test_paths_from_anywhere_are_identical(recorded, costmaps):
    units = recorded.load("units")
    for i, start in enumerate(units["plan_from"]):
        path = plan(recorded, costmaps[int(units["map_id"][i])], Pose(*start))
        expected = units["path"][units["path_offset"][i] : units["path_offset"][i + 1]]
        assert path.shape == expected.shape
        assert np.abs(path - expected).max() <= path_error(recorded)
