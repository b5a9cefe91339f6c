"""Which column tells of time, and in which unit: by name, by option, by the rate that it makes, or refused."""

import pytest

from hardwall.sim.recordings.error import RecordingError
from hardwall.sim.recordings.time_column import unit_by_rate, unit_of


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("time", None),
        ("T", None),
        ("time_ms", "ms"),
        ("Time [s]", "s"),
        ("Time(s)", "s"),
        ("t (us)", "us"),
        ("timestamp_ns", "ns"),
        ("Time (µs)", "us"),
        ("seconds", "s"),
        ("Milliseconds", "ms"),
        ("millis", "ms"),
        ("elapsed_s", "s"),
    ],
)
def test_names_of_times_and_their_units(name, unit):
    assert unit_of(name) == (True, unit)


@pytest.mark.parametrize("name", ["s", "ms", "torque", "target", "counts", "tool_s", "us", "theta", ""])
def test_names_of_other_things(name):
    assert not unit_of(name)[0]


@pytest.mark.parametrize(
    ("mean", "unit"), [(5, "ms"), (1, "ms"), (0.001, "s"), (0.1e-3, "s"), (500, "us"), (1000, "us"), (1e6, "ns")]
)
def test_the_unit_that_alone_makes_a_usual_rate(mean, unit):
    assert unit_by_rate("file", mean) == unit


@pytest.mark.parametrize("mean", [50, 100, 0.05, 0.1, 1e9, 0.0, -1.0])
def test_a_unit_in_doubt_is_asked_for(mean):
    with pytest.raises(RecordingError, match=r"^file: the unit of times that are .* apart must be given \(--time-unit"):
        unit_by_rate("file", mean)


def test_the_first_column_of_times_that_is_not_the_counts_is_taken(read, refused):
    lines = ["0,0,5", "5,1,6", "10,2,7"]
    assert read(lines, "x", header="time,x,t").rate_hz == 200.0
    assert read(lines, "time", header="time,x,t", time="3", time_unit="ms").rate_hz == 1000.0
    assert read(lines, "x", header="time,x,t", time="none", rate_hz=7).rate_hz == 7
    assert "column must be one of time, x, t, not 'when'" in refused(lines, "x", header="time,x,t", time="when")
    assert "so the rate in Hz must be given (--rate)" in refused(lines, "x", header="a,x,b")


def test_a_rate_must_agree_with_times_that_were_asked_for(read, refused):
    lines = [f"{k * 5},{k}" for k in range(20)]
    lines[7] = "36,7"
    assert read(lines, rate_hz=200, header="time,counts").rate_hz == 200  # the mean agrees
    assert "line 9, column time: times must agree with the rate 200 Hz within 0.001 s" in refused(
        lines, rate_hz=200, header="time,counts", time="time"
    )


@pytest.mark.parametrize(
    ("apart", "rate", "unit"), [(500, 2.0, "ms"), (500, 2000.0, "us"), (20, 5e7, "ns"), (4, 0.25, "s")]
)
def test_a_rate_that_is_given_tells_the_unit(read, apart, rate, unit):
    """Alone, times that are 500 apart would be those of 2 kHz, in us."""
    found = read([f"{apart * k},{k}" for k in range(30)], header="when,counts", time="when", rate_hz=rate)
    assert f"times in column when ({unit}), {rate:g} Hz" in found.notes
    assert found.rate_hz == rate
