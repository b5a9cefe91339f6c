"""Text files with one sample a line, plain or compressed by gzip: see `dialect` for what they may look like.

The file is read line by line. A line has at most `LINE_MAX` characters, a file at most `BYTES_MAX` bytes of text.
"""

import csv
import gzip
import io
import zlib
from collections.abc import Callable, Iterator, Sequence
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
        for line in self._lines(CHUNK):
            first.append(line)
            rows += not is_above(line)
            if rows == FIRST_LINES:
                break
            if not rows and len(first) == ABOVE_MAX:
                raise RecordingError(f"{self.name}: must have a row of data within its first {ABOVE_MAX} lines")
        return first

    def chunks(self, places: Sequence[int]) -> Iterator[Chunk]:
        lines: list[int] = []
        columns: list[list[str]] = [[] for _ in places]
        for line, cells in self._rows():
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

    def _chunk(self, lines: list[int], columns: list[list[str]]) -> Chunk:
        if self.dialect.decimal_comma:
            columns = [[cell.replace(",", ".") for cell in column] for column in columns]
        return Chunk(lines, [*columns])

    def _rows(self) -> Iterator[tuple[int, list[str]]]:
        """Yield (line number, cells) of every row, without comments, and without blank lines at the end."""
        waiting = []  # blank lines wait for a line that is not blank
        for line, cells in self._parsed():
            if not cells or not any(cell.strip() for cell in cells):
                waiting.append((line, cells))
                continue
            yield from waiting
            waiting = []
            yield line, cells

    def _parsed(self) -> Iterator[tuple[int, list[str]]]:
        skipped, separator = self.dialect.skipped, self.dialect.separator
        lines = self._numbered(skipped)
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

    def _numbered(self, skipped: int) -> Iterator[tuple[int, str]]:
        """Yield the number and the text of every line behind the first ones, without comments."""
        for number, line in enumerate(self._lines(), 1):
            if number > skipped and not (line[0] in "#%/ \t" and COMMENT.match(line)):
                yield number, line

    def _lines(self, piece: int = 1 << 22) -> Iterator[str]:
        """Yield the lines of the file with their ends; raise RecordingError, with the line, where it is no text."""
        number, total, rest = 0, 0, ""
        try:
            with opened(self._path) as raw, _plain(raw) as file:
                text = io.TextIOWrapper(file, "utf-8-sig", errors="surrogateescape")
                while block := text.read(piece):
                    *lines, rest = (rest + block).split("\n")
                    total += len(block)
                    self._check(number, [*lines, rest], total)
                    number += len(lines)
                    yield from (f"{line}\n" for line in lines)
                    if self._progress:
                        self._progress(raw.tell())
                if rest:
                    yield f"{rest}\n"
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
