from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gym_mapbench.kernels.bodies import meets
from gym_mapbench.world.proximity import Proximity
from gym_mapbench.world.robot import ROBOTS

DISC, POLYGON = ROBOTS["turtlebot3_waffle"], ROBOTS["jackal"]
SEEDS = st.integers(0, 2**32 - 1)


def sample_bodies(rng, count):
    """Return poses and radii of bodies, near and far; a radius of 0 is no body."""
    poses = rng.normal(0.0, rng.choice([0.3, 2.0, 50.0]), (count, 3))
    return poses, rng.uniform(0.05, 0.8, count) * (rng.random(count) > 0.2)


@given(seed=SEEDS, count=st.integers(0, 12))
def test_the_gap_of_a_disc_is_the_least_of_all_gaps(seed, count):
    rng = np.random.default_rng(seed)
    (poses, radii), state = sample_bodies(rng, count), rng.normal(0.0, 1.0, 3)
    pairs = zip(poses.tolist(), radii.tolist(), strict=True)
    gaps = [math.hypot(x - state[0], y - state[1]) - DISC.radius - r for (x, y, _), r in pairs if r > 0]
    assert Proximity(DISC).gap(state, poses, radii) == pytest.approx(min(gaps, default=math.inf), abs=1e-12)


@pytest.mark.parametrize("robot", [DISC, POLYGON])
@given(seed=SEEDS)
def test_one_robot_and_many_have_the_same_gaps(robot, seed):
    rng, proximity = np.random.default_rng(seed), Proximity(robot)
    worlds = [(rng.normal(0.0, 1.0, 3), *sample_bodies(rng, 5)) for _ in range(3)]
    together = proximity.gaps(*(np.stack(rows) for rows in zip(*worlds, strict=True)))
    assert together.tolist() == [proximity.gap(*world) for world in worlds]


def bodies_met(poses, radii, reach):
    return np.array([meets(pose, radius, 0.0, 0.0, reach) for pose, radius in zip(poses, radii, strict=True)])


@given(seed=SEEDS, reach=st.floats(0.0, 5.0))
def test_bodies_within_reach_are_met(seed, reach):
    poses, radii = sample_bodies(np.random.default_rng(seed), 10)
    away = np.array([math.hypot(x, y) for x, y, _ in poses.tolist()]) - radii
    sure = np.abs(away - reach) > 1e-12
    assert np.array_equal(bodies_met(poses, radii, reach)[sure], ((away <= reach) & (radii > 0))[sure])


def test_a_body_exactly_within_reach_is_met():
    poses, radii = np.array([[2.0, 0.0, 0.0], [2.0 + 1e-9, 0.0, 0.0]]), np.array([0.5, 0.5])
    assert bodies_met(poses, radii, 1.5).tolist() == [True, False]
