"""Reads docstrings, so that the site need not repeat them by hand."""

from __future__ import annotations

import inspect
import re
import textwrap

ROLE = re.compile(r":(?:\w+:)+`~?(?:[\w.]+\.)?(\w+)`")
ARGS = r"^Args:\n((?:    .*\n|\s*\n)*)"
ARGUMENT = re.compile(r"^(\w+): (.*(?:\n +.*)*)", re.MULTILINE)


def plain(text: str) -> str:
    """Return a docstring as Markdown: references become names in code type, and ``::`` a colon before a block."""
    text = ROLE.sub(r"`\1`", text.replace("``", "`"))
    return re.sub(r"(?m)^::$", "For example:", text).replace("::\n", ":\n")


def summary(entry: object) -> str:
    """Return the first paragraph of a docstring in one line."""
    return plain(" ".join((inspect.getdoc(entry) or "").partition("\n\n")[0].split()))


def arguments(entry: object) -> dict[str, str]:
    """Return the descriptions in the section ``Args`` of a Google docstring, each in one line, by name.

    The descriptions of a class include those of its base classes.
    """
    parts = reversed(entry.__mro__) if isinstance(entry, type) else (entry,)
    found = {}
    for part in parts:
        text = re.search(ARGS, inspect.cleandoc(part.__doc__ or "") + "\n", re.MULTILINE)
        block = textwrap.dedent(text[1]) if text else ""
        found |= {name: plain(" ".join(about.split())) for name, about in ARGUMENT.findall(block)}
    return found


def block_of(entry: object) -> str:
    """Return the first literal block of a docstring: the indented lines after ``::``."""
    found = re.search(r"::\n\n((?:    .*\n|\s*\n)+)", (inspect.getdoc(entry) or "") + "\n")
    return textwrap.dedent(found[1]).strip("\n") if found else ""
