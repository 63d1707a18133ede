"""Plain twins of the kernels of noise: odometry, localisation, errors with a time constant, and ranges."""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.frames import count_motion
from gym_mapbench.world.frames import compose, relate
from gym_mapbench.world.localisation import ODOM_SHIFT
from gym_mapbench.world.scenario import Pose, wrap_angle


class PlainWander:
    """An Ornstein-Uhlenbeck process, number by number."""

    def __init__(self, deviations, time_constant, period, rng):
        self.is_on, self.deviations, self.rng = any(deviations), deviations, rng
        self.kept = math.exp(-period / time_constant) if time_constant else 0.0
        self.fresh = math.sqrt(1.0 - self.kept**2)
        self.values = [rng.standard_normal() if self.is_on else 0.0 for _ in deviations]

    def advance(self):
        errors = [deviation * value for deviation, value in zip(self.deviations, self.values, strict=True)]
        if self.is_on:
            self.values = [self.kept * value + self.fresh * self.rng.standard_normal() for value in self.values]
        return errors


class PlainEstimator:
    """The estimates of wheels and localisation, one after the other."""

    def __init__(self, noise, start, period, streams):
        self.noise, self.true = noise, start
        x, y, turn = streams.odom_frame.uniform(-1.0, 1.0, 3).tolist()
        there = Pose(ODOM_SHIFT * x, ODOM_SHIFT * y, wrap_angle(math.pi * turn))
        self.shift = relate(start, there) if noise.odom_frame == "random" else None
        self.odom = self.shifted(start)
        spread = noise.odometry_distance, noise.odometry_turn, noise.odometry_veer
        self.drift = [s * streams.odometry.standard_normal() for s in spread] if noise.drifts else None
        self.error = PlainWander(
            (noise.pose_xy, noise.pose_xy, noise.pose_yaw), noise.pose_time_constant, period, streams.localisation
        )
        self.jitter = PlainWander((noise.odometry_v, noise.odometry_w), 0.0, period, streams.velocity)
        self.corrected_at = self.odom_in_map = None

    def shifted(self, true):
        return true if self.shift is None else compose(self.shift, true)

    def advance(self, true, velocity):
        self.odom = self.shifted(true) if self.drift is None else self.count(true)
        self.true = true
        estimate = self.localise(true, self.error.advance())
        return [*estimate, *self.odom, *self.measure(*velocity, *self.jitter.advance())]

    def count(self, true):
        return Pose(*count_motion(tuple(self.true), tuple(true), tuple(self.odom), *self.drift))

    def localise(self, true, error):
        if not self.error.is_on and self.drift is None:
            return true
        if self.corrected_at is None or self.has_moved():
            self.corrected_at = self.odom
            seen = Pose(true.x + error[0], true.y + error[1], wrap_angle(true.yaw + error[2]))
            self.odom_in_map = relate(self.odom, seen)
        return compose(self.odom_in_map, self.odom)

    def has_moved(self):
        dx, dy, turn = (now - before for now, before in zip(self.odom, self.corrected_at, strict=True))
        return max(abs(dx), abs(dy)) > self.noise.update_min_d or abs(wrap_angle(turn)) > self.noise.update_min_a

    def measure(self, v, w, error_v, error_w):
        if self.drift is not None:
            distance, turn, veer = self.drift
            v, w = v * (1 + distance), w * (1 + turn) + v * veer
        return (v + error_v, w + error_w) if self.jitter.is_on else (v, w)


def plain_report(ranges, normals, lost, deviation, relative, range_min, range_max, no_range):
    """What a scanner reports, array by array."""
    if len(normals):
        spread = np.float32(deviation)
        if relative:
            spread = np.hypot(spread, np.float32(relative) * ranges)
        noisy = np.clip(ranges + spread * normals, np.float32(0.0), np.float32(range_max))
        ranges = np.where(ranges < range_max, noisy, ranges)
    unread = ranges < np.float32(range_min)
    if len(lost):
        unread |= lost
    return np.where(unread, np.float32(no_range), ranges)
