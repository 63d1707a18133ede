"""Griffe extension: docstrings are written for Python's own help, and become Markdown for the site."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import griffe

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from docs.generate.docstrings import plain


class PlainDocstrings(griffe.Extension):
    """Makes every docstring Markdown."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Change the docstring of a module, class, function or attribute in place."""
        if obj.docstring is not None:
            obj.docstring.value = plain(obj.docstring.value)

    def on_class(self, *, cls: griffe.Class, **_: Any) -> None:
        """Call the arguments of a model attributes where its constructor is not written out."""
        written_out = "__init__" in cls.members or any("dataclass" in str(one.value) for one in cls.decorators)
        if cls.docstring is not None and not written_out:
            cls.docstring.value = cls.docstring.value.replace("Args:\n", "Attributes:\n")
