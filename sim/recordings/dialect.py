"""The form of a text file: its comments, its separator, its decimal comma, and whether a line names its columns.

The rules, in this order:

- Comments. A line is a comment if it begins with `#`, `%` or `//`, or, before the first row, with `;` and a space.
  Comments and blank lines before the first row are passed over.
- Separator. It is the first of tab, semicolon, comma and spaces that the first other line has, outside quotes. A comma
  that leaves two numbers beside each other in a cell is a decimal comma: then spaces separate.
- Decimal comma. Where no comma separates, a cell `1,5` is the number 1.5.
- Names. The first line names the columns if one of its cells is no number, no time, and no word for nothing
  such as `n/a`. A line that also has numbers may be a row instead: if one of them is a time or has a decimal point, or
  if its other cells stand over texts alone. If the first line does not name the columns, the last comment before it
  may. It must have as many cells, and one of them must be no number.
- A comment `Channels (2/8): A, B` of sigrok names the columns that a header calls `logic`. A comment
  `Samplerate: 1 MHz` or `Sample rate: 1e+06Hz` is the rate of rows without times.
"""

import csv
import re
from collections.abc import Sequence
from typing import NamedTuple

from .capture import hertz_of

COMMENT = re.compile(r"\s*(?:#|%|//)")
COMMENT_ABOVE = re.compile(r"\s*(?:#|%|//|; )")
"""The beginnings of a comment: everywhere, and above the first row."""
NUMBER = re.compile(r"[+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?|[+-]?(?:nan|inf(?:inity)?)", re.IGNORECASE)
ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:[.,]\d+)?)?(?:Z|[+-]\d\d:?\d\d)?")
NOTHING = re.compile(r"[-?.*]+|n\.?/?a\.?|none|null|nil|missing", re.IGNORECASE)
"""The texts that programs write in place of a missing number."""
DECIMAL_COMMA = re.compile(r"\d,\d|(?:^|[\s;+-]),\d")
_CHANNELS = re.compile(r"\W*channels?\s*\(\d+/\d+\)\s*:\s*(.+)", re.IGNORECASE)
_RATE = re.compile(r"\W*sample ?rate\s*:\s*(.+)", re.IGNORECASE)
_NAMES = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}


class Dialect(NamedTuple):
    """The look of a text file.

    Attributes:
        separator: a tab, `;`, `,` or a space, which stands for any number of spaces.
        decimal_comma: whether numbers have a decimal comma.
        names: the columns' names; empty if none are given.
        named_by: the number of the line that names them; 0 for none.
        skipped: number of lines before the first row.
        width: number of columns.
        rate_hz: the sample rate in a comment; None for none.
    """

    separator: str
    decimal_comma: bool
    names: list[str]
    named_by: int
    skipped: int
    width: int
    rate_hz: float | None

    @property
    def form(self) -> str:
        """The dialect in words."""
        comma = ", decimal comma" if self.decimal_comma else ""
        named = f", names in line {self.named_by}" if self.named_by else ", no names"
        return f"text, separated by {_NAMES[self.separator]}{comma}{named}"


def cells_of(line: str, separator: str) -> list[str]:
    """Return the cells of one line, without the spaces around them.

    Raises:
        csv.Error: if a quote is out of place.
    """
    if separator == " ":
        return line.split()
    return [cell.strip() for row in csv.reader([line], delimiter=separator, strict=True) for cell in row]


def is_value(cell: str) -> bool:
    """Return whether a cell is a number, a time, or nothing."""
    return not cell or _is_number(cell) or bool(NOTHING.fullmatch(cell))


def _is_number(cell: str) -> bool:
    """Return whether a cell is a number or a time."""
    return bool(NUMBER.fullmatch(cell) or ISO.fullmatch(cell))


def _are_names(cells: list[str], rows: list[str], separator: str) -> bool:
    """Return whether the cells of the first line name the columns of the rows behind it."""
    texts = [place for place, cell in enumerate(cells) if not is_value(cell)]
    numbers = [cell for cell in cells if _is_number(cell)]
    if not texts or not numbers:
        return bool(texts)
    if not all(cell.isdigit() for cell in numbers):
        return False
    parsed = (row.split() for row in rows) if separator == " " else csv.reader(rows, delimiter=separator)
    below = [row[place].strip() for row in parsed for place in texts if place < len(row)]
    return not below or any(map(_is_number, below))


def is_above(line: str) -> bool:
    """Return whether a line before the first row is blank, or a comment."""
    return not line.strip() or bool(COMMENT_ABOVE.match(line))


def dialect_of(lines: Sequence[str]) -> Dialect | None:
    """Return the look of a file by its first lines; None if they have no row and no names.

    Raises:
        csv.Error: if a quote is out of place.
    """
    comments, first = [], 0
    while first < len(lines) and is_above(lines[first]):
        if lines[first].strip():
            comments.append(first)
        first += 1
    if first == len(lines):
        return None
    rows = [line for line in lines[first:] if line.strip() and not COMMENT.match(line)]
    separator = _separator(rows)
    cells = cells_of(lines[first], separator)
    names, named_by = (cells, first + 1) if _are_names(cells, rows[1:], separator) else ([], 0)
    skipped = named_by or first
    if not names and comments:
        text = COMMENT_ABOVE.sub("", lines[comments[-1]], count=1).strip()
        above = cells_of(text, separator)
        if len(above) == len(cells) and not all(map(is_value, above)):
            names, named_by = above, comments[-1] + 1
    said = [lines[number] for number in comments]
    names, width = _channels(said, names, len(cells)), len(cells)
    values = rows[1:] if named_by == first + 1 else rows
    comma = separator != "," and any(DECIMAL_COMMA.search(row) for row in values)
    return Dialect(separator, comma, names, named_by, skipped, width, _rate(said))


def _separator(rows: list[str]) -> str:
    """Return the separator of the first rows; the very first may name the columns."""
    # Spaces behind another separator are no separators of their own.
    bare = re.sub(r"([,;])[ \t]+", r"\1", re.sub(r'"[^"]*"', "q", rows[0]).strip())
    found = next((mark for mark in "\t;," if mark in bare), None)
    if found == ",":
        numbers = [cell.split() for cell in rows[-1].split(",")]
        if any(len(cell) > 1 and all(map(is_value, cell)) for cell in numbers):
            return " "
    elif found is None and len(bare.split()) > 1:
        return " "
    return found or ","


def _channels(comments: list[str], names: list[str], width: int) -> list[str]:
    """Return the names of the columns, from a comment where a header says only that they are logic."""
    said = next((match[1] for match in map(_CHANNELS.match, comments) if match), None)
    if said is None or not all(name.lower() == "logic" for name in names[-1:]):
        return names
    channels = [name.strip() for name in said.split(",")]
    before = [*names[: width - len(channels)]] if names else [""] * (width - len(channels))
    return before + channels if len(before) + len(channels) == width else names


def _rate(comments: list[str]) -> float | None:
    match = next(filter(None, map(_RATE.match, comments)), None)
    return hertz_of(match[1]) if match else None
