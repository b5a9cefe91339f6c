"""Captures as text that are refused, and units of their times."""

import pytest

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
        ("time_s,A,B\n0.1,0,1\n", "must have at least 2 rows of levels, not 1"),
    ],
)
def test_texts_that_are_no_captures(refused, text, said):
    assert said in refused(text, None, 1000.0)


def test_channels_that_never_change_are_at_rest(read):
    found = read("time_s,A,B\n0.1,0,1\n0.2,0,1\n", None, 1000.0)
    assert len(found.edges.ticks) == 0
    assert found.counts.tolist() == [0] * 101
