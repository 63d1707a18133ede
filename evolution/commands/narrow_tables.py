"""Tables that are wider than the terminal: which columns stand side by side, and how wide each is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import takewhile
from typing import Literal

from rich.cells import cell_len

from gym_mapbench.errors import visible

MOST_KEYS = 2
"""Largest number of columns that say what a row is about, such as map and controller."""


@dataclass(frozen=True)
class Column:
    """A column of a table.

    Args:
        name: Its name.
        cells: Its texts, at least one.
        numeric: Whether they are numbers.
        whole: Whether its texts stay on one line.
    """

    name: str
    cells: Sequence[str]
    numeric: bool = False
    whole: bool = False

    @property
    def justify(self) -> Literal["left", "right"]:
        """Side to which the texts are aligned."""
        return "right" if self.numeric else "left"

    @property
    def heading(self) -> str:
        """The name, in several lines if it is wider than the cells."""
        longest = max(map(len, self.cells))
        return self.name.replace(" ", "\n").replace("_", "_\n") if len(self.name) > longest else self.name

    @property
    def widest(self) -> int:
        """Width at which no text goes on below."""
        return _longest(self.heading.split("\n") + [line for text in self.cells for line in text.split("\n")])

    @property
    def narrowest(self) -> int:
        """Least width at which no word is broken."""
        texts = [self.heading, *self.cells]
        return self.widest if self.whole else _longest([word for text in texts for word in text.split()])


def _longest(texts: Sequence[str]) -> int:
    return max((cell_len(visible(text)) for text in texts), default=0)


def blocks_within(columns: Sequence[Column], width: int) -> list[list[Column]]:
    """Return the columns in blocks that fit a width without broken words; the first of text begin each block."""
    keys = list(takewhile(lambda column: not column.numeric, columns[:MOST_KEYS]))
    blocks = [keys]
    for column in columns[len(keys) :]:
        beside = [*blocks[-1], column]
        if sum(one.narrowest + 1 for one in beside) - 1 > width and len(blocks[-1]) > len(keys):
            beside = [*keys, column]
            blocks.append(beside)
        blocks[-1] = beside
    return blocks


def widths_within(columns: Sequence[Column], width: int) -> list[int]:
    """Return the widths of columns with a space between them.

    Until all fit, the widest of those whose words stay whole gives way, or the widest of all if there is none.
    """
    widths, least = [one.widest for one in columns], [one.narrowest for one in columns]
    while sum(widths) + len(widths) - 1 > width and max(widths) > 1:
        able = [place for place, wide in enumerate(widths) if wide > least[place]] or range(len(widths))
        widths[max(able, key=lambda place: widths[place])] -= 1
    return widths
