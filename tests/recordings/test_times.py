"""The rate of a recording from its column of times, and times that are refused with what helps."""

import io
import re

import numpy as np
import pytest


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
        (np.arange(500), "{:.1f}", 1),
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


@pytest.mark.parametrize("per_s", [10**3, 10**6, 10**9])
@pytest.mark.parametrize("rate", [100, 1000])
def test_times_in_another_unit_than_seconds_are_refused(refused, read, per_s, rate):
    """Nanoseconds were taken for a recording at 1e-6 Hz."""
    lines = stamped([k * per_s // rate for k in range(20)], "{}")
    assert re.search(
        r"not of [\d.e-]+ Hz: write them in seconds$|may be of another unit: .* --time-unit$", refused(lines)
    )
    assert read(stamped(range(20), "{}"), rate_hz=1).rate_hz == read(stamped(range(20), "{:.1f}")).rate_hz == 1


def test_jittered_times_name_the_line_and_the_way_on(refused, read):
    times = np.arange(2000) / 1000
    times[700] += 0.0004
    times[1200] -= 0.0002
    for message in (refused(stamped(times, "{:.4f}")), refused(stamped(times, "{:.4f}"), rate_hz=1000)):
        assert re.search(r"line 70[23], column time_s: times must ", message)
        assert message.endswith(": if only the stamps jitter, give --time none --rate 1000, or write them evenly")
    times[701:] += 0.002
    assert refused(stamped(times, "{:.4f}")).endswith(
        ": if samples are missing there, fill them with the count before (--gaps hold), or keep the longest piece "
        "(--gaps split)"
    )
    assert refused(stamped(np.arange(2000) / 1000), rate_hz=500).endswith(": correct the rate")


@pytest.mark.parametrize(
    ("header", "per_s"),
    [
        ("time", 1),
        ("t", 1e3),
        ("Time (ms)", 1e3),
        ("timestamp_us", 1e6),
        ("t [s]", 1),
        ("time_ns", 1e9),
    ],
)
def test_times_of_another_name_must_not_contradict_the_rate(refused, read, header, per_s):
    """Such a column was passed over in silence, whatever it said."""
    lines = [f"{7 + k * per_s / 1000:.6f},{k}" for k in range(50)]
    assert read(lines, rate_hz=1000, header=f"{header},counts").rate_hz == 1000
    assert f"column {header}: times must agree with the rate 1200 Hz within 1%, not go by " in refused(
        lines, rate_hz=1200, header=f"{header},counts"
    )


@pytest.mark.parametrize("header", ["temperature", "target", "torque", "tool_s", "noon"])
def test_columns_that_do_not_tell_of_time_may_hold_anything(read, header):
    assert read(["0,1", "0,2"], rate_hz=5, header=f"{header},counts").rate_hz == 5
    assert read(["noon,1", "later,2"], rate_hz=5, header="time,counts").rate_hz == 5


@pytest.mark.parametrize("rate", [1000.0, 1024.0, 333.0, 12.5])
@pytest.mark.parametrize(("kind", "samples"), [(np.float32, 20_000), (np.float32, 300), (np.float16, 200)])
def test_the_spacing_of_times_is_that_of_their_own_numbers(read, rate, kind, samples):
    """A program in single precision has times that are no multiples of an interval in float64."""
    if kind == np.float16 and rate > 50:
        pytest.skip("half precision does not tell these times apart")
    file = io.BytesIO()
    np.savez(file, time_s=(np.arange(samples) / rate).astype(kind), counts=np.arange(samples))
    assert read(file.getvalue(), file="spindle.npz").rate_hz == rate


@pytest.mark.parametrize("start", [0.0, 60.0, 1.7e9])
@pytest.mark.parametrize("rate", [1000.0, 3000.0, 333.3, 0.125, 1 / 3])
def test_the_rate_of_times_in_floating_point_is_a_round_number(read, rate, start):
    times = start + np.arange(5000) / rate
    file = io.BytesIO()
    np.savez(file, time_s=times, counts=np.arange(5000))
    found, part = read(file.getvalue(), file="spindle.npz").rate_hz, np.spacing(times[-1]) / (times[-1] - start)
    assert abs(found / rate - 1) <= 2 * max(part, 1e-12)
    if rate != 1 / 3:
        assert found == rate


@pytest.mark.parametrize(("off", "agrees"), [(0.0099, True), (-0.0099, True), (0.0101, False), (-0.0101, False)])
def test_a_mean_rate_agrees_within_one_in_a_hundred(read, refused, off, agrees):
    lines = [f"{k * (1 + off):.6f},{k}" for k in range(1000)]
    if agrees:
        assert read(lines, rate_hz=1, header="timestamp,counts").rate_hz == 1
    else:
        assert "times must agree with the rate 1 Hz within 1%" in refused(lines, rate_hz=1, header="timestamp,counts")


def test_whole_seconds_are_seconds_where_a_unit_or_another_name_says_so(read, refused):
    lines = stamped(range(20), "{}")
    assert "may be of another unit" in refused(lines)
    assert read(lines, time_unit="s").rate_hz == 1
    assert read(lines, header="seconds,counts").rate_hz == 1
