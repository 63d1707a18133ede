"""The table of the genes of motifs, from the motifs themselves."""

from __future__ import annotations

from docs.generate.docstrings import arguments
from docs.generate.markdown import name, table
from gym_mapbench.generator import MOTIFS, Motif


def motif_genes() -> str:
    """Return a table of the shared genes of all motifs, then of those that a motif has of its own."""
    common = arguments(Motif)
    rows = [["all", *_row("gates", gene)] for gene in MOTIFS["gates"]().ranges if gene in common]
    for key in MOTIFS.built_in:
        rows += [[name(key), *_row(key, gene)] for gene in MOTIFS[key]().ranges if gene not in common]
    return table(["motif", "gene", "what it is", "default range"], rows)


def _row(key: str, gene: str) -> list[str]:
    """Return the name, the description and the range of a gene."""
    motif = MOTIFS[key]()
    low, high = motif.ranges[gene]
    about = arguments(type(motif))[gene].removeprefix("Range of ")
    return [name(gene), about, f"{low:g} to {high:g}"]
