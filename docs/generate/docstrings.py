"""Reads what docstrings say, so that the site repeats none of it by hand."""

from __future__ import annotations

import inspect
import re
import textwrap

ROLE = re.compile(r":(?:\w+:)+`~?(?:[\w.]+\.)?(\w+)`")
SECTION = r"^{name}:\n((?:    .*\n|\s*\n)*)"
ARGUMENT = re.compile(r"^(\w+): (.*(?:\n +.*)*)", re.MULTILINE)


def plain(text: str) -> str:
    """Return a docstring as Markdown: references become names in code type, and ``::`` a colon before a block."""
    text = ROLE.sub(r"`\1`", text.replace("``", "`"))
    return re.sub(r"(?m)^::$", "For example:", text).replace("::\n", ":\n")


def summary(entry: object) -> str:
    """Return the first paragraph of a docstring in one line."""
    return plain(" ".join((inspect.getdoc(entry) or "").partition("\n\n")[0].split()))


def arguments(entry: object, section: str = "Args") -> dict[str, str]:
    """Return the descriptions in the section ``Args`` of a Google docstring, each in one line, by name."""
    found = re.search(SECTION.format(name=section), (inspect.getdoc(entry) or "") + "\n", re.MULTILINE)
    block = textwrap.dedent(found[1]) if found else ""
    return {name: plain(" ".join(text.split())) for name, text in ARGUMENT.findall(block)}


def block_of(entry: object) -> str:
    """Return the first literal block of a docstring: the indented lines after ``::``."""
    found = re.search(r"::\n\n((?:    .*\n|\s*\n)+)", (inspect.getdoc(entry) or "") + "\n")
    return textwrap.dedent(found[1]).strip("\n") if found else ""
