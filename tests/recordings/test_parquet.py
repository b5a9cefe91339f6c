"""Parquet files: batches, times, missing values, damage, and the extra that reads them."""

import io
import random
import sys
from contextlib import suppress

import numpy as np
import pytest

from hardwall.sim.recordings import parquet as module
from hardwall.sim.recordings.error import RecordingError
from stimuli.forms import COUNTS

pyarrow = pytest.importorskip("pyarrow", reason="the extra [data] is not installed")
written = pytest.importorskip("pyarrow.parquet", reason="the extra [data] is not installed")
TIMES = np.arange(500) / 1000


def parquet(**columns):
    file = io.BytesIO()
    written.write_table(pyarrow.table(columns), file)
    return file.getvalue()


def test_batches_join_at_their_ends(read, monkeypatch):
    monkeypatch.setattr(module, "CHUNK", 7)
    found = read(parquet(time_s=TIMES, counts=COUNTS), file="spindle.parquet")
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 1000.0


def test_timestamps_and_texts_are_read(read):
    moments = np.datetime64("2024-05-01T12:00:00", "us") + np.arange(500) * np.timedelta64(1000, "us")
    found = read(parquet(time=moments, counts=[str(count) for count in COUNTS]), file="spindle.parquet")
    assert (found.counts == COUNTS).all()
    assert (found.rate_hz, found.start_s) == (1000.0, 1714564800.0)


def test_missing_values_are_refused_by_their_row(refused):
    counts = [*COUNTS.tolist()]
    counts[7] = None
    said = refused(parquet(time_s=TIMES, counts=counts), file="spindle.parquet")
    assert "row 8, column counts: must have a value, not null" in said


def test_a_damaged_file_is_read_or_refused(read):
    content, draw = parquet(time_s=TIMES, counts=COUNTS), random.Random(1)
    for _ in range(200):
        broken = bytearray(content)
        for _ in range(3):
            broken[draw.randrange(4, len(broken))] = draw.randrange(256)
        with suppress(RecordingError):
            read(bytes(broken), file="spindle.parquet")


def test_without_the_extra_its_module_is_named(read, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow.parquet", None)
    with pytest.raises(ModuleNotFoundError) as error:
        read(b"PAR1" + bytes(50), file="spindle.parquet")
    assert error.value.name == "pyarrow"
