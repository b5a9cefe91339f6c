"""A file of samples that grows line by line, and has whole lines whenever its program ends."""

import os
from pathlib import Path
from typing import Any

from .samples import COLUMNS, Sample


class SampleFile:
    """A new file of comma-separated values: a line of the names of its columns, then a line a sample.

    A line goes to the system whole, at once: a program that is ended, in whatever way, leaves whole lines. What is
    missing is in the column `missed` of the line behind it.

    Args:
        path: the file.

    Raises:
        OSError: if there is such a file, or it cannot be written; the message is one line that names it.
    """

    def __init__(self, path: Path):
        self._path, self._size = path, 0
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_APPEND | os.O_CLOEXEC, 0o666)
        except OSError as error:
            raise self._failed(error.strerror) from None
        self._add(",".join(COLUMNS))

    def add(self, sample: Sample) -> None:
        """Add a sample.

        Raises:
            OSError: if the file cannot be written; it then ends with the line before.
        """
        self._add(",".join(map(_cell, sample.row.values())))

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def _add(self, line: str) -> None:
        data = f"{line}\n".encode("ascii")
        try:
            written = os.write(self._file, data)
            if written < len(data):
                # The disk is full: the piece of a line is taken back.
                os.ftruncate(self._file, self._size)
        except OSError as error:
            raise self._failed(error.strerror) from None
        if written < len(data):
            raise self._failed("the disk is full")
        self._size += len(data)

    def _failed(self, reason: str | None) -> OSError:
        return OSError(f"{self._path}: cannot be written ({reason})")


def _cell(value: Any) -> str:
    """Return a value as a cell: empty for None, 1 and 0 for what is or is not, several names with spaces between."""
    if value is None:
        return ""
    if isinstance(value, bool):
        return f"{value:d}"
    return " ".join(value) if isinstance(value, list) else f"{value}"
