"""The motifs by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.motifs.baffles import Baffles
from gym_mapbench.generator.motifs.bends import Bends
from gym_mapbench.generator.motifs.dead_ends import DeadEnds
from gym_mapbench.generator.motifs.gates import Gates
from gym_mapbench.generator.motifs.motif import Motif
from gym_mapbench.generator.motifs.passages import Passages
from gym_mapbench.generator.motifs.pillar_rows import PillarRows
from gym_mapbench.registry import Registry

OWN: dict[str, Callable[..., Motif]] = {
    "gates": Gates,
    "baffles": Baffles,
    "pillar_rows": PillarRows,
    "dead_ends": DeadEnds,
    "passages": Passages,
    "bends": Bends,
}


def _motif(entry: Any) -> Callable[..., Motif]:
    """Accept a subclass of Motif."""
    if not (isinstance(entry, type) and issubclass(entry, Motif)):
        raise ConfigError(f"expected a subclass of Motif, got {entry!r:.80}")
    return entry


MOTIFS: Registry[Callable[..., Motif]] = Registry("motif", "motifs", OWN, check=_motif)
"""The motifs by name; each is a family of its own, and a part of sequences."""
