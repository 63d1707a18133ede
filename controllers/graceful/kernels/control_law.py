"""The smooth control law: a curve that ends at a target pose, and the speed on it.

The law is that of Park and Kuipers, "A smooth control law for graceful motion of differential wheeled mobile robots in
2D environment" (ICRA 2011). A pose is ``(x, y, yaw)`` in m and rad; ``tuning`` is one record of
:data:`controllers.graceful.controller.TUNING`.

Source: nav2_graceful_controller: src/smooth_control_law.cpp and ego_polar_coords.hpp (Humble and Jazzy).
"""

from __future__ import annotations

import math

import numpy as np

from gym_mapbench.kernels.geometry import normalize_angle
from gym_mapbench.kernels.jit import kernel


@kernel
def egocentric(pose, target, backward):
    """Distance of the target (m), its heading and the robot's, both against the line of sight (rad).

    It is computed in single precision, as in Nav2.
    """
    dx, dy = np.float32(target[0] - pose[0]), np.float32(target[1] - pose[1])
    sight = np.float32(math.atan2(-dy, dx))
    if backward:
        sight = np.float32(np.float64(sight) + math.pi)
    phi = np.float32(normalize_angle(target[2] + np.float64(sight)))
    delta = np.float32(normalize_angle(pose[2] + np.float64(sight)))
    distance = np.float32(math.sqrt(dx * dx + dy * dy))
    return np.float64(distance), np.float64(phi), np.float64(delta)


@kernel
def curvature_to(distance, phi, delta, tuning):
    """Curvature (1/m) that turns the robot onto the curve which ends at the target; 0 once there."""
    if distance == 0.0:
        return 0.0
    steering = tuning.k_delta * (delta - math.atan(-tuning.k_phi * phi))
    slope = tuning.k_phi / (1.0 + (tuning.k_phi * phi) ** 2)
    return -(steering + (1.0 + slope) * math.sin(delta)) / distance


@kernel
def law_command(pose, target, backward, tuning):
    """Command ``(v, w)``: slower on a curve and near the target; a limited turn rate keeps the curve.

    With ``can_stop`` (Lyrical) the robot can stop at the target.
    """
    distance, phi, delta = egocentric(pose, target, backward)
    curvature = curvature_to(distance, phi, delta, tuning)
    top = tuning.v_linear_max
    on_curve = top / (1.0 + tuning.beta * abs(curvature) ** tuning.sharpness)
    speed = min(top * (distance / tuning.slowdown_radius), on_curve)
    if tuning.can_stop:
        speed = min(speed, math.sqrt(2.0 * distance * tuning.deceleration_max))
    speed = min(max(speed, tuning.v_linear_min), top)
    if backward:
        speed, curvature = -speed, -curvature
    turn_rate = min(max(curvature * speed, -tuning.v_angular_max), tuning.v_angular_max)
    return turn_rate / curvature if curvature != 0.0 else speed, turn_rate


@kernel
def turn_command(angle, tuning):
    """Turn rate (rad/s) on the spot by an angle (rad)."""
    rate = tuning.rotation_scaling_factor * angle * tuning.v_angular_max
    return math.copysign(max(abs(rate), tuning.v_angular_min_in_place), rate)


@kernel
def move(pose, v, w, dt):
    """Pose after ``dt`` seconds of a command: straight on along the old heading, then turned."""
    x, y, yaw = pose
    return x + v * dt * math.cos(yaw), y + v * dt * math.sin(yaw), normalize_angle(yaw + w * dt)
