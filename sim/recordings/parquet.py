"""Parquet files as tables: their columns are read in batches of rows."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from .error import RecordingError, plain, readable
from .table import CHUNK, Chunk, Table, of_numbers


class Parquet(Table):
    """A Parquet file.

    Args:
        name: the file, for messages.
        path: the file.

    Raises:
        ModuleNotFoundError: without the extra `data`.
        RecordingError: if it cannot be read.
    """

    word, form = "row", "Parquet"

    def __init__(self, name: str, path: str | Path):
        try:
            import pyarrow.parquet  # noqa: PLC0415  (it comes with an extra)
        except ModuleNotFoundError:
            raise ModuleNotFoundError("nothing reads Parquet", name="pyarrow") from None
        self.name = self.head = name
        with readable(name, self.form):
            self._file = pyarrow.parquet.ParquetFile(path)
            self.names = list(self._file.schema_arrow.names)
        self.width = len(self.names)
        if not self.names:
            raise RecordingError(f"{name}: has no columns")

    def chunks(self, places: Sequence[int]) -> Iterator[Chunk]:
        wanted, first = [self.names[place] for place in places], 1
        batches = self._file.iter_batches(CHUNK, columns=wanted)
        while True:
            with readable(self.name, self.form):
                batch = next(batches, None)
                if batch is None:
                    return
                columns = [self._numbers(batch.column(name), name, first) for name in wanted]
            yield Chunk(range(first, first + batch.num_rows), columns)
            first += batch.num_rows

    def _numbers(self, column, name: str, first: int) -> np.ndarray | list[str]:
        """Return the values of a column of a batch."""
        if column.null_count:
            row = first + column.is_null().to_numpy(zero_copy_only=False).argmax()
            raise RecordingError(f"{self.at(row)}, column {plain(name)}: must have a value, not null")
        return of_numbers(column.to_numpy(zero_copy_only=False))
