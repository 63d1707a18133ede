"""Tables: rows with named columns, as text, as CSV, in a notebook, and as a pandas DataFrame."""

from __future__ import annotations

import html
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from statistics import median
from typing import TYPE_CHECKING, Any, overload

from evolution.files.plain import Row, csv_of
from gym_mapbench.errors import refuse_unknown

if TYPE_CHECKING:
    import pandas


SMALL, LARGE = 1e-3, 1e6
"""Numbers below and above are shown with an exponent."""

FAR = 100
"""Numbers that are so many times the median of their column do not decide on its decimals."""

COARSE = 0.05
"""Relative error above which a number does not take the decimals of its column."""


class Table(Sequence[Row]):
    """Rows of one table, each a mapping from column to value; None where a row has no value.

    Args:
        rows: The rows.
        title: Content of the table, in a few words.
    """

    def __init__(self, rows: Iterable[Row], title: str = "") -> None:
        self._rows = list(rows)
        self.title = title

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the columns, in order of their first use."""
        return tuple(dict.fromkeys(name for row in self._rows for name in row))

    @property
    def filled(self) -> tuple[str, ...]:
        """Names of the columns that a reader needs: not those in which every row has an empty text."""
        return tuple(name for name in self.columns if any(row.get(name) != "" for row in self._rows))

    @overload
    def __getitem__(self, index: int) -> Row: ...
    @overload
    def __getitem__(self, index: slice) -> list[Row]: ...
    def __getitem__(self, index: int | slice) -> Row | list[Row]:
        return self._rows[index]

    def __len__(self) -> int:
        return len(self._rows)

    def __iter__(self) -> Iterator[Row]:
        return iter(self._rows)

    def cells(self) -> list[list[str]]:
        """Return every row as readable texts, one per filled column; the numbers of a column have as many decimals."""
        columns = [readable([row.get(name) for row in self._rows]) for name in self.filled]
        return [list(cells) for cells in zip(*columns, strict=True)]

    def numeric(self, column: str) -> bool:
        """Whether a column holds numbers only."""
        values = [row.get(column) for row in self._rows]
        return any(value is not None for value in values) and all(isinstance(v, int | float | None) for v in values)

    def to_csv(self) -> str:
        """Return the table as CSV text."""
        return csv_of(self._rows)

    def to_pandas(self) -> pandas.DataFrame:
        """Return the table as a pandas DataFrame; pandas must be installed."""
        import pandas

        return pandas.DataFrame(self._rows, columns=list(self.columns))

    def __str__(self) -> str:
        lines = [list(self.filled), *self.cells()]
        columns = [
            _aligned(column, right=self.numeric(name))
            for name, column in zip(self.filled, zip(*lines, strict=True), strict=True)
        ]
        title = [self.title] if self.title else []
        return "\n".join([*title, *("  ".join(line).rstrip() for line in zip(*columns, strict=True))])

    __repr__ = __str__

    def _repr_html_(self) -> str:
        """Return the table as a notebook shows it."""
        head = "".join(f"<th>{html.escape(name)}</th>" for name in self.filled)
        body = "".join(
            "<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in cells) + "</tr>" for cells in self.cells()
        )
        caption = f"<caption>{html.escape(self.title)}</caption>" if self.title else ""
        return f"<table>{caption}<thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"


class Tabled(ABC):
    """Results that can be looked at as tables; a notebook shows the first of them."""

    @property
    @abstractmethod
    def tables(self) -> Mapping[str, Callable[[], Table]]:
        """The functions that return the tables, by name; the table to look at comes first."""

    def table(self, name: str = "") -> Table:
        """Return one of the tables.

        Args:
            name: One of :attr:`tables`; empty for the first.

        Raises:
            ConfigError: If there is no such table.
        """
        tables = self.tables
        name = name or next(iter(tables))
        refuse_unknown("table", name, tables)
        return tables[name]()

    def to_pandas(self, name: str = "") -> pandas.DataFrame:
        """Return one of the tables (see :meth:`table`) as a pandas DataFrame; pandas must be installed."""
        return self.table(name).to_pandas()

    def _repr_html_(self) -> str:
        """Return the HTML of the first table, for a notebook."""
        return self.table()._repr_html_()


def counted(count: int, noun: str, plural: str = "") -> str:
    """Return a number with its noun, which is in the plural unless the number is 1.

    Args:
        count: The number.
        noun: The noun in the singular, such as ``held-out seed``.
        plural: The noun in the plural; empty if it only gets an s.
    """
    return f"{count} {noun if count == 1 else plural or f'{noun}s'}"


def readable(values: Sequence[Any]) -> list[str]:
    """Format the values of one column for a reader: numbers with the decimals that four digits of the largest take.

    Decimals that are zero in the whole column are left out, zero has none, and what has no value is a dash. A number
    that is far larger than the others, such as a penalty, does not take their decimals away, and has its own. So has a
    number that the decimals of the column would falsify.
    """
    numbers = [value for value in values if isinstance(value, int | float) and abs(value) < LARGE]
    sizes = [abs(number) for number in numbers if number]
    usual = FAR * median(sizes) if sizes else 0.0
    near = [number for number in numbers if abs(number) <= usual]
    most = _decimals(max(map(abs, near), default=0.0))
    kept = [decimals for decimals in range(most) if all(round(one, decimals) == round(one, most) for one in near)]
    shown = min(kept, default=most)
    return [_text(value, _decimals(abs(value)) if _is_far(value, usual) else shown) for value in values]


def _is_far(value: Any, usual: float) -> bool:
    return isinstance(value, float) and usual < abs(value) < LARGE


def _decimals(size: float) -> int:
    """Return the decimals that four digits of a number take, three at most."""
    return min(3, max(0, 3 - math.floor(math.log10(size)))) if size else 0


def _text(value: Any, decimals: int) -> str:
    """Format a value for a reader."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return "-"
    if not isinstance(value, float):
        return str(value)
    if value != 0 and not SMALL <= abs(value) < LARGE:
        return f"{value:.3g}"
    if value == 0 or abs(round(value, decimals) - value) > COARSE * abs(value):
        return f"{value:.2g}"
    return f"{value:.{decimals}f}"


def _aligned(texts: Sequence[str], *, right: bool) -> list[str]:
    """Pad texts with spaces to the length of the longest."""
    width = max(map(len, texts))
    return [text.rjust(width) if right else text.ljust(width) for text in texts]
