"""Actions: their space, and their conversion to commands."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import ArrayLike, NDArray

from gym_mapbench.errors import ConfigError
from gym_mapbench.world.robot import RobotSpec

if TYPE_CHECKING:
    from gym_mapbench.env.config import EnvConfig

ActionKind = Literal["physical", "normalized"]
"""What actions are: m/s and rad/s, or shares of the robot's limits."""


def action_space(config: EnvConfig) -> spaces.Box:
    """Return the space of ``(v, omega)``: the robot's limits in m/s and rad/s, or -1 to 1 where normalised."""
    robot = config.robot
    if config.action == "normalized":
        return spaces.Box(-1.0, 1.0, (2,), np.float32)
    low = np.array([-robot.max_reverse_velocity, -robot.max_angular_velocity], dtype=np.float32)
    high = np.array([robot.max_linear_velocity, robot.max_angular_velocity], dtype=np.float32)
    return spaces.Box(low, high, dtype=np.float32)


def to_command(action: ArrayLike, robot: RobotSpec, kind: ActionKind) -> tuple[float, float]:
    """Return the forward speed (m/s) and turn rate (rad/s) an action commands, not yet clipped.

    A normalised action is a share of the robot's limit in its direction, so that 0 means standing still.

    Args:
        action: Two numbers.
        robot: The robot that is to obey.
        kind: What the numbers are.

    Raises:
        ConfigError: If the action is not two finite numbers.
    """
    try:
        values = np.asarray(action, dtype=np.float64)
    except (TypeError, ValueError, RuntimeError):  # the last of a tensor with a gradient
        raise ConfigError(f"action: expected two numbers, got {action!r:.80}") from None
    if values.shape != (2,):
        got = f"shape {values.shape}" if values.ndim else f"{action!r:.80}"
        raise ConfigError(f"action: expected two numbers, got {got}")
    v, w = values.tolist()
    if not (math.isfinite(v) and math.isfinite(w)):
        raise ConfigError(f"action: expected two finite numbers, got ({v}, {w})")
    if kind == "physical":
        return v, w
    return v * (robot.max_linear_velocity if v > 0 else robot.max_reverse_velocity), w * robot.max_angular_velocity


def to_commands(actions: ArrayLike, config: EnvConfig, wanted: NDArray[np.bool_]) -> NDArray[np.float64]:
    """Return what the actions of many worlds command, ``(n, 2)``, as :func:`to_command` does for one.

    Args:
        actions: ``(n, 2)``.
        config: Of all worlds.
        wanted: ``(n,)`` worlds that are stepped; the actions of the others are not checked.

    Raises:
        ConfigError: If the actions are not two finite numbers for every world.
    """
    try:
        commands = np.array(actions, dtype=np.float64)
    except (TypeError, ValueError, RuntimeError):
        raise ConfigError(f"actions: expected two numbers for every world, got {actions!r:.80}") from None
    if commands.shape != (len(wanted), 2):
        raise ConfigError(f"actions: expected shape {(len(wanted), 2)}, got {commands.shape}")
    if not np.isfinite(commands).all() and not np.isfinite(commands[wanted]).all():
        raise ConfigError(f"actions: expected finite numbers, got {commands[wanted].tolist()!r:.80}")
    if config.action == "normalized":
        robot = config.robot
        commands[:, 0] *= np.where(commands[:, 0] > 0, robot.max_linear_velocity, robot.max_reverse_velocity)
        commands[:, 1] *= robot.max_angular_velocity
    return commands
