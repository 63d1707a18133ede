"""Motifs along a route: maps with few genes, which all elements share, and small deviations of single elements.

A motif is one file with a subclass of :class:`Motif`. Its genes are ranges; :meth:`Motif.walls` says which cells around
an element are walls. :class:`AlongRoute` puts elements along a route and builds the map.
"""

from __future__ import annotations

from gym_mapbench.generator.motifs.along_route import USUAL_WIDTH, AlongRoute, places
from gym_mapbench.generator.motifs.around import Around
from gym_mapbench.generator.motifs.genes import MotifGenes, Section
from gym_mapbench.generator.motifs.motif import Motif, Values
from gym_mapbench.generator.motifs.registry import MOTIFS
from gym_mapbench.generator.motifs.routes import Route, legs_of
from gym_mapbench.generator.motifs.sequences import Sequences

__all__ = [
    "MOTIFS",
    "USUAL_WIDTH",
    "AlongRoute",
    "Around",
    "Motif",
    "MotifGenes",
    "Route",
    "Section",
    "Sequences",
    "Values",
    "legs_of",
    "places",
]
