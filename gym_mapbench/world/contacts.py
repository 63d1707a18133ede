"""Contacts with bodies: whose they are. A contact while the robot stands still is the body's."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

STANDS = 0.01
"""Largest speed that counts as standing still, m/s and rad/s."""


def stands_still(velocities: ArrayLike) -> NDArray[np.bool_]:
    """Return whether a robot stands still, at velocities ``(..., 2)`` m/s and rad/s.

    A contact is the body's if the robot stood still at the beginning of the control step in which it is felt.
    """
    stands: NDArray[np.bool_] = np.abs(velocities).max(axis=-1) <= STANDS
    return stands
