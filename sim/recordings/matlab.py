"""MATLAB files of version 4 to 7 as tables.

A process of its own reads the file: SciPy's reader ends its process where some damaged files have a wrong length. The
process leaves the columns as arrays of NumPy in a temporary folder.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from .arrays import Arrays, check_size, columns_of
from .error import RecordingError, readable

REFUSED = 3
"""The exit code of a process that says why it refuses the file."""


def matlab_table(name: str, path: str | Path) -> Arrays:
    """Return the table of a MAT file.

    Raises:
        RecordingError: if it cannot be read, or has no column.
    """
    check_size(name, Path(path).stat().st_size)
    with tempfile.TemporaryDirectory() as folder:
        left = Path(folder) / "columns.npz"
        words = [sys.executable, "-m", __name__, str(Path(path).absolute()), str(left)]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        if done.returncode == REFUSED:
            raise RecordingError(f"{name}: {done.stdout.strip()}")
        if done.returncode:
            raise RecordingError(f"{name}: cannot be read as a MATLAB file (it is damaged)")
        with np.load(left, allow_pickle=False) as arrays:
            columns = {str(key): arrays[f"column_{place}"] for place, key in enumerate(arrays["names"])}
    return Arrays(name, "MATLAB arrays", columns)


def read(path: str, left: str) -> str:
    """Write the columns of a MAT file; return why it is refused, or an empty text."""
    import scipy.io  # noqa: PLC0415  (this process alone needs it)

    try:
        with readable("", "a MATLAB file"):
            found = scipy.io.loadmat(path, struct_as_record=False, squeeze_me=True)
            kept = {key: value for key, value in found.items() if not key.startswith("__")}
            columns = {key: _plain(column) for key, column in columns_of(kept).items()}
    except RecordingError as error:
        return str(error).removeprefix(": ")
    if not columns:
        return "has no array of numbers, one value a sample"
    arrays = {f"column_{place}": column for place, column in enumerate(columns.values())}
    np.savez(left, names=np.array(list(columns)), **arrays)
    return ""


def _plain(column: np.ndarray) -> np.ndarray:
    return column.astype(str) if column.dtype.kind == "O" else column


if __name__ == "__main__":
    with open(sys.argv[1], "rb") as opened:
        is_hdf5 = opened.read(10) == b"MATLAB 7.3"
    of_hdf5 = "is a MATLAB file of version 7.3, which is HDF5: save it with -v7, or as CSV"
    if refused := of_hdf5 if is_hdf5 else read(*sys.argv[1:]):
        print(refused)
        sys.exit(REFUSED)
