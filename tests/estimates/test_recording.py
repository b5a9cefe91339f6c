"""Recordings: their counts and rates, and one line for every fault that says where it is and what is accepted."""

import re

import numpy as np
import pytest

from hardwall.sim.estimates import recording
from hardwall.sim.estimates.recording import RecordingError, load

GOOD = ["0.000,5", "0.001,6", "0.002,4", "0.003,4"]


@pytest.fixture
def read(tmp_path):
    """Return a function that loads a column of a file of the given text, bytes or lines after a header."""

    def load_text(content, column="counts", rate_hz=None, header="time_s,counts"):
        path = tmp_path / "spindle.csv"
        if isinstance(content, list):
            content = "\n".join([header, *content]) + "\n"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return load(path, column, rate_hz)

    return load_text


@pytest.fixture
def refused(read):
    """Return a function that gives the message for a refused file, which is always one line that names the file."""

    def message(*args, **kwargs):
        with pytest.raises(RecordingError) as caught:
            read(*args, **kwargs)
        text = str(caught.value)
        assert "\n" not in text
        assert "spindle.csv" in text
        return text

    return message


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
    "text",
    ["counts\r\n1\r\n2\r\n", "\ufeffcounts\n1\n2\n", "counts\n1\n2", "counts\n1\n2\n\n\n", "counts\n +1 \n2.0\n"],
    ids=["crlf", "byte order mark", "no last newline", "blank lines at the end", "whole numbers in other forms"],
)
def test_forms_of_text_that_are_accepted(read, text):
    assert read(text, rate_hz=10).counts.tolist() == [1, 2]


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


@pytest.mark.parametrize("rate", [0, -1, np.nan, np.inf, 2e9, "10"])
def test_a_rate_that_is_none_is_refused(refused, rate):
    assert "the rate must be 1e-06 to 1e+09 Hz, not " in refused("counts\n1\n2\n", rate_hz=rate)


def stamped(times, form="{:.3f}"):
    return [f"{form.format(t)},{k}" for k, t in enumerate(times)]


@pytest.mark.parametrize(
    ("times", "form", "rate"),
    [
        (np.arange(5000) / 1000, "{:.3f}", 1000),
        (np.arange(5000) / 3000, "{:.6f}", 3000),
        (np.arange(5000) / 3000, "{:.4f}", 3000),
        (np.arange(5000) * 0.001, "{!r}", 1000),
        (np.cumsum(np.full(5000, 0.001)), "{!r}", 1000),
        (1.7e9 + np.arange(5000) / 1000, "{!r}", 1000),
        (1.7e9 + np.arange(5000) / 1000, "{:.6f}", 1000),
        (np.arange(500), "{:.0f}", 1),
        (np.arange(500) / 1000 - 0.25, "{:.3e}", 1000),
    ],
)
def test_the_rate_is_found_from_uniform_times(read, times, form, rate):
    """The rate is as exact as the stamps: the first and the last are off by at most half a unit."""
    lines = stamped(map(float, times), form)
    decimals = 6 if "e" in form else max(len(line.split(",")[0].partition(".")[2]) for line in lines)
    whole = times[-1] - times[0]
    unit = max(10.0**-decimals, np.spacing(np.abs(times).max()), 1e-12 * whole)
    found = read(lines).rate_hz
    assert abs(found / rate - 1) <= unit / whole * (1 + 1e-9)
    assert read(lines, rate_hz=rate).rate_hz == rate


@pytest.mark.parametrize("form", ["{:.3f}", "{:.4f}", "{:.6f}", "{!r}"])
@pytest.mark.parametrize("samples", [10, 20_000])
def test_a_lost_sample_is_seen(refused, form, samples):
    times = np.arange(samples) / 1000
    times[samples // 2 :] += 0.001
    message = refused(stamped(map(float, times), form))
    assert f"line {samples // 2 + 2}, column time_s: times must be uniform within" in message
    assert "not go by 0.002 s where 0.001 s is usual" in message
    assert "times must agree with the rate 1000 Hz within" in refused(stamped(map(float, times), form), rate_hz=1000)


@pytest.mark.parametrize(
    ("cells", "line", "said"),
    [
        (["0.000", "0.001", "0.003", "0.003"], 5, "times must increase, not go by 0 s"),
        (["0.000", "0.001", "0.000", "0.001"], 4, "times must increase, not go by -0.001 s"),
        (["0.0000", "0.0010", "0.0025", "0.0030"], 4, "times must be uniform within 0.0001 s, not go by 0.0015 s"),
        (["0.000", "", "0.002", "0.003"], 3, "a time must be a number of seconds of -1e+12 to 1e+12, not ''"),
        (["0.000", "0.001", "nan", "0.003"], 4, "a time must be a number of seconds of -1e+12 to 1e+12, not 'nan'"),
        (["0.000", "0.001", "1e400", "0.003"], 4, "a time must be a number of seconds of -1e+12 to 1e+12, not '1e400'"),
        (["0.000", "0.001", "noon", "0.003"], 4, "a time must be a number of seconds of -1e+12 to 1e+12, not 'noon'"),
    ],
)
def test_times_that_are_not_uniform_are_refused(refused, cells, line, said):
    message = refused([f"{cell},1" for cell in cells])
    assert f"line {line}, column time_s: {said}" in message


def test_a_rate_that_contradicts_the_times_is_refused(refused, read):
    lines = stamped(np.arange(2000) / 1000)
    assert "line 3, column time_s: times must agree with the rate 500 Hz within 0.001 s" in refused(lines, rate_hz=500)
    assert "(over all: 1000 Hz)" in refused(lines, rate_hz=1001)
    # The rate is as exact as stamps of a millisecond allow over two seconds.
    assert read(lines, rate_hz=1000.4).rate_hz == 1000.4


@pytest.mark.parametrize("step", ["1e-12", "1e-300", "1e-999999999", "1e7", "1e300"])
def test_a_rate_of_times_has_the_range_of_a_given_rate(refused, step):
    message = refused(["0,1", f"{step},1"])
    if step in ("1e-12", "1e-300", "1e7"):
        assert "column time_s: times must be those of a rate of 1e-06 to 1e+09 Hz, not of " in message
    assert len(message) < 300
    assert "the rate must be 1e-06 to 1e+09 Hz, not 1e-07" in refused(GOOD, rate_hz=1e-7)


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
    monkeypatch.setattr(recording, "SAMPLES_MAX", 3)
    assert "line 5: must have at most 3 samples (data lines)" in refused(GOOD)
    monkeypatch.setattr(recording, "BYTES_MAX", 20)
    assert "cannot be read (it has more than 2e-05 MB); must be a CSV file" in refused(GOOD)


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
