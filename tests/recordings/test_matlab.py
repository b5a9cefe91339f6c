"""MATLAB files: those of another version, damaged ones, and one that ends the process that reads it."""

import io
import random
import struct
from contextlib import suppress

import numpy as np
import pytest
import scipy.io

from hardwall.sim.recordings.error import RecordingError
from stimuli.forms import COUNTS


def mat(**arrays):
    file = io.BytesIO()
    scipy.io.savemat(file, arrays)
    return file.getvalue()


CONTENT = mat(time_s=np.arange(500) / 1000, counts=COUNTS)


def test_version_7_3_is_refused_with_the_way_on(refused):
    content = b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM" + bytes(400)
    said = "is a MATLAB file of version 7.3, which is HDF5: save it with -v7, or as CSV"
    assert said in refused(content, file="spindle.mat")


def test_version_4_is_told_by_the_name(read):
    file = io.BytesIO()
    scipy.io.savemat(file, {"time_s": np.arange(500) / 1000, "counts": COUNTS}, format="4")
    assert (read(file.getvalue(), file="spindle.mat").counts == COUNTS).all()


def test_a_variable_may_have_any_name(read):
    for name in ("file", "names", "column_0", "kwds"):
        assert (read(mat(**{"time_s": np.arange(500) / 1000, name: COUNTS}), name, file="a.mat").counts == COUNTS).all()


def test_a_file_without_arrays_is_refused(refused):
    assert "has no array of numbers, one value a sample" in refused(mat(x=3.0, y="text"), file="spindle.mat")


@pytest.mark.parametrize("length", [0, 3, 40_000_000, 2**31 - 1])
def test_a_wrong_length_is_refused(read, length):
    """Some of these end the process that reads them."""
    with suppress(RecordingError):
        read(CONTENT[:132] + struct.pack("<I", length) + CONTENT[136:], file="spindle.mat")


def test_a_damaged_file_is_read_or_refused(read):
    draw = random.Random(1)
    for _ in range(5):
        broken = bytearray(CONTENT)
        for _ in range(20):
            broken[draw.randrange(128, len(broken))] = draw.randrange(256)
        with suppress(RecordingError):
            read(bytes(broken), file="spindle.mat")
