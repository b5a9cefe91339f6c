"""Files that hold arrays: NumPy, MATLAB and Parquet, and those that cannot be read."""

import io
import zipfile

import numpy as np
import pytest
import scipy.io

from hardwall.sim.recordings import arrays
from stimuli.forms import COUNTS, SIZE_RAD

TIMES = np.arange(500) / 1000


def npz(**arrays):
    file = io.BytesIO()
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def mat(**arrays):
    file = io.BytesIO()
    scipy.io.savemat(file, arrays)
    return file.getvalue()


def parquet(**columns):
    pyarrow = pytest.importorskip("pyarrow", reason="the extra [data] is not installed")
    parquet = pytest.importorskip("pyarrow.parquet", reason="the extra [data] is not installed")
    file = io.BytesIO()
    parquet.write_table(pyarrow.table(columns), file)
    return file.getvalue()


FORMS = pytest.mark.parametrize(
    ("form", "file"), [(npz, "spindle.npz"), (mat, "spindle.mat"), (parquet, "spindle.parquet")]
)


@FORMS
@pytest.mark.parametrize("kind", [np.int64, np.int16, np.float64])
def test_columns_are_read(read, form, file, kind):
    found = read(form(time_s=TIMES, counts=COUNTS.astype(kind)), file=file)
    assert (found.counts == COUNTS).all()
    assert (found.rate_hz, found.column) == (1000.0, "counts")


@FORMS
def test_angles_and_whole_times_are_read(read, form, file):
    found = read(form(t=np.arange(500) * 2, angle=COUNTS * SIZE_RAD), "angle", file=file, unit="rad", count=SIZE_RAD)
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 500.0


@FORMS
def test_what_is_no_count_is_refused_by_its_row(refused, form, file):
    counts = COUNTS.astype(float)
    counts[30] = np.nan
    assert "row 31, column counts: a count must be a whole number" in refused(
        form(time_s=TIMES, counts=counts), file=file
    )
    assert "column must be one of time_s, counts, not 'x'" in refused(form(time_s=TIMES, counts=COUNTS), "x", file=file)


@FORMS
def test_a_file_cut_short_is_refused(refused, form, file):
    content = form(time_s=TIMES, counts=COUNTS)
    assert "spindle" in refused(content[: len(content) // 2], file=file)


def test_unsigned_64_bit_counters_wrap(read):
    counts = (np.arange(-5, 95).astype(np.int64)).view(np.uint64)
    found = read(npz(time_s=TIMES[:100], counts=counts), counter_bits=64, file="spindle.npz")
    assert np.diff(found.counts).tolist() == [1] * 99


def test_a_table_in_an_array_has_numbered_columns(read):
    table = np.column_stack([TIMES, COUNTS])
    assert (read(npz(log=table), "log.2", time="log.1", file="spindle.npz").counts == COUNTS).all()
    assert (read(npz(log=table.T), "log.2", time="log.1", file="spindle.npz").counts == COUNTS).all()
    file = io.BytesIO()
    np.save(file, table)
    found = read(file.getvalue(), "2", time="1", time_unit="s", file="spindle.npy")
    assert (found.counts == COUNTS).all()
    fields = np.zeros(500, [("time_s", float), ("counts", int)])
    fields["time_s"], fields["counts"] = TIMES, COUNTS
    file = io.BytesIO()
    np.save(file, fields)
    assert (read(file.getvalue(), file="spindle.npy").counts == COUNTS).all()


def test_structures_of_simulink_have_their_own_times(read):
    theta = {"time": 60 + TIMES, "signals": {"values": COUNTS * SIZE_RAD, "label": ""}, "blockName": "log"}
    found = read(mat(Theta=theta, gain=3.0), "Theta", file="spindle.mat", unit="rad", count=SIZE_RAD)
    assert (found.counts == COUNTS).all()
    assert (found.rate_hz, found.start_s) == (1000.0, 60.0)
    assert "times in column Theta.time (s), 1000 Hz" in found.notes


def test_columns_of_other_lengths_are_refused(refused):
    said = refused(npz(time_s=TIMES[:-1], counts=COUNTS), file="spindle.npz")
    assert "columns must have as many rows as each other, not counts 500 and time_s 499" in said


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"PAR1" + bytes(50), "cannot be read as Parquet ("),
        (b"\x93NUMPY\x01\x00v\x00{", "cannot be read as a NumPy array ("),
    ],
)
def test_files_that_cannot_be_read(refused, content, said):
    if content.startswith(b"PAR1"):
        pytest.importorskip("pyarrow", reason="the extra [data] is not installed")
    assert said in refused(content, file="spindle.bin")


def test_arrays_with_objects_are_not_run(refused):
    """An array of objects is a program."""
    content = npz(counts=np.array([{}, {}], object))
    assert "cannot be read as NumPy arrays" in refused(content, file="spindle.npz")


def test_archives_of_other_files_are_refused(refused):
    for member, said in (
        ("xl/workbook.xml", "is a workbook of a spreadsheet: save the sheet as CSV"),
        ("a.csv", "unpack it"),
    ):
        file = io.BytesIO()
        with zipfile.ZipFile(file, "w") as archive:
            archive.writestr(member, "1")
        assert said in refused(file.getvalue(), file="spindle.zip")


def npy(array):
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()


@pytest.mark.parametrize("shape", [(), (3, 4, 5), (1, 1, 1, 1)])
def test_an_array_of_other_dimensions_is_refused(refused, shape):
    said = refused(npy(np.zeros(shape)), "1", rate_hz=1000, file="spindle.npy")
    assert said.endswith(f"must be an array of 1 or 2 dimensions, not {len(shape)}")


@pytest.mark.parametrize("kind", ["datetime64[ms]", "timedelta64[ns]", "timedelta64[us]"])
@pytest.mark.parametrize(("unit", "what"), [("counts", "counts"), ("rad", "values in rad")])
def test_times_are_no_counts(refused, kind, unit, what):
    content = npz(counts=np.arange(10).astype(kind))
    size = {"count": 0.1} if unit == "rad" else {}
    said = refused(content, rate_hz=1000, file="spindle.npz", unit=unit, **size)
    assert said.endswith(f"column counts: must have {what}, not times")


@pytest.mark.parametrize("kind", ["ns", "us", "ms"])
def test_durations_are_times(read, kind):
    times = (np.arange(500) * np.timedelta64(1, "ms")).astype(f"timedelta64[{kind}]")
    found = read(npz(time_ms=times, counts=COUNTS), file="spindle.npz")
    assert found.rate_hz == 1000.0
    assert "times in column time_ms (s), 1000 Hz" in found.notes


@pytest.mark.parametrize(("form", "file"), [(npz, "spindle.npz"), (mat, "spindle.mat"), (npy, "spindle.npy")])
def test_files_that_would_fill_the_memory_are_refused(read, refused, monkeypatch, form, file):
    """Of a compressed file, what it unpacks to counts."""
    columns = {} if form is npy else {"counts": COUNTS, "time_s": TIMES}
    content = npy(COUNTS) if form is npy else form(**columns)
    size = COUNTS.nbytes if form is npy else len(content) if form is mat else 2 * (128 + COUNTS.nbytes)
    for most in (size, size - 1):
        monkeypatch.setattr(arrays, "BYTES_MAX", most)
        how = {"column": "1" if form is npy else "counts", "file": file, "rate_hz": 1000.0}
        if most == size:
            assert (read(content, **how).counts == COUNTS).all()
        else:
            assert f"cannot be read (it has more than {most / 1e6:g} MB)" in refused(content, **how)


@pytest.mark.parametrize(("form", "file"), [(npz, "spindle.npz"), (mat, "spindle.mat"), (npy, "spindle.npy")])
def test_columns_are_bounded(read, refused, monkeypatch, form, file):
    monkeypatch.setattr(arrays, "COLUMNS_MAX", 2)
    table = np.column_stack([COUNTS, COUNTS + 1, COUNTS + 2])
    names = ("1", "2", "3") if form is npy else ("x.1", "x.2", "x.3")
    content = npy(table) if form is npy else form(x=table)
    if form is mat:  # read by a process of its own, which has the true bound
        content = form(x=np.tile(np.arange(1200)[:, None], 1001))
        names = ("x.1", "x.1000", "x.1001")
    assert len(read(content, names[1], 1000.0, file=file).counts) >= 500
    assert "column must be " in refused(content, names[2], 1000.0, file=file)
