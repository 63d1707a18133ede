"""Progress on the terminal: a bar on a terminal, one line per generation in a file or pipe."""

from __future__ import annotations

import ctypes
import logging
import os
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from datetime import timedelta
from types import TracebackType
from typing import Any, Self

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.table import Table as Grid
from rich.text import Text

from evolution.driving import Job, RunResult, is_compiled
from evolution.files import Table, version_lines
from evolution.search import EvolveSettings
from evolution.search import Progress as Generation
from gym_mapbench.errors import visible

LOG = logging.getLogger(__name__)
PACKAGES = ("gym_mapbench", "controllers", "evolution")
PIPE_WIDTH = 160
UNLIMITED = 10_000
LONGEST_NAME = 36
"""Names in the first column of a table stay on one line if none is longer."""

SLOW = 0.5
"""Runs a second below which they are counted by the minute."""

COMPILING = "compiling, once per machine, about a minute"
SECONDS_PER_LINE = 20.0
"""How often a file or pipe, where no bar is seen, gets a line about the runs."""


class PlainConsole(Console):
    """Shows texts as they are: a name in square brackets is no markup, and one with an escape sequence does nothing.

    On a terminal sentences are broken between words; in a file or pipe each is one line.
    """

    def __init__(self, *, stderr: bool = False) -> None:
        width = None if (sys.stderr if stderr else sys.stdout).isatty() else PIPE_WIDTH
        super().__init__(stderr=stderr, markup=False, emoji=False, highlight=False, width=width)

    def print(self, *parts: Any, **options: Any) -> None:
        """Print texts, tables and whatever else rich can show."""
        if all(isinstance(part, str) for part in parts):
            options.setdefault("soft_wrap", not self.is_terminal)
        super().print(*parts, **options)

    def render_str(self, text: str, **options: Any) -> Text:
        """Make a text of what is printed or stands in a table."""
        return super().render_str(visible(text, "\n"), **options)


class TimeColumn(TimeRemainingColumn):
    """Says how much time is left, or, as long as nobody knows that, how much has passed."""

    def render(self, task: Task) -> Text:
        """Return the text of the column."""
        if task.time_remaining is None:
            return Text(f"{timedelta(seconds=int(task.elapsed or 0))} so far", style="progress.elapsed")
        return super().render(task).append(" left")


class PlainColumn(TextColumn):
    """A column of a bar that shows names as they are."""

    def __init__(self, text: str) -> None:
        super().__init__(text, markup=False)

    def render(self, task: Task) -> Text:
        """Return the text of the column."""
        shown = super().render(task)
        shown.plain = visible(shown.plain)
        return shown


console = PlainConsole()
errors = PlainConsole(stderr=True)
notes = PlainConsole(stderr=True)
"""Where notes and bars are shown, unless the user wants quiet."""


def be_quiet(quiet: bool = True) -> None:
    """Print neither notes nor progress from now on, only results and errors; or everything again."""
    notes.quiet = quiet


class _Notes(logging.Handler):
    """Prints what the packages log as notes."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print one record."""
        note(self.format(record))


_verbosely = _Notes()


def be_verbose(verbose: bool = True) -> None:
    """Print from now on what the packages log: files, presets and seeds, and every run; or no longer."""
    for package in PACKAGES:
        logger = logging.getLogger(package)
        logger.setLevel(logging.INFO if verbose else logging.NOTSET)
        (logger.addHandler if verbose else logger.removeHandler)(_verbosely)
    LOG.info("%s", ", ".join(version_lines()))


def say(line: str) -> None:
    """Print a line of progress on standard output, where no bar shows it."""
    if not notes.is_terminal and not notes.quiet:
        print(visible(line), flush=True)


def note(text: str) -> None:
    """Print a message on standard error, apart from the results."""
    notes.print(text)


@contextmanager
def only_results_on_stdout() -> Iterator[None]:
    """Send what code of users prints, from C as well, to standard error while the ``with`` block lasts."""
    sys.stdout.flush()
    stdout = os.dup(1)
    os.dup2(2, 1)
    try:
        with redirect_stdout(sys.stderr):
            yield
    finally:
        if os.name == "posix":
            ctypes.CDLL(None).fflush(None)  # what C has not printed yet
        os.dup2(stdout, 1)
        os.close(stdout)


def print_table(table: Table) -> None:
    """Print a table on standard output, numbers aligned to the right, without columns that hold nothing.

    Where it is too wide, it does without lines between columns, headings wider than what stands below are broken,
    and texts go on below rather than being cut off; the names in the first column stay whole.
    """
    grid = Grid(title=table.title or None, title_justify="left")
    cells = table.cells()
    for place, name in enumerate(table.filled):
        whole = place == 0 and max(len(line[place]) for line in cells) <= LONGEST_NAME
        grid.add_column(name, justify="right" if table.numeric(name) else "left", overflow="fold", no_wrap=whole)
    for line in cells:
        grid.add_row(*line)
    if Measurement.get(console, console.options.update(max_width=UNLIMITED), grid).maximum > console.width:
        grid.box, grid.show_edge, grid.padding = SIMPLE_HEAD, False, (0, 0)
        for column, name, texts in zip(grid.columns, table.filled, zip(*cells, strict=True), strict=True):
            if len(name) > max(map(len, texts)):
                column.header = name.replace(" ", "\n").replace("_", "_\n")
    console.print(grid)


def best_in_words(fitness: float) -> str:
    """Say how good the best map set is so far; a fitness above 0 is a sum of penalties, which tells nobody anything."""
    if fitness > 0:
        return "no set yet that all solve and whose maps differ as wanted"
    return f"best fitness {fitness:.2f} (lower is better)"


def best_in_short(fitness: float) -> str:
    """Say the same beside a bar, where a terminal of 80 columns leaves room for a few words."""
    return "no good set yet" if fitness > 0 else f"best {fitness:.2f}"


class RunsPerSecond:
    """Counts driven runs against the wall clock."""

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self.runs = 0

    @property
    def rate(self) -> float:
        """Driven runs per second so far."""
        return self.runs / max(time.perf_counter() - self.began, 1e-9)

    def __str__(self) -> str:
        """The rate in words, also where it is small."""
        return f"{self.rate:.1f} runs/s" if self.rate >= SLOW else f"{60 * self.rate:.2g} runs/min"


class Bar:
    """A bar on standard error while the ``with`` block lasts; nothing where that is no terminal.

    Args:
        what: Shown before the bar.
        total: Amount of work.
        columns: Shown after it; they may show the text field ``state``.
    """

    def __init__(self, what: str, total: float | None, *columns: ProgressColumn) -> None:
        self.bar = Progress(
            PlainColumn("{task.description}"),
            BarColumn(),
            *columns,
            console=notes,
            disable=notes.quiet or not notes.is_terminal,
        )
        self.compiled = is_compiled()
        self.task = self.bar.add_task(what, total=total, state="" if self.compiled else COMPILING)

    def __enter__(self) -> Self:
        if not (self.compiled or errors.is_terminal):
            note(COMPILING)
        self.bar.start()
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _error: BaseException | None, _trace: TracebackType | None
    ) -> None:
        self.bar.stop()


class WorkBar(Bar):
    """A bar over the runs of a benchmark.

    Args:
        what: Shown before the bar.
        total: Amount of work; None if it is only known from the first finished run, which says how many are left.
    """

    def __init__(self, what: str, total: int | None = None) -> None:
        self.speed = RunsPerSecond()
        self.told = self.speed.began
        state = PlainColumn("{task.fields[state]}")
        super().__init__(what, total, MofNCompleteColumn(), state, TimeColumn())

    def tell(self, line: str) -> None:
        """Print a line where there is no bar, unless the last one is not long ago."""
        now = time.perf_counter()
        if not notes.is_terminal and now - self.told >= SECONDS_PER_LINE:
            self.told = now
            note(f"{line}, {self.speed}")

    def advance(self, job: Job, result: RunResult, left: int) -> None:
        """Show one finished run of a benchmark."""
        self.speed.runs += 1
        self.tell(f"{self.speed.runs} of {self.speed.runs + left} runs driven")
        self.bar.update(self.task, total=self.speed.runs + left)
        state = f"{job.scenario.name} {job.controller.name}: {result.outcome}, {self.speed}"
        self.bar.update(self.task, advance=1, state=state)


class SearchBar(WorkBar):
    """A bar over the runs of a search, or over its evaluations where its runs are not limited.

    Args:
        search: Options of the search.
    """

    def __init__(self, search: EvolveSettings) -> None:
        super().__init__("evolving", search.runs or search.evaluations)
        self.search = search
        self.asked = 0
        self.reached = "first generation"

    def on_generation(self, generation: Generation) -> None:
        """Show one generation of a search."""
        row, runs = generation.row, self.search.runs
        self.asked += generation.driven + generation.reused
        self.reached = f"gen {row['generation']} done, {best_in_short(row['best'])}"
        self._show(completed=self.asked if runs else row["evaluations"])
        replayed = " (replayed)" if generation.replayed else ""
        say(
            f"generation {row['generation']}: {row['evaluations']} map sets, {self.asked} runs, "
            f"{100 * row['mean_success_rate']:.0f} % of the population's runs at the goal, "
            f"{best_in_words(row['best'])}, {generation.seconds:.1f} s{replayed}"
        )

    def on_run(self, _job: Job, _result: RunResult, _left: int) -> None:
        """Count one driven run of a search, be it of a generation or of the confirmation."""
        self.speed.runs += 1
        self.tell(f"runs driven: {self.speed.runs}")
        self._show(advance=1 if self.search.runs else 0)

    def _show(self, **done: float) -> None:
        """Move the bar, and say beside it how far the search is."""
        self.bar.update(self.task, state=f"{self.reached}, {self.speed}", **done)
