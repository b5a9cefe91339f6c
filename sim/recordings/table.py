"""A file as a table: named columns, read in chunks of rows, so that no whole file is in memory."""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ...model.checks import shown
from .error import RecordingError, plain

CHUNK = 1 << 16
"""The most rows of a chunk."""
NAMES_SHOWN = 8
"""The most names of columns in a message."""

Cells = list[str] | np.ndarray
"""The cells of a column: texts, or numbers of a file that has numbers."""


class Chunk(NamedTuple):
    """Some rows of a table.

    Attributes:
        lines: the number of every row in the file: of its line, or the row's own, from 1 on.
        columns: the cells of the columns that were asked for, one list or array each.
    """

    lines: Sequence[int]
    columns: list[Cells]


class Table(ABC):
    """A file as a table.

    Attributes:
        name: the file, for messages.
        word: what a row is called in messages: "line" or "row".
        names: the columns' names; empty for a file that has none.
        width: number of columns.
        head: where the names are, for messages.
        form: the form of the file, in a few words.
        rate_hz: the sample rate that the file itself states; None if it states none.
    """

    name: str
    word: str
    names: list[str]
    width: int
    head: str
    form: str
    rate_hz: float | None = None

    @abstractmethod
    def chunks(self, places: Sequence[int]) -> Iterator[Chunk]:
        """Yield the rows of the columns at some places, in the file's order.

        Raises:
            RecordingError: if the file cannot be read.
        """

    def at(self, line: int) -> str:
        """Return the place of a row, for the beginning of a message."""
        return f"{self.name}, {self.word} {line}"

    def called(self, place: int) -> str:
        """Return the name of a column, or its number where it has none."""
        return (self.names[place] if self.names else "") or str(place + 1)

    def place(self, column: str) -> int:
        """Return the place of a column by its name, or else by its number from 1 on.

        Raises:
            RecordingError: if there is no such column, or several have the name.
        """
        found = self.names.count(column)
        if found == 1:
            return self.names.index(column)
        if found > 1:
            raise RecordingError(f"{self.head}: column {shown(column)} must be there once, not {found} times")
        if column.isascii() and column.isdigit() and len(column) < 10 and 1 <= int(column) <= self.width:
            return int(column) - 1
        if not self.names:
            raise RecordingError(
                f"{self.name}: has no line with names, so column must be a number of 1 to {self.width}, "
                f"not {shown(column)}"
            )
        names = [plain(each) for each in self.names[:NAMES_SHOWN]]
        names += [f"{len(self.names) - NAMES_SHOWN} more"] if len(self.names) > NAMES_SHOWN else []
        raise RecordingError(f"{self.head}: column must be one of {', '.join(names)}, not {shown(column)}")


class Arrays(Table):
    """A table of columns in memory, for files with arrays."""

    word = "row"

    def __init__(self, name: str, form: str, columns: dict[str, np.ndarray], names: bool = True):
        self.name, self.form, self.head = name, form, name
        self.names, self.width = list(columns) if names else [], len(columns)
        self._columns = list(columns.values())

    def chunks(self, places: Sequence[int]) -> Iterator[Chunk]:
        wanted = [self._columns[place] for place in places]
        lengths = {len(column) for column in wanted}
        if len(lengths) > 1:
            said = " and ".join(f"{plain(self.called(place))} {len(self._columns[place])}" for place in places)
            raise RecordingError(f"{self.name}: columns must have as many rows as each other, not {said}")
        for first in range(0, *lengths, CHUNK):
            columns: list[Cells] = [of_numbers(column[first : first + CHUNK]) for column in wanted]
            yield Chunk(range(first + 1, first + 1 + len(columns[0])), columns)


def of_numbers(values: np.ndarray) -> Cells:
    """Return numbers, times and durations as they are, and everything else as texts."""
    return values if values.dtype.kind in "iufbMm" else [str(value) for value in values.tolist()]
