"""A controller that prints wherever it can."""

from __future__ import annotations

import time

from tests.evolution.fake_runs import print_everywhere

print_everywhere()


class Talker:
    """Drives ahead."""

    observation_keys = ("goal",)

    def __init__(self) -> None:
        print_everywhere()

    def reset(self, context) -> None:
        print_everywhere()

    def act(self, observation) -> tuple[float, float]:
        print_everywhere()
        return 0.2, 0.0


class Sleeper(Talker):
    """Never answers."""

    def act(self, observation):
        """Sleep."""
        time.sleep(600)
