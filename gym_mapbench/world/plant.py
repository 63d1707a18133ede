"""Plants: how a robot's wheels follow its commands and hold on the ground, and how its motion is integrated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PlantName = Literal["ideal", "fortress"]


@dataclass(frozen=True)
class Plant:
    """How motion is integrated, and how wheels hold.

    Args:
        hz: Steps of the integration per second; None for one per tick of the physics.
        late: Whether a command takes effect one step after it arrives.
        slips: Whether wheels that slip the same way cannot turn a robot that touches something.
    """

    hz: float | None = None
    late: bool = False
    slips: bool = False

    def substeps(self, tick: float) -> int:
        """Return the steps of the integration in a tick of the physics (s), at least 1."""
        return 1 if self.hz is None else max(1, round(tick * self.hz))


PLANTS: dict[PlantName, Plant] = {
    # The plant of the recorded Nav2 runs.
    "ideal": Plant(),
    # ign-gazebo6: steps of 1 ms; DiffDrive limits the speeds after the step in which a command arrives.
    "fortress": Plant(hz=1000.0, late=True, slips=True),
}
