"""The error of a recording that is refused, and how its message names files and columns."""

import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

from ...model.checks import shown

NAME_MAX = 200
"""The most characters of the name of a column or of a file in a message."""
ACCEPTED = (
    "a CSV file: UTF-8 text, a header line with the columns' names, one sample a line; or a file of NumPy, MATLAB or "
    "Parquet; or an edge capture as .sr, .vcd or CSV"
)


class RecordingError(ValueError):
    """A recording is refused. The message is one line: the file, the place in it, and the accepted values."""


def plain(text: str) -> str:
    """Return the name of a file or of a column for a message, without quotes where none are needed."""
    return text if text.isprintable() and 0 < len(text) <= NAME_MAX else shown(text)


@contextmanager
def readable(name: str, form: str) -> Iterator[None]:
    """Make a RecordingError, which names the file and its form, of what a library raises for a damaged file."""
    try:
        yield
    except RecordingError:
        raise
    except DAMAGED as error:
        said = (str(error) or type(error).__name__).splitlines()[0]
        raise RecordingError(f"{name}: cannot be read as {form} ({said})") from None


DAMAGED = (
    *(OSError, ValueError, TypeError, RuntimeError, EOFError, LookupError, ArithmeticError, AttributeError),
    *(zipfile.BadZipFile, zlib.error, struct.error),
)
"""The errors that libraries raise for a damaged file: hardly any library has its own error for it."""
