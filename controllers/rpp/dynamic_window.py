"""The command of Regulated Pure Pursuit within the limits of speed and acceleration (Lyrical).

A window is ``(lowest v, highest v, lowest omega, highest omega)``, m/s and rad/s.

Source: nav2_regulated_pure_pursuit_controller (Lyrical): dynamic_window_pure_pursuit_functions.hpp.
"""

from __future__ import annotations

import math

from gym_mapbench.kernels.jit import kernel

STANDING = 1e-3
"""Speeds up to this count as 0, m/s and rad/s."""
STRAIGHT = 1e-3
"""Curvatures below this count as 0, 1/m."""
SAME_DISTANCE = 1e-3
"""Corners whose distances from the line differ by no more are equally good."""


@kernel
def reachable(current, accel, decel, lowest, highest, period):
    """Lowest and highest speed of one axis after a period, within its limits."""
    if current > STANDING:
        low, high = current + decel * period, current + accel * period
    elif current < -STANDING:
        low, high = current - accel * period, current - decel * period
    else:
        low, high = current - accel * period, current + accel * period
    return max(low, lowest), min(high, highest)


@kernel
def regulated(low, high, speed):
    """Part of a window of speeds between 0 and the regulated speed; its nearest speed if there is none."""
    low, high = max(low, min(0.0, speed)), min(high, max(0.0, speed))
    if high < low:
        return (low, low) if low > 0.0 else (high, high)
    return low, high


@kernel
def straight_command(window, sign):
    """The fastest command, with the turn rate nearest to 0."""
    low, high, left, right = window
    v = high if sign >= 0.0 else low
    if left <= 0.0 <= right:
        return v, 0.0
    return v, left if abs(left) <= abs(right) else right


@kernel
def nearest_corner(window, curvature, sign):
    """The corner of the window nearest to the line of a curvature; of about equally near corners a faster later one.

    As in Nav2 (``computeOptimalVelocityWithinDynamicWindow``), a later corner that is nearer counts by whatever little.
    """
    best_v = best_w = 0.0
    least = math.inf
    for v in (window[0], window[1]):
        for w in (window[2], window[3]):
            away = abs(curvature * v - w) / math.sqrt(curvature * curvature + 1.0)
            if away < least or (abs(away - least) <= SAME_DISTANCE and v * sign > best_v * sign):
                best_v, best_w, least = v, w, away
    return best_v, best_w


@kernel
def command_on_curve(window, curvature, sign):
    """The fastest command of a curvature within the window, else the nearest corner."""
    if abs(curvature) < STRAIGHT:
        return straight_command(window, sign)
    low, high, left, right = window
    found, best_v, best_w = False, 0.0, 0.0
    for v, w in (
        (low, curvature * low),
        (high, curvature * high),
        (left / curvature, left),
        (right / curvature, right),
    ):
        if low <= v <= high and left <= w <= right and (not found or v * sign > best_v * sign):
            found, best_v, best_w = True, v, w
    if found:
        return best_v, best_w
    return nearest_corner(window, curvature, sign)


@kernel
def window_command(speed, curvature, last_v, last_w, tuning):
    """Command ``(v, w)`` for a regulated speed (m/s) on a curvature (1/m), reachable from the last command."""
    period, top = tuning.control_period, tuning.desired_linear_vel
    low, high = reachable(last_v, tuning.max_linear_accel, tuning.max_linear_decel, tuning.min_linear_vel, top, period)
    left, right = reachable(
        last_w, tuning.max_angular_accel, tuning.max_angular_decel, tuning.min_angular_vel, tuning.max_angular_vel,
        period,
    )  # fmt: skip
    low, high = regulated(low, high, speed)
    return command_on_curve((low, high, left, right), curvature, 1.0 if speed >= 0.0 else -1.0)
