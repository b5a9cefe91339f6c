"""Named arrays as a table, and the files of NumPy that hold them, NPZ and NPY.

Every one-dimensional array is a column by its name. A two-dimensional array `x` has the columns `x.1`, `x.2` and so on,
along its shorter side. The members of a structure `s` are `s.member`. A structure `s` of Simulink, with its times and
one signal, has the columns `s` and `s.time`.
"""

import zipfile
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

import numpy as np

from .error import RecordingError, readable
from .table import Arrays

BYTES_MAX = 2 * 10**9
"""The largest file that is read whole, and the most that its arrays may take."""
COLUMNS_MAX = 1000
"""The most columns of a file, its first ones."""


def check_size(name: str, size: int) -> None:
    """Raise RecordingError for a file, or arrays, that would fill the memory."""
    if size > BYTES_MAX:
        raise RecordingError(f"{name}: cannot be read (it has more than {BYTES_MAX / 1e6:g} MB)")


def numpy_table(name: str, path: str | Path) -> Arrays:
    """Return the table of an NPZ or NPY file.

    Raises:
        RecordingError: if it cannot be read, or has no column.
    """
    with readable(name, "NumPy arrays"):
        _check_members(name, path)
        with np.load(path, allow_pickle=False) as file:
            return table_of(name, "NumPy arrays", {key: file[key] for key in file.files})


def _check_members(name: str, path: str | Path) -> None:
    with zipfile.ZipFile(path) as archive:
        check_size(name, sum(member.file_size for member in archive.infolist()))


def npy_table(name: str, path: str | Path) -> Arrays:
    """Return the table of an NPY file, whose columns have numbers, or the names of its fields."""
    with readable(name, "a NumPy array"):
        array = np.load(path, mmap_mode="r", allow_pickle=False)
        check_size(name, array.nbytes)
    if array.dtype.names:
        return table_of(name, "a NumPy array", {key: np.array(array[key]) for key in array.dtype.names})
    if array.ndim not in (1, 2):
        raise RecordingError(f"{name}: must be an array of 1 or 2 dimensions, not {array.ndim}")
    columns = list(_across(np.array(array)))[:COLUMNS_MAX]
    return Arrays(name, "a NumPy array", {str(place + 1): column for place, column in enumerate(columns)}, names=False)


def _across(array: np.ndarray) -> np.ndarray:
    """Return the columns of an array of one or two dimensions; with two, columns are counted along the shorter side."""
    if array.ndim == 1:
        return array[None, :]
    return array.T if array.shape[0] >= array.shape[1] else array


def table_of(name: str, form: str, found: dict[str, object]) -> Arrays:
    """Return the table of named values: see `columns_of`.

    Raises:
        RecordingError: if it has no column.
    """
    columns = columns_of(found)
    if not columns:
        raise RecordingError(f"{name}: has no array of numbers, one value a sample")
    return Arrays(name, form, columns)


def columns_of(found: dict[str, object]) -> dict[str, np.ndarray]:
    """Return the columns of named values. Arrays of numbers, times or texts have columns; other values have none."""
    columns = (pair for key, value in found.items() for pair in _columns(key, value))
    return dict(islice(columns, COLUMNS_MAX))


def _columns(name: str, value: object) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the columns of a value by their names."""
    if hasattr(value, "_fieldnames"):
        if {"time", "signals"} <= set(value._fieldnames) and hasattr(value.signals, "values"):
            yield from _columns(name, value.signals.values)
            yield from _columns(f"{name}.time", value.time)
            return
        for member in value._fieldnames:
            yield from _columns(f"{name}.{member}", getattr(value, member))
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iufbMmUSO" and value.size > 1:
        if value.dtype.kind == "O" and not all(isinstance(each, str) for each in value.flat):
            return
        if value.ndim == 1:
            yield name, value
        elif value.ndim == 2:
            yield from ((f"{name}.{place + 1}", column) for place, column in enumerate(_across(value)))
