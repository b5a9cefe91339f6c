"""Times as files give them: exact decimals, float64 printed in full, ISO timestamps, and units."""

import io

import numpy as np
import pytest

from hardwall.sim.recordings.stamps import Stamps
from hardwall.sim.recordings.table import Arrays
from stimuli.forms import COUNTS, angles, rows

TABLE = Arrays("made.npz", "arrays", {"t": np.zeros(2)})


def npz(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def whole(cells, unit="s"):
    stamps = Stamps(TABLE, "t", unit)
    stamps.add(range(len(cells)), cells)
    return stamps.whole()


@pytest.mark.parametrize(
    "cells",
    [
        ["1700000000.123456", "1700000000.123457", "1700000000.123459"],
        ["1700000000.123456", "1700000000.1234570", "1700000000.123459"],
        ["1700000000123456e-6", "1700000000.123457", "1700000000.123459"],
    ],
    ids=["alike", "other decimals", "other forms"],
)
def test_differences_of_times_are_exact(cells):
    """In float64 these times are 2.4e-7 apart."""
    times = whole(cells)
    assert times.since.tolist() == [0.0, 1e-6, 3e-6]
    assert str(times.first) == "1700000000.123456"


def test_decimals_of_very_different_size_are_exact():
    times = whole(["1e-300", "1", "999999999999", "999999999999.000000"])
    assert times.since.tolist() == [0.0, 1.0, 999999999999.0, 999999999999.0]


@pytest.mark.parametrize("unit", ["s", "ns"])
def test_nanoseconds_since_1970_keep_every_digit(unit):
    """A robot's log has such times; 19 digits are more than float64 has."""
    cells = ["1700000000123456789", "1700000000123456790", "1700000000123457789"]
    if unit == "s":
        cells = [f"{cell[:-9]}.{cell[-9:]}" for cell in cells]
    times = whole(cells, unit)
    assert times.since.tolist() == ([0.0, 1e-9, 1e-6] if unit == "s" else [0, 1, 1000])


def test_a_float64_in_full_counts_as_its_shortest_decimal(read):
    found = read("\n".join(["time_s, angle", *angles()]), "angle", unit="rad", count=2 * np.pi / 2000)
    assert found.rate_hz == 1000.0
    assert (found.counts == COUNTS).all()
    assert str(whole([f"{0.002:.17e}", f"{19.998:.17e}"]).last) == "19.998"


@pytest.mark.parametrize(("unit", "per_s"), [("s", 1), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)])
def test_units_by_option(read, unit, per_s):
    lines = [f"{k * per_s / 1000:g},{count}" for k, count in enumerate(COUNTS)]
    for header in ("time_s,counts", "when,counts"):
        found = read(lines, header=header, time=header.partition(",")[0], time_unit=unit)
        assert found.rate_hz == 1000.0
        assert f"({unit}), 1000 Hz" in "; ".join(found.notes)


@pytest.mark.parametrize(
    "form", ["2024-05-01T12:00:{:09.6f}", "2024-05-01 12:00:{:06.3f}Z", "2024-05-01T12:00:{:06.3f}+02:00"]
)
def test_iso_timestamps(read, form):
    found = read([f"{form.format(k / 1000)},{count}" for k, count in enumerate(COUNTS)], header="timestamp,counts")
    assert found.rate_hz == 1000.0
    assert found.start_s == 1714564800 - (7200 if "+" in form else 0)
    assert "ISO timestamps" in "; ".join(found.notes)


def test_iso_timestamps_go_over_midnight_and_are_refused_by_their_line(read, refused):
    lines = ["2024-12-31T23:59:59.5,1", "2025-01-01T00:00:00.0,2", "2025-01-01T00:00:00.5,3"]
    assert read(lines, header="time,counts").rate_hz == 2.0
    lines[1] = "2025-13-01T00:00:00.0,2"
    said = "line 3, column time: a time must be as 2024-05-01T12:00:00.123, not '2025-13-01T00:00:00.0'"
    assert said in refused(lines, header="time,counts")


def test_times_of_arrays():
    seconds = 60 + np.arange(100) / 1000
    assert whole(seconds).since[1] == pytest.approx(1e-3, rel=1e-9)
    assert whole(np.arange(5, 100, 5)).since[-1] == 90.0
    moments = np.datetime64("2024-05-01T12:00:00") + np.arange(3) * np.timedelta64(1, "ms")
    assert whole(moments, None).since.tolist() == [0.0, 0.001, 0.002]


def test_a_time_that_is_none_is_refused(refused):
    lines = list(rows())
    lines[7] = "0.0x7,1"
    assert "line 9, column time_s: a time must be a number of seconds of -1e+12 to 1e+12, not '0.0x7'" in refused(lines)
    assert "column t: a time must be a number of ms of" in refused(
        ["0,1", "x,2"], header="t,counts", time="t", time_unit="ms"
    )


@pytest.mark.parametrize("text", ["9500000000000000000", "9.5e18", "-9500000000000000000", "930000000000000000000.5"])
def test_nanoseconds_beyond_64_bits_are_refused(refused, text):
    """They ended in a traceback."""
    said = "line 2, column time: a time must be a number of ns of -9e+18 to 9e+18, not"
    assert said in refused([f"{text},1", f"{text},2"], header="time,counts", time_unit="ns")


def test_whole_nanoseconds_of_arrays_reach_as_far_as_those_of_texts(read, refused):
    """Those since 1970 are beyond 1e18, which was the limit."""
    for start in (1_700_000_000_000_000_000, 8_900_000_000_000_000_000):
        times = start + np.arange(500) * 1_000_000
        for kind in (np.int64, np.uint64):
            found = read(npz(t=times.astype(kind), counts=COUNTS), file="spindle.npz", time_unit="ns")
            assert (found.rate_hz, found.start_s) == (1000.0, start / 1e9)
    beyond = np.uint64(9_500_000_000_000_000_000) + np.arange(500).astype(np.uint64)
    said = "row 1, column t: a time must be a number of ns of -9e+18 to 9e+18, not '9500000000000000000'"
    assert said in refused(npz(t=beyond, counts=COUNTS), file="spindle.npz", time_unit="ns")


def test_timestamps_beyond_nanoseconds_of_64_bits_are_refused(refused):
    """They wrapped, to a time of another century."""
    times = np.arange(500).astype("datetime64[s]") + 10**13
    assert "row 1, column t: a time must be as 2024-05-01T12:00:00.123, not '318857-" in refused(
        npz(t=times, counts=COUNTS), file="spindle.npz"
    )


@pytest.mark.parametrize("kind", [float, int])
def test_numbers_are_no_timestamps(refused, kind):
    """With the unit of timestamps they were taken for seconds."""
    times = (np.arange(500) + 3).astype(kind)
    said = "row 1, column t: a time must be as 2024-05-01T12:00:00.123, not '3"
    assert said in refused(npz(t=times, counts=COUNTS), file="spindle.npz", time_unit="iso")


@pytest.mark.parametrize(("kind", "own"), [("datetime64[ms]", "iso"), ("timedelta64[ms]", "s")])
@pytest.mark.parametrize("capture", [False, True])
def test_times_with_a_unit_of_their_own_have_no_other(read, refused, kind, own, capture):
    number = np.arange(500)
    columns = {"A": number // 2 % 2, "B": (number + 1) // 2 % 2} if capture else {"counts": COUNTS}
    how = {"column": None if capture else "counts", "rate_hz": 1000.0, "file": "spindle.npz", "time": "t"}
    content = npz(t=number.astype(kind), **columns)
    assert "column t: its times have a unit, so --time-unit must be absent, not ms" in refused(
        content, time_unit="ms", **how
    )
    assert read(content, time_unit=own, **how).rate_hz == 1000.0


def test_timestamps_have_nanoseconds_and_no_more():
    digits = "123456789", "123456790", "1234567919", "12345679"
    times = whole([f"2024-05-01T12:00:00.{each}" for each in digits], "iso")
    assert times.since.tolist() == [0.0, 1e-9, 2e-9, 1e-9]
    assert times.decimals == 9


def test_the_first_row_of_a_text_without_names_may_have_a_timestamp(read):
    lines = [f"2024-05-01T12:00:{k / 1000:06.3f},{count}" for k, count in enumerate(COUNTS)]
    found = read("\n".join(lines), "2", time="1")
    assert (found.counts == COUNTS).all()
    assert found.rate_hz == 1000.0
