"""Captures as text that are refused, and units of their times."""

import io

import numpy as np
import pytest

from hardwall.sim.recordings import capture
from stimuli.forms import edges, saleae

TICKS, _, COUNTS = edges()


def test_whole_times_need_their_unit(read, refused):
    lines = saleae().splitlines()
    micros = [f"{round(float(line.split(',')[0]) * 1e6)},{line.partition(',')[2]}" for line in lines[1:]]
    for header in ("Time [us],0,1", "time,0,1"):
        text = "\n".join([header, *micros])
        unit = {} if "us" in header else {"time_unit": "us"}
        assert read(text, None, 1000.0, **unit).edges.counts.tolist() == COUNTS.tolist()
    assert "column time: the unit of the times must be given (--time-unit" in refused(text, None, 1000.0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("A,B\n0,1\n1,1\n", "a capture must have times (--time COLUMN), or state its sample rate"),
        ("time_s,A,B\n0.1,0,1\n0.2,2,1\n", "line 3, column A: a level must be 0 or 1, not '2': name the channels"),
        ("time_s,A,B\n0.1,0,1\n0.1,1,1\n0.2,0,1\n", "column time_s: times must increase from one change of levels"),
        ("time_s,A,B\n0.1,0,1\n0.2,1,1\n0.15,1,1\n", "column time_s: times must increase from one change of levels"),
        ("time_s,A,B\n0.1,0,1\n", "must have at least 2 rows of levels, not 1"),
    ],
)
def test_texts_that_are_no_captures(refused, text, said):
    assert said in refused(text, None, 1000.0)


def test_channels_that_never_change_are_at_rest(read):
    found = read("time_s,A,B\n0.1,0,1\n0.2,0,1\n", None, 1000.0)
    assert len(found.edges.ticks) == 0
    assert found.counts.tolist() == [0] * 101


@pytest.mark.parametrize("apart_s", [1e3, 1e6, 4e6])
@pytest.mark.parametrize("form", ["npz", "text"])
def test_a_capture_of_any_length_has_its_edges(read, apart_s, form):
    """In picoseconds, 107 days are all that 64 bits have."""
    number = np.arange(20)
    columns = {"t": number * apart_s, "A": number // 2 % 2, "B": (number + 1) // 2 % 2}
    if form == "npz":
        file = io.BytesIO()
        np.savez(file, **columns)
        content = file.getvalue()
    else:
        lines = (f"{t:.12f},{a},{b}" for t, a, b in zip(*columns.values(), strict=True))
        content = "\n".join(["t,A,B", *lines])
    how = {"time": "t", "time_unit": "s", "file": f"spindle.{form}"}
    found = read(content, None, 0.1, **how).edges
    assert (found.ticks / found.tick_hz).tolist() == pytest.approx((number[1:] * apart_s).tolist(), rel=1e-12)


def test_changes_are_bounded(refused, monkeypatch):
    monkeypatch.setattr(capture, "CHANGES_MAX", 399)
    assert refused(saleae(), None, 1000.0).endswith("must have at most 399 changes of its channels")
