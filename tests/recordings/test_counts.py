"""Counts from angles and lengths: multiples of a size, any origin, and values that are refused with a cure."""

import math

import numpy as np
import pytest

from hardwall.sim.recordings.counts import size_of
from stimuli.forms import COUNTS, SIZE_RAD, angles


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("0.005", 0.005),
        ("1e-6", 1e-6),
        ("360/40000", 0.009),
        ("2pi/2048", math.tau / 2048),
        ("2*pi / 2048", math.tau / 2048),
        ("pi/1024", math.pi / 1024),
        ("1/4096", 1 / 4096),
    ],
)
def test_sizes_of_a_count(text, size):
    assert size_of(text) == pytest.approx(size, rel=1e-15)


@pytest.mark.parametrize("text", ["", "0", "-1", "1/0", "x", "2pi/", "1.2.3", "1e999", "/4", "nan"])
def test_what_is_no_size(text):
    assert size_of(text) is None


@pytest.mark.parametrize(("unit", "size"), [("rad", SIZE_RAD), ("deg", 360 / 2000), ("turns", 1 / 2000), ("m", 5e-6)])
@pytest.mark.parametrize("origin", [0.0, 0.37])
def test_values_of_every_unit_are_counts(read, unit, size, origin):
    lines = "\n".join(["time_s,x", *angles(size, origin)])
    found = read(lines, "x", unit=unit, count=size)
    assert (np.diff(found.counts) == np.diff(COUNTS)).all()
    assert found.counts[0] == round(origin / size)
    assert f"{unit}, {size:g} a count, within" in found.notes[1]


def test_values_that_are_no_multiples_are_refused_by_their_line(refused):
    lines = list(angles())
    first, _, _ = lines[40].partition(",")
    lines[40] = f"{first}, {SIZE_RAD * (COUNTS[40] + 0.3):.17e}"
    said = refused("\n".join(["time_s,x", *lines]), "x", unit="rad", count=SIZE_RAD)
    assert "line 42, column x: values must be multiples of 0.00314159 rad (--count)" in said
    assert "within 0.1 of it, not 252.7" in said.replace(f"{COUNTS[40] + 0.3:g}", "252.7")
    assert said.endswith("correct --count, or --unit")
    lines[40] = "0.04, x"
    assert "line 42, column x: a value must be a number (rad), not 'x'" in refused(
        "\n".join(["time_s,x", *lines]), "x", unit="rad", count=SIZE_RAD
    )


def test_a_size_that_lacks_is_asked_for_with_the_one_that_fits(refused):
    said = refused("\n".join(["time_s,x", *angles()]), "x", unit="rad")
    assert said.endswith("need the size of a count in rad (--count): the smallest step is 0.00314159, as --count 2pi/2000 would be")  # fmt: skip  # noqa: E501
    assert "a count must be a whole number" in refused("\n".join(["time_s,x", *angles()]), "x")
    assert refused("\n".join(["time_s,x", *angles()]), "x").endswith("say its unit and the size of a count (--unit, --count)")  # fmt: skip  # noqa: E501


def test_a_size_that_is_a_part_of_the_true_one_is_said(read):
    found = read("\n".join(["time_s,x", *angles()]), "x", unit="rad", count=SIZE_RAD / 3)
    assert "every count is a multiple of 3, so a count may be 3 times larger" in found.notes


def test_counts_of_64_bits_need_their_width(read, refused):
    top = (1 << 64) - 1
    lines = [f"{k},{(k * 3 - 20) % (1 << 64)}" for k in range(20)]
    found = read(lines, header="t,counts", time="none", rate_hz=10, counter_bits=64)
    assert np.diff(found.counts).tolist() == [3] * 19
    assert refused([f"0,{top}", "1,0"], rate_hz=1).endswith("for a counter of 64 bits, say so (--counter-bits 64)")


@pytest.mark.parametrize("off", [0.09, -0.09, 0.11, -0.11])
def test_a_tenth_of_a_count_is_as_far_as_a_value_may_be_off(read, refused, off):
    lines = ["0", "2.5", f"{5 + 2.5 * off}", "7.5"]
    text = "\n".join(["x", *lines])
    if abs(off) < 0.1:
        assert read(text, "x", rate_hz=1, unit="deg", count=2.5).counts.tolist() == [0, 1, 2, 3]
    else:
        assert "line 4, column x: values must be multiples of 2.5 deg (--count)" in refused(
            text, "x", rate_hz=1, unit="deg", count=2.5
        )
