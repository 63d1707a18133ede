"""Inserts: the parts of a page that come from the code.

A line ``<!-- insert NAME ARGUMENT ... -->`` of a page is replaced by the return value of the function of this
name when the site is built. It is invisible in the file itself.
"""

from __future__ import annotations

import re
from collections.abc import Callable

from docs.generate.api import face
from docs.generate.commands import command_reference
from docs.generate.environment import environment_tables
from docs.generate.fidelity import measures_of
from docs.generate.files import files_of
from docs.generate.gallery import kept_times
from docs.generate.motifs import motif_genes
from docs.generate.names import contents_of, names_of
from docs.generate.options import (
    family_reference,
    layer_reference,
    motion_reference,
    option_reference,
    planner_reference,
    smoother_reference,
)
from docs.generate.thesis_tables import thesis_sizes, thesis_speeds, thesis_times

LINE = re.compile(r"^<!-- insert (\w+)((?: [\w.-]+)*) -->$", re.MULTILINE)

INSERTS: dict[str, Callable[..., str]] = {
    "commands": command_reference,
    "options": option_reference,
    "family_options": family_reference,
    "planner_options": planner_reference,
    "smoother_options": smoother_reference,
    "layer_options": layer_reference,
    "names": names_of,
    "contents": contents_of,
    "files": files_of,
    "environment": environment_tables,
    "motion_options": motion_reference,
    "measures": measures_of,
    "motif_genes": motif_genes,
    "kept_times": kept_times,
    "face": face,
    "thesis_sizes": thesis_sizes,
    "thesis_times": thesis_times,
    "thesis_speeds": thesis_speeds,
}
"""The functions by name; each takes the arguments of the line, and returns Markdown."""


def filled(markdown: str) -> str:
    """Return the text of a page with every insert in its place."""
    return LINE.sub(lambda found: INSERTS[found[1]](*found[2].split()), markdown)
