"""Output for people: tables on stdout, everything else on stderr."""

import logging
import time
from collections.abc import Iterable
from dataclasses import dataclass

import rich.table
from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from ..model.runtime.result import Table
from ..model.runtime.stages import PATIENCE_S, logger
from .errors import one_line

log = Console(stderr=True, highlight=False, markup=False)
SILENCE_S = 10.0
"""The time between two lines of progress where there is no progress bar."""
GAP, EDGE = 2, 1
"""The numbers of spaces between two columns, and on either side of a table."""
WORD_MAX = 20
"""The length above which a word may be broken, so that a long name leaves room for the numbers."""


def show(table: Table) -> None:
    """Print a table in the terminal's width, in several parts if needed, without breaking numbers or usual words.

    Where the terminal is too narrow even for that, lines are longer than it is wide.
    """
    console = Console(highlight=False)
    if not table.columns:
        drawn = rich.table.Table(box=None, show_header=False, pad_edge=False)
        drawn.add_column(style="bold", no_wrap=True)
        drawn.add_column(overflow="fold")
        _print(console, drawn, table.rows, max((len(key) for key, _ in table.rows), default=0) + GAP + WORD_MAX)
        return
    columns = [_Column(*head, [row[place] for row in table.rows]) for place, head in enumerate(table.columns.items())]
    width = console.width - 2 * EDGE
    for part in _parts(columns, width):
        drawn = rich.table.Table(box=SIMPLE_HEAD, pad_edge=False, collapse_padding=True)
        widths = _widths(part, width)
        for column, wide in widths:
            drawn.add_column(Text(column.heading), justify=column.justify, overflow="fold", width=wide)
        rows = list(zip(*(column.cells for column in part), strict=True))
        _print(console, drawn, rows, sum(wide + GAP for _, wide in widths) - GAP + 2 * EDGE)


def _print(console: Console, drawn: rich.table.Table, rows: Iterable[Iterable[str]], least: int) -> None:
    """Print a table of rows; a terminal narrower than `least` counts as `least` wide."""
    for row in rows:
        drawn.add_row(*map(Text, row))
    console.width = max(console.width, least)
    console.print(drawn)


@dataclass(frozen=True)
class _Column:
    heading: str
    justify: str
    cells: list[str]

    @property
    def least(self) -> int:
        """The least width: the width of the numbers, or of the longest word."""
        words = [word[:WORD_MAX] for cell in self.cells for word in cell.split()]
        return max(map(len, [*(words if self.justify == "left" else self.cells), *self.heading.split()]), default=1)

    @property
    def most(self) -> int:
        """The width at which no text is broken into lines."""
        return max(map(len, [self.heading, *self.cells]))


def _parts(columns: list[_Column], width: int) -> list[list[_Column]]:
    """Return the columns in parts that fit the width: all columns of words, and as many columns of numbers as fit."""
    words = [column for column in columns if column.justify == "left"]
    room = width + GAP - sum(column.least + GAP for column in words)
    parts, remaining = [list(words)], room
    for column in columns:
        if column.justify == "left":
            continue
        if column.least + GAP > remaining and len(parts[-1]) > len(words):
            parts.append(list(words))
            remaining = room
        parts[-1].append(column)
        remaining -= column.least + GAP
    return parts


def _widths(columns: list[_Column], width: int) -> list[tuple[_Column, int]]:
    """Return every column with its width; spare width goes to words first, according to their need."""
    spare = width + GAP - sum(column.least + GAP for column in columns)
    widths = {column.heading: column.least for column in columns}
    for justify in ("left", "right"):
        lacking = {column.heading: column.most - column.least for column in columns if column.justify == justify}
        part = min(max(spare, 0) / max(sum(lacking.values()), 1), 1.0)
        for heading, more in lacking.items():
            widths[heading] += int(part * more)
            spare -= int(part * more)
    return [(column, widths[column.heading]) for column in columns]


class _Stages(logging.Handler):
    """A log handler that prints the stages of the program, and its warnings, each on one line."""

    def emit(self, record: logging.LogRecord) -> None:
        prefix = "hardwall: warning: " if record.levelno >= logging.WARNING else ""
        log.print(one_line(f"{prefix}{record.getMessage()}"), style="dim", soft_wrap=True)


def hear_stages() -> None:
    """Print long stages of the program on stderr: see `jobs.stages`."""
    logger.handlers = [_Stages()]
    logger.setLevel(logging.INFO)


class progress:
    """The progress of a run on stderr: a bar in a terminal, elsewhere a line every `SILENCE_S`.

    As a context it returns the function to call with the amount done. The bar comes with the first amount after
    `PATIENCE_S`, so an early refusal is one line alone.
    """

    def __init__(self, title: str, total: int):
        self._title, self._total, self._said = one_line(title), total, time.monotonic()
        self._begun = self._said
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
        self._bar = Progress(*columns, console=log, transient=True, disable=not log.is_terminal)
        self._task = self._bar.add_task(escape(self._title), total=total)

    def __enter__(self):
        return self._done

    def __exit__(self, *_) -> None:
        if self._bar.live.is_started:
            self._bar.stop()

    def _done(self, done: float) -> None:
        now = time.monotonic()
        if now - self._begun >= PATIENCE_S:
            self._bar.start()
        self._bar.update(self._task, completed=done)
        if not log.is_terminal and now - self._said >= SILENCE_S:
            self._said = now
            log.print(f"{self._title}: {done / self._total:.0%}")
