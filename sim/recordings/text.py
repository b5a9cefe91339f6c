"""Text files with one sample a line, plain or compressed by gzip: see `dialect` for what they may look like.

The file is read line by line. A line has at most `LINE_MAX` characters, a file at most `BYTES_MAX` bytes of text.
"""

import csv
import gzip
import io
import zlib
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from operator import methodcaller
from pathlib import Path
from typing import BinaryIO

from ...model.runtime.regular_file import opened
from .dialect import COMMENT, Dialect, dialect_of, is_above
from .error import ACCEPTED, RecordingError
from .table import CHUNK, Chunk, Table

BYTES_MAX = 16 * 10**9
LINE_MAX = 1 << 20
FIRST_LINES = 200
"""The rows by which a dialect is told."""
ABOVE_MAX = 10**5
"""The most comments and blank lines before the first row: they are in memory."""
GZIP = b"\x1f\x8b"
MARKS = '"#%/'
"""A quote has the first of these characters, a comment one of the others."""
BEGINNINGS = tuple("#%/ \t")
"""The characters with which a comment may begin."""
Piece = tuple[int, list[str]]
"""The number of lines before some lines, and these lines without their ends."""


class Text(Table):
    """A text file.

    Args:
        name: the file, for messages.
        path: the file.
        progress: function called with the number of bytes of the file that are read.

    Raises:
        RecordingError: if the file is not text, is empty, or its first line is not CSV.
    """

    word = "line"

    def __init__(self, name: str, path: str | Path, progress: Callable[[int], None] | None = None):
        self.name, self._path, self._progress = name, path, progress
        try:
            dialect = dialect_of(self._first())
        except csv.Error as error:
            raise RecordingError(f"{name}: is not CSV ({error}); must be {ACCEPTED}") from None
        if dialect is None:
            raise RecordingError(f"{name}: is empty; must be {ACCEPTED}")
        self.dialect: Dialect = dialect
        self.names, self.width, self.rate_hz = dialect.names, dialect.width, dialect.rate_hz
        self.head, self.form = self.at(dialect.named_by or 1), dialect.form

    def _first(self) -> list[str]:
        """Return the lines before the first row, and some behind."""
        first, rows = [], 0
        for line in (line for _, lines in self._pieces(CHUNK) for line in lines):
            first.append(line)
            rows += not is_above(line)
            if rows == FIRST_LINES:
                break
            if not rows and len(first) == ABOVE_MAX:
                raise RecordingError(f"{self.name}: must have a row of data within its first {ABOVE_MAX} lines")
        return first

    def chunks(self, places: Sequence[int]) -> Iterator[Chunk]:
        pieces = self._pieces()
        for before, lines in pieces:
            kept = lines[max(self.dialect.skipped - before, 0) :]
            columns = self._columns(kept, places)
            if columns is None:
                # A quoted cell may reach over lines, so the rest is read by the row.
                yield from self._chunks_by_row(chain([(before, lines)], pieces), places)
                return
            if kept:
                after = before + len(lines) + 1
                yield self._chunk(range(after - len(kept), after), columns)

    def _columns(self, lines: list[str], places: Sequence[int]) -> list[list[str]] | None:
        """Return the columns of lines that are plain rows; None if a line is no such row, is wrong or has a blank cell.

        A plain row has no quote and no comment. This is the faster of two ways to read the same: a row that it does not
        take is read, or refused by its number, by `_rows`.
        """
        separator, text = self.dialect.separator, "\n".join(lines)
        if any(mark in text for mark in MARKS) or max(map(len, lines), default=0) > csv.field_size_limit():
            return None
        if set(map(methodcaller("count", separator), lines)) - {self.width - 1}:
            return None
        # No list a row: the garbage collector would walk them all, again and again.
        cells = text.replace("\n", separator).split(separator)
        if separator == " " and cells != text.split():
            return None
        columns = [list(map(str.strip, cells[place :: self.width])) for place in places]
        return None if any("" in column for column in columns) else columns

    def _chunk(self, lines: Sequence[int], columns: list[list[str]]) -> Chunk:
        if self.dialect.decimal_comma:
            columns = [[cell.replace(",", ".") for cell in column] for column in columns]
        return Chunk(lines, [*columns])

    def _chunks_by_row(self, pieces: Iterator[Piece], places: Sequence[int]) -> Iterator[Chunk]:
        lines: list[int] = []
        columns: list[list[str]] = [[] for _ in places]
        for line, cells in self._rows(pieces):
            if len(cells) != self.width:
                header = " as the header" if self.dialect.named_by else " as the first"
                raise RecordingError(f"{self.at(line)}: must have {self.width} cells{header}, not {len(cells)}")
            lines.append(line)
            for column, place in zip(columns, places, strict=True):
                column.append(cells[place].strip())
            if len(lines) == CHUNK:
                yield self._chunk(lines, columns)
                lines, columns = [], [[] for _ in places]
        if lines:
            yield self._chunk(lines, columns)

    def _rows(self, pieces: Iterator[Piece]) -> Iterator[tuple[int, list[str]]]:
        """Yield (line number, cells) of every row, without comments, and without blank lines at the end."""
        waiting = []  # blank lines wait for a line that is not blank
        for line, cells in self._parsed(pieces):
            if not cells or not any(cell.strip() for cell in cells):
                waiting.append((line, cells))
                continue
            yield from waiting
            waiting = []
            yield line, cells

    def _parsed(self, pieces: Iterator[Piece]) -> Iterator[tuple[int, list[str]]]:
        skipped, separator = self.dialect.skipped, self.dialect.separator
        lines = _numbered(pieces, skipped)
        if separator == " ":
            for number, line in lines:
                yield number, line.split()
            return
        last = skipped

        def texts() -> Iterator[str]:
            nonlocal last
            for number, line in lines:
                last = number
                yield line

        try:
            for cells in csv.reader(texts(), delimiter=separator, strict=True):
                yield last, cells
        except csv.Error as error:
            raise RecordingError(f"{self.at(last)}: is not CSV ({error}); must be {ACCEPTED}") from None

    def _pieces(self, size: int = 1 << 22) -> Iterator[Piece]:
        """Yield the lines of the file, up to `CHUNK` at a time; raise RecordingError, with the line, where it is no
        text."""
        number, total, rest = 0, 0, ""
        try:
            with opened(self._path) as raw, _plain(raw) as file:
                text = io.TextIOWrapper(file, "utf-8-sig", errors="surrogateescape")
                while block := text.read(size):
                    *lines, rest = (rest + block).split("\n")
                    total += len(block)
                    self._check(number, [*lines, rest], total)
                    for start in range(0, len(lines), CHUNK):
                        yield number + start, lines[start : start + CHUNK]
                    number += len(lines)
                    if self._progress:
                        self._progress(raw.tell())
                if rest:
                    yield number, [rest]
        except FileNotFoundError:
            raise RecordingError(f"{self.name}: there is no such file; must be {ACCEPTED}") from None
        except (EOFError, zlib.error, gzip.BadGzipFile):
            raise RecordingError(f"{self.name}: its gzip is damaged, or ends early: copy the file again") from None
        except OSError as error:
            raise RecordingError(f"{self.name}: cannot be read ({error.strerror}); must be {ACCEPTED}") from None

    def _check(self, before: int, lines: list[str], total: int) -> None:
        """Raise RecordingError if lines are no text, or too long."""
        if total > BYTES_MAX:
            raise RecordingError(f"{self.name}: cannot be read (it has more than {BYTES_MAX / 1e6:g} MB of text)")
        together = "".join(lines)
        if "\0" not in together and (together.isascii() or _is_text(together)) and max(map(len, lines)) <= LINE_MAX:
            return
        for number, line in enumerate(lines, before + 1):
            if not _is_text(line):
                raise RecordingError(f"{self.at(number)}: is not UTF-8 text; must be {ACCEPTED}")
            if "\0" in line:
                raise RecordingError(f"{self.at(number)}: is binary data; must be {ACCEPTED}")
            if len(line) > LINE_MAX:
                raise RecordingError(f"{self.at(number)}: must have at most {LINE_MAX} characters, not {len(line)}")


def _numbered(pieces: Iterator[Piece], skipped: int) -> Iterator[tuple[int, str]]:
    """Yield the number and the text of every line behind the first ones, with its end, without comments."""
    for before, lines in pieces:
        for number, line in enumerate(lines, before + 1):
            if number > skipped and not (line[:1] in BEGINNINGS and COMMENT.match(line)):
                yield number, f"{line}\n"


def _plain(raw: BinaryIO) -> BinaryIO:
    """Return a file without its gzip, if it has one."""
    packed = raw.read(2) == GZIP
    raw.seek(0)
    return gzip.GzipFile(fileobj=raw) if packed else raw  # type: ignore[return-value]


def _is_text(text: str) -> bool:
    """Return whether a text has no bytes that were not UTF-8."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True
