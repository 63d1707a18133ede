"""Where the seed of every run comes from."""

from __future__ import annotations

import hashlib

ALL_CONTROLLERS = ""
"""Stands for the controller in a seed that all controllers share (common random numbers)."""


def derive_seed(root_seed: int, map_digest: str, controller: str, repeat: int) -> int:
    """Return a seed of 63 bits that depends on these four values and on nothing else.

    A result therefore does not depend on order, chunking, number of workers or machine.

    Args:
        root_seed: Seed of the whole experiment.
        map_digest: :attr:`~gym_mapbench.world.scenario.Scenario.world_digest` of the scenario.
        controller: Name of the controller, or :data:`ALL_CONTROLLERS`.
        repeat: Number of the repetition, from 0.
    """
    text = repr((int(root_seed), str(map_digest), str(controller), int(repeat)))
    return int.from_bytes(hashlib.blake2b(text.encode(), digest_size=8).digest(), "big") >> 1
