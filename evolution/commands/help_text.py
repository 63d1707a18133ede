"""How the help of a command is laid out: as wide as the terminal, and no word is cut."""

from __future__ import annotations

import argparse
import textwrap
from collections.abc import Iterator


class HelpText(argparse.RawDescriptionHelpFormatter):
    """Fills sentences; an example that is too long goes on below, where a shell still reads it.

    An example is a line that begins with two spaces; what it shows may stand behind it, after two spaces or more.
    """

    def _split_lines(self, text: str, width: int) -> list[str]:
        """Break the help of an option at spaces only, so that names with a hyphen stay whole."""
        return textwrap.wrap(text, width, break_on_hyphens=False)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        """Lay out a description or the examples."""
        return "\n".join(part for line in text.splitlines() for part in _broken(line, width) or [""])


def _broken(line: str, width: int) -> list[str]:
    """Break a line that is too long."""
    if len(line) <= width:
        return [line]
    return list(_example(line, width)) if line.startswith("  ") else textwrap.wrap(line, width, break_on_hyphens=False)


def _example(line: str, width: int) -> Iterator[str]:
    command, _, about = line.strip().partition("  ")
    *begun, last = textwrap.wrap(
        command,
        width - len(r" \ "),
        initial_indent="  ",
        subsequent_indent=" " * 6,
        break_long_words=False,
        break_on_hyphens=False,
    )
    yield from (rf"{part} \ ".rstrip() for part in begun)
    yield last
    yield from textwrap.wrap(about.strip(), width, initial_indent=" " * 6, subsequent_indent=" " * 6)
