"""The form of a file, by its first bytes: text, NumPy, MATLAB, Parquet, or a capture of sigrok or as VCD."""

import zipfile
from collections.abc import Callable
from pathlib import Path

from ...model.runtime.regular_file import opened
from .arrays import npy_table, numpy_table
from .capture import Capture
from .error import ACCEPTED, RecordingError, readable
from .matlab import matlab_table
from .parquet import Parquet
from .sigrok import Sigrok
from .table import Table
from .text import Text
from .vcd_file import Vcd

HEAD = 512
VCD_WORDS = (b"$date", b"$version", b"$timescale", b"$comment", b"$scope")


def source_of(name: str, path: str | Path, progress: Callable[[int], None] | None = None) -> Table | Capture:
    """Return what reads a file.

    Args:
        name: the file, for messages.
        path: the file.
        progress: function called with the number of bytes of a text that are read.

    Raises:
        ModuleNotFoundError: if the form needs an extra that is not installed.
        RecordingError: if the file cannot be read, or is of another form.
    """
    try:
        with opened(path) as file:
            head = file.read(HEAD)
    except OSError:
        return Text(name, path, progress)  # which says what is wrong
    of_bytes = next((form for begin, form in FORMS.items() if head.startswith(begin)), None)
    if of_bytes is None and Path(path).suffix.lower() == ".mat":
        of_bytes = matlab_table
    if of_bytes is None and head.lstrip().startswith(VCD_WORDS):
        of_bytes = Vcd
    return Text(name, path, progress) if of_bytes is None else of_bytes(name, path)


def _of_zip(name: str, path: str | Path) -> Table | Capture:
    with readable(name, "a ZIP"), zipfile.ZipFile(path) as archive:
        members = archive.namelist()
    if "metadata" in members:
        return Sigrok(name, path)
    if members and all(member.endswith(".npy") for member in members):
        return numpy_table(name, path)
    if any(member.startswith("xl/") for member in members):
        raise RecordingError(f"{name}: is a workbook of a spreadsheet: save the sheet as CSV")
    raise RecordingError(f"{name}: is a ZIP of other files: unpack it; must be {ACCEPTED}")


FORMS: dict[bytes, Callable[[str, str | Path], Table | Capture]] = {
    b"PK\x03\x04": _of_zip,
    b"\x93NUMPY": npy_table,
    b"MATLAB 5": matlab_table,
    b"MATLAB 7": matlab_table,
    b"PAR1": Parquet,
}
"""The reader of a file, by the file's first bytes."""
