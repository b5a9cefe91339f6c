"""Recordings: their counts and rates, and one line for every fault that says where it is and what is accepted."""

import re
from dataclasses import replace

import numpy as np
import pytest

from hardwall.sim.recordings import load as load_module
from hardwall.sim.recordings import text
from hardwall.sim.recordings.error import RecordingError
from hardwall.sim.recordings.load import load
from hardwall.sim.recordings.recording import EdgeRecord, Reading, Recording

GOOD = ["0.000,5", "0.001,6", "0.002,4", "0.003,4"]


def test_counts_rate_and_times_are_read(read):
    found = read(GOOD)
    assert found.counts.dtype == np.int64
    assert found.counts.tolist() == [5, 6, 4, 4]
    assert found.rate_hz == 1000.0
    assert found.time_s.tolist() == [0.0, 0.001, 0.002, 0.003]
    assert (found.column, found.file.endswith("spindle.csv")) == ("counts", True)


def test_other_columns_may_hold_anything(read):
    recording = read(['1.5,5,"a, b"', "1.6,6,", "1.7,-4,nan"], header=' time_s , counts,"no, note"')
    assert recording.counts.tolist() == [5, 6, -4]
    assert recording.start_s == 1.5
    assert recording.rate_hz == 10.0


@pytest.mark.parametrize(
    ("content", "rate_hz", "column"),
    [
        ("5\n6\n4\n", 10, "1"),
        ("angle\n5\n6\n4\n", 10, "angle"),
        ("x,time_ms\n5,0\n6,100\n4,200\n", None, "x"),
    ],
    ids=["no names", "one name", "beside the times"],
)
def test_the_only_column_has_the_counts(tmp_path, content, rate_hz, column):
    path = tmp_path / "spindle.csv"
    path.write_text(content)
    found = load(path, rate_hz=rate_hz)
    assert (found.counts.tolist(), found.rate_hz, found.column) == ([5, 6, 4], 10.0, column)
    with pytest.raises(RecordingError, match="a capture"):
        load(path, reading=Reading(channels=("1", "1")))


def test_the_only_column_may_have_times_of_its_own(tmp_path):
    path = tmp_path / "spindle.csv"
    path.write_text("x.time,x\n0,5\n0.01,6\n0.02,4\n")
    found = load(path)
    assert (found.counts.tolist(), found.rate_hz, found.column) == ([5, 6, 4], 100.0, "x")


@pytest.mark.parametrize("heads", ["seconds,nanoseconds", "timestamp,time_s"])
def test_times_are_no_counts(tmp_path, heads):
    path = tmp_path / "spindle.csv"
    path.write_text(f"{heads}\n1,0\n2,1000\n3,2000\n")
    with pytest.raises(RecordingError, match="must have a column of counts beside its times"):
        load(path)


def test_a_file_that_states_its_sample_rate_has_channels(tmp_path):
    path = tmp_path / "logic.csv"
    path.write_text("; Samplerate: 1 kHz\nD0\n0\n1\n0\n1\n")
    with pytest.raises(RecordingError, match="the channels A and B must be given"):
        load(path, rate_hz=1e5)


@pytest.mark.parametrize("columns", [1, 2])
def test_other_columns_without_a_name_given_are_channels(tmp_path, columns):
    path = tmp_path / "spindle.csv"
    path.write_text(
        "time_s" + ",x,y" * (columns - 1) + "\n" + "".join(f"{k}{',1,0' * (columns - 1)}\n" for k in range(3))
    )
    said = "must have a column of counts beside its times" if columns == 1 else "is a capture of edges"
    with pytest.raises(RecordingError, match=said):
        load(path)


@pytest.mark.parametrize(
    "content",
    ["counts\r\n1\r\n2\r\n", "\ufeffcounts\n1\n2\n", "counts\n1\n2", "counts\n1\n2\n\n\n", "counts\n +1 \n2.0\n"],
    ids=["crlf", "byte order mark", "no last newline", "blank lines at the end", "whole numbers in other forms"],
)
def test_forms_of_text_that_are_accepted(read, content):
    assert read(content, rate_hz=10).counts.tolist() == [1, 2]


@pytest.mark.parametrize(
    "cell", ["2305843009213693951", "-2305843009213693952", "12e2", "-0", "1e18", "+000000000000000000017"]
)
def test_whole_counts_are_exact(read, cell):
    exact = int(cell) if "e" not in cell else int(float(cell))
    assert read(f"counts\n{cell}\n{cell}\n", rate_hz=1).counts.tolist() == [exact, exact]


def test_a_32_bit_counter_that_wrapped_is_unwrapped(read):
    top = 2**31 - 1
    assert read(f"counts\n{top - 1}\n{-top}\n{top}\n", rate_hz=1).counts.tolist() == [top - 1, top + 2, top]
    assert read("counts\n1\n4294967295\n0\n", rate_hz=1).counts.tolist() == [1, -1, 0]
    assert read(f"counts\n0\n{top}\n", rate_hz=1).counts.tolist() == [0, top]


@pytest.mark.parametrize(
    ("cell", "shown"),
    [
        ("1908a", "'1908a'"),
        ("nan", "'nan'"),
        ("inf", "'inf'"),
        ("-Infinity", "'-Infinity'"),
        ("", "''"),
        ("1.5", "'1.5'"),
        ("1e-3", "'1e-3'"),
        ("0x10", "'0x10'"),
        ("1_000", "'1_000'"),
        ("٣", "'٣'"),
        ("2305843009213693952", "'2305843009213693952'"),
        ("-2305843009213693953", "'-2305843009213693953'"),
        ("1e999999999", "'1e999999999'"),
        ("7" * 5000, "'777"),
        ('"1\n2"', r"'1\n2'"),
    ],
)  # fmt: skip
def test_a_cell_that_is_no_count_is_refused(refused, cell, shown):
    line = 3 if "\n" not in cell else 4
    message = refused(["0.000,5", f"0.001,{cell}", "0.002,5"])
    assert f"line {line}, column counts: a count must be a whole number of -2**61 to 2**61 - 1, not {shown}" in message
    assert len(message) < 300


def test_counts_beyond_the_span_of_32_bits_are_refused(refused):
    message = refused("counts\n-5\n0\n4294967291\n4294967290\n", rate_hz=1)
    assert "line 4, column counts: counts must span less than 2**32, not 4294967296 up to here" in message
    assert "line 3" in refused("counts\n-2305843009213693952\n2305843009213693951\n", rate_hz=1)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"^.*nowhere\.csv: there is no such file; must be a CSV file: .*$"):
        load(tmp_path / "nowhere.csv", "counts")


def test_a_folder_is_not_read(tmp_path):
    with pytest.raises(
        RecordingError, match=rf"^{re.escape(str(tmp_path))}: cannot be read \(.*\); must be a CSV file"
    ):
        load(tmp_path, "counts")


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "is empty; must be a CSV file: UTF-8 text, a header line"),
        (b"\n\n", "is empty; must be"),
        (b"time_s,counts\n0.000,\xff\n", "line 2: is not UTF-8 text; must be a CSV file"),
        (b"\x89PNG\r\n\x1a\n\0\0", "line 1: is not UTF-8 text; must be a CSV file"),
        (b"counts\n1\n\0\0\0\n", "line 3: is binary data; must be a CSV file"),
        ("counts\n1\n".encode("utf-16"), "line 1: is not UTF-8 text"),
        (b'time_s,counts\n0.0,1\n"2\n', "line 3: is not CSV ("),
        (b"time_s,counts\n", "must have at least 2 samples (data lines), not 0"),
        (b"time_s,counts\n0.0,1\n", "must have at least 2 samples (data lines), not 1"),
        (b"time_s,counts\n0.0,1\n0.1,2,3\n", "line 3: must have 2 cells as the header, not 3"),
        (b"time_s,counts\n0.0,1\n0.1\n", "line 3: must have 2 cells as the header, not 1"),
        (b"time_s,counts\n0.0,1\n\n0.1,1\n", "line 3: must have 2 cells as the header, not 0"),
    ],
)
def test_a_file_that_is_no_recording_is_refused(refused, content, said):
    assert said in refused(content)


def test_a_missing_column_lists_the_others(refused):
    assert "line 1: column must be one of time_s, counts, not 'count'" in refused(GOOD, column="count")


def test_a_column_that_is_there_twice_is_refused(refused):
    message = refused(["1,2", "2,2"], header="counts,counts", rate_hz=1)
    assert "line 1: column 'counts' must be there once, not 2 times" in message


def test_without_times_a_rate_must_be_given(refused, read):
    assert "there is no column time_s, so the rate in Hz must be given" in refused("counts\n1\n2\n")
    assert read("counts\n1\n2\n", rate_hz=2500).rate_hz == 2500.0


@pytest.mark.parametrize("rate", [0, -1, 0.09, np.nan, np.inf, 2e9, "10"])
def test_a_rate_that_is_none_is_refused(refused, rate):
    assert "the rate must be 0.1 to 1e+09 Hz, not " in refused("counts\n1\n2\n", rate_hz=rate)


@pytest.mark.parametrize("step", ["1e-12", "1e-300", "1e-999999999", "1e7", "1e300"])
def test_a_rate_of_times_has_the_range_of_a_given_rate(refused, step):
    message = refused(["0,1", f"{step},1"])
    if step in ("1e-12", "1e-300", "1e7"):
        assert "column time_s: times must be those of a rate of 0.1 to 1e+09 Hz, not of " in message
    assert len(message) < 300
    assert "the rate must be 0.1 to 1e+09 Hz, not 1e-07" in refused(GOOD, rate_hz=1e-7)


def test_numbers_of_any_length_are_refused_in_a_short_line(refused):
    digits = "9" * 5000
    message = refused([f"0,{digits}", "1,2"])
    assert "line 2, column counts: a count must be a whole number of -2**61 to 2**61 - 1, not '999" in message
    assert len(message) < 300
    assert len(refused([f"{digits},1", "1,2"])) < 300


def test_a_header_of_any_length_is_echoed_in_part(refused):
    header = ",".join(f"column {number} {'x' * 300}" for number in range(1000))
    message = refused(["0"], header=header)
    assert "column must be one of 'column 0 xxx" in message
    assert message.endswith("992 more, not 'counts'")
    assert len(message) < 900


def test_samples_and_bytes_are_bounded(refused, monkeypatch):
    monkeypatch.setattr(load_module, "SAMPLES_MAX", 3)
    assert "line 5: must have at most 3 samples (data lines)" in refused(GOOD)
    monkeypatch.setattr(text, "BYTES_MAX", 20)
    assert "cannot be read (it has more than 2e-05 MB of text)" in refused(GOOD)


def test_the_digest_is_of_all_that_a_replay_depends_on():
    """Stored results of a recording are found by it."""
    edges = EdgeRecord(1e6, np.array([5, 9]), np.array([1, 2]), 0)
    made = Recording("made.csv", "counts", np.array([0, 1, 2]), 1000.0, 0.5, edges)
    others = [
        replace(made, counts=np.array([0, 1, 3])),
        replace(made, rate_hz=1001.0),
        replace(made, start_s=0.25),
        replace(made, edges=None),
        *(
            replace(made, edges=replace(edges, **change))
            for change in ({"tick_hz": 2e6}, {"ticks": np.array([5, 8])}, {"counts": np.array([-1, 0])}, {"start": 1})
        ),
    ]
    assert len({each.content for each in (made, *others)}) == 1 + len(others)
    for each in (made, others[3]):
        same = replace(each, file="other.csv", column="x", counts=each.counts.astype(np.int16), notes=("said",))
        assert same.content == each.content


def test_what_a_file_has_no_use_for_is_refused(refused):
    """Such options were taken, and changed nothing."""
    assert refused(GOOD, channels=("A", "B")).endswith("is read as counts (--column), so --channels must be absent")
    for content in ("counts\n1\n2\n", "time_s,counts\n0,1\n1,2\n"):
        said = refused(content, rate_hz=1, time="none", time_unit="ms")
        assert said.endswith("is read without times, so --time-unit must be absent")
    levels = "; Samplerate: 1 MHz\nA,B\n0,0\n1,0\n"
    assert refused(levels, None, 1.0, time_unit="s").endswith("is read without times, so --time-unit must be absent")
    assert refused(levels, None, 1.0, gaps="hold").endswith("is a capture of edges, so --gaps must be absent")


@pytest.mark.parametrize("name", ["davinci_L2_02.csv", "davinci_L2_22.csv", "davinci_R5_42.csv"])
def test_the_recordings_are_read(recordings, name):
    path = recordings / name
    for column in ("motor_counts", "output_counts"):
        recording = load(path, column)
        table = np.genfromtxt(path, delimiter=",", names=True)
        assert recording.rate_hz == 1000.0
        assert (recording.counts == table[column]).all()
        assert np.allclose(recording.time_s, table["time_s"], rtol=0, atol=1e-9)
    with pytest.raises(RecordingError, match=r"line 2, column current_a: a count must be a whole number"):
        load(path, "current_a")
