"""Thoughts: what DWB, MPPI and RPP considered in their last cycle, placed in the map."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from controllers.dwb.controller import DwbFollower
from controllers.mppi.controller import MppiFollower
from controllers.navigator.navigator import Navigator
from controllers.rpp.controller import RppFollower
from evolution.play.messages.replies import Candidate, DwbThoughts, MppiThoughts, RppThoughts, Thoughts
from evolution.play.messages.requests import Point
from gym_mapbench.world.frames import compose, transform_path
from gym_mapbench.world.scenario import Pose

MAX_SAMPLES = 80
"""Most trajectories of MPPI that are sent."""


def thoughts_of(navigator: Navigator, frame: Pose) -> Thoughts | None:
    """Return what the path follower of a navigator considered in its last cycle; None if it does not say.

    Args:
        navigator: The navigator, after the cycle.
        frame: Pose of the local costmap's frame in the map.
    """
    follower = navigator.follower
    if isinstance(follower, DwbFollower):
        return _of_dwb(follower, frame)
    if isinstance(follower, MppiFollower):
        return _of_mppi(follower, frame)
    if isinstance(follower, RppFollower):
        return _of_rpp(follower, navigator, frame)
    return None


def _of_dwb(follower: DwbFollower, frame: Pose) -> DwbThoughts:
    judged = follower.last_evaluation()
    shares = judged.scales * judged.raw_scores
    return DwbThoughts(
        critics=list(judged.critics),
        candidates=[
            Candidate(
                linear=float(v),
                angular=float(w),
                score=float(judged.totals[number]) if refused < 0 else None,
                shares=shares[number].tolist() if refused < 0 else [],
                refused=judged.critics[refused] if refused >= 0 else "",
                points=_placed(follower.trajectory(number), frame),
            )
            for number, ((v, w), refused) in enumerate(zip(judged.velocities, judged.illegal_by.tolist(), strict=True))
        ],
        chosen=judged.best if judged.best >= 0 else None,
    )


def _of_mppi(follower: MppiFollower, frame: Pose) -> MppiThoughts | None:
    samples = follower.last_samples(MAX_SAMPLES)
    if samples is None:
        return None
    return MppiThoughts(
        samples=[_placed(one, frame) for one in samples.points],
        costs=samples.costs.tolist(),
        chosen=_placed(samples.chosen, frame),
    )


def _of_rpp(follower: RppFollower, navigator: Navigator, frame: Pose) -> RppThoughts | None:
    """Return RPP's carrot; None where it has none."""
    x, y = follower.carrot
    if not math.isfinite(x + y):
        return None
    distance = math.hypot(x, y)
    carrot = compose(navigator.seen_costmap.estimate, Pose(x, y))
    return RppThoughts(
        carrot=(carrot.x, carrot.y),
        lookahead=distance,
        curvature=2.0 * y / distance**2 if distance else 0.0,
        desired=follower.params.desired_linear_vel,
    )


def _placed(places: NDArray[np.floating], frame: Pose) -> list[Point]:
    """Return places of the local costmap's frame in the map, to the millimetre."""
    poses = np.zeros((len(places), 3))
    poses[:, :2] = places[:, :2]
    return [(x, y) for x, y in np.round(transform_path(frame, poses)[:, :2], 3).tolist()]
