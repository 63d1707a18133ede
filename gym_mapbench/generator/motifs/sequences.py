"""Sequences: several motifs, one after the other, along one route."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from pydantic import Field, JsonValue, model_validator

from gym_mapbench.errors import ConfigError
from gym_mapbench.generator.motifs.along_route import AlongRoute
from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.genes import Section
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.motifs.registry import MOTIFS
from gym_mapbench.generator.ranges import CountRange, sample_count
from gym_mapbench.generator.shapes import Cells

MotifOptions = dict[str, JsonValue]


def _short_sections() -> dict[str, MotifOptions]:
    """Return all motifs of the project, with one or two elements."""
    return {name: {"count": [1, 2]} for name in MOTIFS.built_in}


class Sequences(AlongRoute):
    """Sections of different motifs, one after the other.

    ::

        ##################
        # G              #
        #  ##  ##  ##  ###
        #                #
        #                #
        ######## #########
        #                #
        ########### ######
        #              S #
        ##################

    Args:
        motifs: Motifs that sections are sampled from, by name, each with the options that differ from its own.
        sections: Range of the number of sections.
    """

    motifs: dict[str, MotifOptions] = Field(default_factory=_short_sections, min_length=1)
    sections: CountRange = (2, 3)

    @model_validator(mode="after")
    def _motifs_exist(self) -> Sequences:
        _ = self._made
        return self

    @cached_property
    def _made(self) -> dict[str, Motif]:
        """The motifs by name."""
        return {name: _motif(name, options) for name, options in self.motifs.items()}

    def motif(self, name: str) -> Motif:
        """Return the motif of a section."""
        if name not in self.motifs:
            raise ConfigError(f"motif: expected one of {', '.join(self.motifs)}, got {name!r:.80}")
        return self._made[name]

    def add_walls(self, cells: Cells, motif: str, around: Around, values: Values) -> None:
        """As :meth:`AlongRoute.add_walls`; an error names the motif."""
        with MOTIFS.blamed(motif):
            super().add_walls(cells, motif, around, values)

    def options_for(self, wider: float) -> dict[str, Any]:
        """As :meth:`AlongRoute.options_for`, for every motif."""
        return {
            "motifs": {name: self.motif(name).options_for(wider) | options for name, options in self.motifs.items()}
        }

    def draw_sections(self, rng: np.random.Generator) -> tuple[Section, ...]:
        """Sample the sections of one map."""
        names = tuple(self.motifs)
        drawn = [names[int(rng.integers(len(names)))] for _ in range(sample_count(rng, self.sections))]
        return tuple(self.motif(name).draw_section(rng, name) for name in drawn)


def _motif(name: str, options: MotifOptions) -> Motif:
    """Make a motif of its options."""
    make = MOTIFS.get(name)
    with MOTIFS.blamed(name):
        return make(**options)
