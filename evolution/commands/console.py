"""Output of the commands: results on standard output; notes and log messages on standard error."""

from __future__ import annotations

import ctypes
import json
import logging
import math
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from dataclasses import replace
from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as Grid
from rich.text import Text

from evolution.commands.narrow_tables import Column, blocks_within, widths_within
from evolution.files import Table, version_lines
from gym_mapbench.errors import visible

LOG = logging.getLogger(__name__)
PACKAGES = ("gym_mapbench", "controllers", "evolution")
PIPE_WIDTH = 160
UNLIMITED = 10_000
LONGEST_NAME = 36
"""Names in the first column of a table stay on one line if none is longer."""


class PlainConsole(Console):
    """Shows texts as they are: a name in square brackets is no markup, and one with an escape sequence does nothing.

    On a terminal sentences are broken between words; in a file or pipe each is one line.
    """

    def __init__(self, *, stderr: bool = False) -> None:
        width = None if (sys.stderr if stderr else sys.stdout).isatty() else PIPE_WIDTH
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False, width=width)

    def on_broken_pipe(self) -> None:
        """Say that nobody reads the output any more; raises ``BrokenPipeError``."""
        raise BrokenPipeError

    def print(self, *parts: Any, **options: Any) -> None:
        """Print texts, tables and whatever else rich can show."""
        if all(isinstance(part, str) for part in parts):
            options.setdefault("soft_wrap", not self.is_terminal)
        super().print(*parts, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Return the text of a printed string or a table cell."""
        return super().render_str(visible(text, "\n"), **options)


console = PlainConsole()
errors = PlainConsole(stderr=True)
notes = PlainConsole(stderr=True)
"""Where notes and bars are shown, unless the user wants quiet."""


def be_quiet(quiet: bool = True) -> None:
    """Print results and errors only from now on; or notes and progress, too."""
    notes.quiet = quiet


class _Notes(logging.Handler):
    """Prints log messages as notes."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record."""
        note(self.format(record))


_verbosely = _Notes()


def be_verbose(verbose: bool = True) -> None:
    """Print the log messages of the packages from now on: files, presets, seeds and every run; or no longer."""
    for package in PACKAGES:
        logger = logging.getLogger(package)
        logger.setLevel(logging.INFO if verbose else logging.NOTSET)
        (logger.addHandler if verbose else logger.removeHandler)(_verbosely)
    LOG.info("%s", ", ".join(version_lines()))


def say(line: str) -> None:
    """Print a line of progress on standard output, where no bar shows it."""
    if not notes.is_terminal and not notes.quiet:
        print(visible(line), flush=True)


def print_json(document: object) -> None:
    """Print a document as JSON on standard output, with null in place of numbers that are not finite."""
    print(json.dumps(_finite(document), indent=1, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(one) for one in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def note(text: str) -> None:
    """Print a message on standard error, apart from the results."""
    notes.print(text)


@contextmanager
def only_results_on_stdout() -> Iterator[None]:
    """Send the output of user code, from C as well, to standard error while the ``with`` block lasts."""
    sys.stdout.flush()
    stdout = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # buffered output of C
        os.dup2(stdout, 1)
        os.close(stdout)


def print_table(table: Table) -> None:
    """Print a table on standard output, numbers aligned to the right, without columns that hold nothing.

    Where it is too wide, it does without lines between columns, headings wider than what stands below are broken, and
    texts go on below, between words. If whole words are too wide, the last columns follow in a table of their own.
    """
    grid = Grid(title=table.title or None, title_justify="left")
    for column in (columns := _columns(table)):
        grid.add_column(column.name, justify=column.justify, no_wrap=column.whole)
    for line in table.cells():
        grid.add_row(*line)
    if Measurement.get(console, console.options.update(max_width=UNLIMITED), grid).maximum > console.width:
        _print_narrow(columns, table.title)
    else:
        console.print(grid)


def _columns(table: Table) -> list[Column]:
    """Return the columns of a table; the names in the first stay on one line if none is very long."""
    columns = [
        Column(name, cells, table.numeric(name))
        for name, cells in zip(table.filled, zip(*table.cells(), strict=True), strict=True)
    ]
    if columns and max(map(len, columns[0].cells)) <= LONGEST_NAME:
        columns[0] = replace(columns[0], whole=True)
    return columns


def _print_narrow(columns: Sequence[Column], title: str) -> None:
    """Print a table without lines between columns, in blocks that fit the terminal."""
    if title:
        console.print(Text(visible(title), "table.title"))
    for number, block in enumerate(blocks_within(columns, console.width)):
        grid = Grid(box=SIMPLE_HEAD, show_edge=False, padding=(0, 0))
        for column, width in zip(block, widths_within(block, console.width), strict=True):
            grid.add_column(column.heading, justify=column.justify, overflow="fold", width=width)
        for line in zip(*(column.cells for column in block), strict=True):
            grid.add_row(*line)
        console.print(*([""] if number else []), grid, sep="\n")
