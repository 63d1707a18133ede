"""One step of Nav2's velocity smoother.

Source: nav2_velocity_smoother (Humble and Jazzy) src/velocity_smoother.cpp.
"""

from __future__ import annotations

from gym_mapbench.kernels.jit import kernel

LOWEST, HIGHEST, SPEEDING_UP, SLOWING_DOWN = range(4)
"""Columns of the limits: lowest and highest velocity, and the largest change in one step."""


@kernel
def smooth(v, w, wanted_v, wanted_w, limits, scales):
    """Velocity after one step towards a wanted velocity.

    Args:
        v: Forward speed before the step, m/s.
        w: Turn rate before the step, rad/s.
        wanted_v: Wanted forward speed, m/s.
        wanted_w: Wanted turn rate, rad/s.
        limits: ``(2, 4)`` limits of forward speed (m/s) and turn rate (rad/s), one row each.
        scales: Whether both are slowed by the ratio of the more restricted one.

    Returns:
        Forward speed (m/s) and turn rate (rad/s).
    """
    change_v, limit_v = wanted_change(v, wanted_v, limits[0])
    change_w, limit_w = wanted_change(w, wanted_w, limits[1])
    ratio = min(ratio_within(change_v, limit_v), ratio_within(change_w, limit_w)) if scales else 1.0
    return v + clamp(ratio * change_v, limit_v), w + clamp(ratio * change_w, limit_w)


@kernel
def wanted_change(current, wanted, limits):
    """Change of one component towards its wanted value, and the largest change in one step."""
    wanted = min(max(wanted, limits[LOWEST]), limits[HIGHEST])
    speeds_up = abs(wanted) >= abs(current) and current * wanted >= 0.0
    return wanted - current, limits[SPEEDING_UP] if speeds_up else limits[SLOWING_DOWN]


@kernel
def ratio_within(change, limit):
    """Ratio that keeps a change within its limit, 1 if it is within or there is no limit above 0."""
    return limit / abs(change) if abs(change) > limit > 0.0 else 1.0


@kernel
def clamp(change, limit):
    """Limit a change to ``limit`` in both directions."""
    return min(max(change, -limit), limit)
