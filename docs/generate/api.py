"""The Python API: for each face, what its ``__all__`` lists, through mkdocstrings."""

from __future__ import annotations

from importlib import import_module

FACE = """::: {module}
    options:
      show_root_heading: true
      show_root_full_path: true
      heading_level: 2
      members: {members}
"""


def face(module: str) -> str:
    """Return the directive for one module."""
    return FACE.format(module=module, members=list(import_module(module).__all__))
