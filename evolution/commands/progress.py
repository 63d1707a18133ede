"""Progress on the terminal: a bar on a terminal, one line per generation in a file or pipe."""

from __future__ import annotations

import time
from datetime import timedelta
from typing import Self

from rich.progress import BarColumn, MofNCompleteColumn, Progress, ProgressColumn, Task, TextColumn, TimeRemainingColumn
from rich.table import Column
from rich.text import Text

from evolution.commands.console import errors, note, notes, say
from evolution.driving import Job, RunResult, is_compiled
from evolution.files import counted
from evolution.runs import GOOD_SET
from evolution.search import EvolveSettings
from evolution.search import Progress as Generation
from gym_mapbench.errors import visible

SLOW = 0.5
"""Runs a second below which they are counted by the minute."""

COMPILING = "compiling, once per machine, about a minute"
BAR_WIDTH = 16
"""Characters of a bar, so that numbers and time fit beside it on a terminal of 80 columns."""
SECONDS_PER_LINE = 20.0
"""How often a file or pipe, where no bar is seen, gets a line about the runs."""


class TimeColumn(TimeRemainingColumn):
    """Shows the remaining time, or the elapsed time while the remaining time is unknown."""

    def render(self, task: Task) -> Text:
        """Return the text of the column."""
        if task.time_remaining is None:
            return Text(f"{timedelta(seconds=int(task.elapsed or 0))} so far", style="progress.elapsed")
        return super().render(task).append(" left")


class PlainColumn(TextColumn):
    """A column of a bar without markup."""

    def __init__(self, text: str, column: Column | None = None) -> None:
        super().__init__(text, markup=False, table_column=column)

    def render(self, task: Task) -> Text:
        """Return the text of the column."""
        shown = super().render(task)
        shown.plain = visible(shown.plain)
        return shown


class StateColumn(PlainColumn):
    """Shows the text field ``state``, in the room that the other columns leave; the rest of it is cut off."""

    def __init__(self) -> None:
        super().__init__("{task.fields[state]}", Column(no_wrap=True, overflow="ellipsis", ratio=1))


def best_in_words(fitness: float) -> str:
    """Return the best fitness so far in words; a fitness above 0 is a sum of penalties."""
    if fitness > 0:
        return f"no set yet {GOOD_SET}"
    return f"best fitness {fitness:.2f} (lower is better)"


def best_in_short(fitness: float) -> str:
    """Return the same in the few words that fit beside a bar."""
    return "no good set yet" if fitness > 0 else f"best {fitness:.2f}"


class RunsPerSecond:
    """Counts runs per second of wall clock."""

    def __init__(self) -> None:
        self.began = time.perf_counter()
        self.runs = 0

    @property
    def rate(self) -> float:
        """Runs per second so far."""
        return self.runs / max(time.perf_counter() - self.began, 1e-9)

    def __str__(self) -> str:
        """The rate in words, also where it is small."""
        return f"{self.rate:.1f} runs/s" if self.rate >= SLOW else f"{60 * self.rate:.2g} runs/min"


class Bar:
    """A bar on standard error while the ``with`` block lasts; nothing where that is no terminal.

    Args:
        what: Shown before the bar.
        total: Amount of work.
        columns: Shown after it, one of them a ``StateColumn``.
    """

    def __init__(self, what: str, total: float | None, *columns: ProgressColumn) -> None:
        self.bar = Progress(
            PlainColumn("{task.description}"),
            BarColumn(BAR_WIDTH),
            *columns,
            console=notes,
            expand=True,
            disable=notes.quiet or not notes.is_terminal,
        )
        self.speed = RunsPerSecond()
        self.compiled = is_compiled()
        self.task = self.bar.add_task(what, total=total, state="" if self.compiled else COMPILING)

    def __enter__(self) -> Self:
        if not (self.compiled or errors.is_terminal):
            note(COMPILING)
        self.bar.start()
        return self

    def __exit__(self, *_error: object) -> None:
        self.bar.stop()


class WorkBar(Bar):
    """A bar over the runs of a benchmark.

    Args:
        what: Shown before the bar.
        total: Amount of work; None if the first finished run reports it.
    """

    def __init__(self, what: str, total: int | None = None) -> None:
        super().__init__(what, total, MofNCompleteColumn(), StateColumn(), TimeColumn())
        self.told = self.speed.began

    def tell(self, line: str) -> None:
        """Print a line where there is no bar, unless the last one is not long ago."""
        now = time.perf_counter()
        if not notes.is_terminal and now - self.told >= SECONDS_PER_LINE:
            self.told = now
            note(f"{line}, {self.speed}")

    def advance(self, job: Job, result: RunResult, left: int) -> None:
        """Show one finished run of a benchmark."""
        self.speed.runs += 1
        self.tell(f"{self.speed.runs} of {counted(self.speed.runs + left, 'run')} done")
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
            f"generation {row['generation']}: {counted(row['evaluations'], 'map set')}, {counted(self.asked, 'run')}, "
            f"{100 * row['mean_success_rate']:.0f} % of the population's runs at the goal, "
            f"{best_in_words(row['best'])}, {generation.seconds:.1f} s{replayed}"
        )

    def on_run(self, _job: Job, _result: RunResult, _left: int) -> None:
        """Count one run of a search, of a generation or of the validation stage."""
        self.speed.runs += 1
        self.tell(f"runs done: {self.speed.runs}")
        self._show(advance=1 if self.search.runs else 0)

    def _show(self, completed: float | None = None, advance: float | None = None) -> None:
        """Move the bar, and show the state of the search beside it."""
        self.bar.update(self.task, completed=completed, advance=advance, state=f"{self.reached}, {self.speed}")
