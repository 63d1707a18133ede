"""Renders the content of a report as one HTML file that needs no network."""

from __future__ import annotations

import base64
import io
import re
import shlex
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from pathlib import Path

import jinja2
import numpy as np
from markupsafe import Markup, escape
from PIL import Image

from evolution.files import Row, counted, json_in_script, readable
from evolution.files import Table as Results
from evolution.report.cell_grid import CellGrid
from evolution.report.replays import ReplayedMap, replays_of
from gym_mapbench.errors import ConfigError

_VENDORED = ("vendor/sortable.min.js", "vendor/sortable.a11y.min.js", "vendor/medium-zoom.min.js")
_SCRIPTS = (*_VENDORED, "replay.js", "grid.js", "print.js")
PNG = b"\x89PNG"
MEDIA_TYPES = {".csv": "text/csv", ".json": "application/json", ".yaml": "application/yaml", ".zip": "application/zip"}
"""Media types of downloads by the end of their names."""
NO_VALUE = "-"
"""Text of a cell without a value, as numbers that are not finite show; it sorts last."""
_NUMBER_FIRST = re.compile(r"(-?\d+(?:\.\d+)?(?:e[-+]\d+)?)(?:/\d+| \(.*\))?")
"""A number alone, a count of several, as ``3/12``, or a number with its interval, as ``1.2 (1.1 to 1.3)``."""


@dataclass(frozen=True)
class Table:
    """A sortable table; the numbers of a column have equally many decimals; not finite numbers show as dashes."""

    caption: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str | float | int]]
    note: str = ""

    @property
    def headings(self) -> list[tuple[str, bool]]:
        """The name of every column, and whether it holds numbers."""
        first = self.rows[0] if self.rows else [""] * len(self.columns)
        return [(name, not isinstance(cell, str)) for name, cell in zip(self.columns, first, strict=True)]

    @property
    def shown(self) -> list[tuple[tuple[str | float | int, str, str | None], ...]]:
        """Every cell of every row with the text that is shown for it and its sort key; without one the text is it."""
        columns = zip(*self.rows, strict=True)
        return list(zip(*[zip(one, readable(one), _sort_keys(one), strict=True) for one in columns], strict=True))


def tables_of(caption: str, columns: Mapping[str, str], rows: Sequence[Row], note: str = "") -> list[Table]:
    """Return the given columns of some rows under their headings, None as a dash; nothing without rows."""
    cells = [[float("nan") if row[name] is None else row[name] for name in columns] for row in rows]
    return [Table(caption, tuple(columns.values()), cells, note)] if rows else []


def page_tables(caption: str, table: Results) -> list[Table]:
    """Return a table of results, missing values as dashes; nothing without rows."""
    nothing = {name: float("nan") if _may_be_numbers(table, name) else NO_VALUE for name in table.filled}
    rows = [[nothing[name] if row.get(name) is None else row[name] for name in nothing] for row in table]
    return [Table(caption, table.filled, rows, table.title)] if rows else []


def _may_be_numbers(table: Results, column: str) -> bool:
    """Whether a column holds numbers, or nothing that says what it holds."""
    return table.numeric(column) or all(row.get(column) is None for row in table)


@dataclass(frozen=True)
class Attachment:
    """A file inside the page: a picture to show or a download; ``name`` is its caption or file name."""

    name: str
    media_type: str
    content: bytes

    @property
    def wide(self) -> bool:
        """Whether it is a PNG more than twice as wide as high, which is shown over the whole width of the page."""
        if not self.content.startswith(PNG):
            return False
        width, height = struct.unpack(">II", self.content[16:24])
        return bool(width > 2 * height)

    @property
    def uri(self) -> str:
        """The content as a data URI."""
        return f"data:{self.media_type};base64,{base64.b64encode(self.content).decode()}"


def download(name: str, content: str | bytes) -> Attachment:
    """Return a file to download, whose name tells its media type."""
    return Attachment(name, MEDIA_TYPES[Path(name).suffix], content.encode() if isinstance(content, str) else content)


def picture(caption: str, png: bytes) -> Attachment:
    """Return a PNG to show, reduced to 256 colours: enough for a figure, and a third of the bytes."""
    content = io.BytesIO()
    whole = Image.open(io.BytesIO(png)).convert("RGB")
    few = whole.quantize(256, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
    few.save(content, "png", optimize=True)
    return Attachment(caption, "image/png", content.getvalue())


@dataclass(frozen=True)
class Section:
    """One part of a page: text, tables and pictures below a heading. Texts are shown as they are, never as HTML.

    Args:
        title: The heading.
        paragraphs: Texts, shown first.
        tables: Tables, shown after them.
        figures: Pictures, shown last.
        id: Target of links to the section; generated if empty.

    Raises:
        ConfigError: If a part is of another type, or a row of a table is not as long as its heading.
    """

    title: str
    paragraphs: Sequence[str] = ()
    tables: Sequence[Table] = ()
    figures: Sequence[Attachment] = ()
    id: str = ""

    def __post_init__(self) -> None:
        for part, kind in ((self.paragraphs, str), (self.tables, Table), (self.figures, Attachment)):
            if isinstance(part, str) or not all(isinstance(one, kind) for one in part):
                raise ConfigError(f"section {self.title!r}: expected a list of {kind.__name__}, got {part!r:.80}")
        for table in self.tables:
            if any(len(row) != len(table.columns) for row in table.rows):
                raise ConfigError(
                    f"table {table.caption!r}: expected {counted(len(table.columns), 'cell')} in every row"
                )

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing to show."""
        return not (self.paragraphs or self.tables or self.figures)


@dataclass(frozen=True)
class Report:
    """The content of one page; parts without content are left out.

    Args:
        title: Heading.
        subtitle: One line below it.
        verdict: The first paragraphs.
        command: The command that repeats the experiment.
        configuration: The options as used, as text.
        maps: Replays.
        sections: Further sections, in order; empty sections are left out.
        downloads: Files inside the page.
        missing: What a partial report lacks, one line each.
        changed: Replays that differ from what was recorded, one line each.
        grid: Cells, each of which shows its replay when it is clicked; None for no grid.
        group_name: What a group of replays is called.
    """

    title: str
    subtitle: str
    verdict: Sequence[str]
    command: str
    configuration: str
    maps: Sequence[ReplayedMap] = ()
    sections: Sequence[Section] = ()
    downloads: Sequence[Attachment] = ()
    missing: Sequence[str] = ()
    changed: Sequence[str] = ()
    grid: CellGrid | None = None
    group_name: str = "Map set"


def command_of(arguments: Sequence[str], function: str) -> str:
    """Return the command line after ``mapbench``; if there is none, the function of ``evolution`` that was called."""
    return shlex.join(["mapbench", *arguments]) if arguments else f"evolution.{function}(...), see the configuration"


def render_page(report: Report) -> str:
    """Return the page as HTML text."""
    folder = resources.files("evolution.report")
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    environment.filters["breakable"] = _breakable
    template = environment.from_string(folder.joinpath("page.html.j2").read_text(encoding="utf-8"))
    scripts = [folder.joinpath(name).read_text(encoding="utf-8") for name in _SCRIPTS]
    return template.render(
        report=report,
        sections=[section for section in report.sections if not section.is_empty],
        css=Markup(folder.joinpath("page.css").read_text(encoding="utf-8")),
        scripts=Markup("\n;\n".join(scripts)),
        replays=Markup(json_in_script(replays_of(report.maps))),
        version=metadata.version("gym-mapbench"),
    )


def _sort_keys(column: Sequence[str | float | int]) -> list[str | None]:
    """Return the sort keys of a column. Texts have none, except the number that all texts of the column begin with."""
    texts = [cell for cell in column if isinstance(cell, str) and cell not in ("", NO_VALUE)]
    begun = bool(texts) and all(map(_NUMBER_FIRST.fullmatch, texts))
    return [_sort_key(cell, begun) for cell in column]


def _sort_key(cell: str | float | int, begun: bool) -> str | None:
    """Return the sort key of a cell; empty for one without a value, which sorts last."""
    if isinstance(cell, str):
        number = "" if cell == NO_VALUE else re.split("[/ ]", cell)[0]
        return number if begun else None
    return repr(float(cell)) if np.isfinite(cell) else ""


def _breakable(name: str) -> Markup:
    """Return a heading that may be broken at its underscores, where paper is too narrow."""
    return Markup(str(escape(name)).replace("_", "_<wbr>"))
