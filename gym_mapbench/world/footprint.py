"""Footprint: the padded polygon that stands for the robot in Nav2's costmaps and controllers.

Source: nav2_costmap_2d/src/footprint.cpp.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

CIRCLE_CORNERS = 16


@dataclass(frozen=True)
class Footprint:
    """A padded footprint polygon in the robot frame.

    Args:
        corners: ``(n, 2)`` float64, m.
        inscribed_radius: Smallest distance of the outline from (0, 0), m.
        circumscribed_radius: Largest distance of the outline from (0, 0), m.
        use_radius: Whether the robot is a disc; the cost at its centre then tells whether it collides.
    """

    corners: NDArray[np.float64]
    inscribed_radius: float
    circumscribed_radius: float
    use_radius: bool = False

    @classmethod
    def from_radius(cls, radius: float, padding: float = 0.01) -> Footprint:
        """Nav2's stand-in for a disc: a 16-gon with its corners at ``radius`` (m), then padded."""
        angles = np.arange(CIRCLE_CORNERS) * 2 * np.pi / CIRCLE_CORNERS
        polygon = cls.from_corners(radius * np.stack([np.cos(angles), np.sin(angles)], axis=1), padding)
        return replace(polygon, use_radius=True)

    @classmethod
    def from_corners(cls, corners: NDArray[np.float64], padding: float = 0.01) -> Footprint:
        """Pad a polygon, ``(n, 2)`` m: every corner moves away from both axes by ``padding`` (m)."""
        corners = np.asarray(corners, dtype=np.float64)
        padded = corners + np.sign(corners) * float(np.float32(padding))  # footprint_padding is a float in Nav2
        padded.flags.writeable = False
        edges = np.roll(padded, -1, axis=0) - padded
        squared = (edges**2).sum(axis=1)
        # A corner may stand twice, as where a polygon is closed by its first corner.
        along = np.clip(-(padded * edges).sum(axis=1) / np.where(squared > 0.0, squared, 1.0), 0.0, 1.0)
        nearest = np.hypot(*(padded + along[:, None] * edges).T)
        at_corners = np.hypot(*padded.T)
        return cls(padded, float(min(nearest.min(), at_corners.min())), float(max(nearest.max(), at_corners.max())))
