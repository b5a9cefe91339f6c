"""Steps of recorded counts: those of a motion are read, all others are refused by their line, with what helps."""

import re

import numpy as np
import pytest

MOVED = np.round(4000 * np.sin(np.arange(3000) / 100)).astype(int)
"""A swing, whose steps are at most 40 counts."""


def wrapped(bits):
    """Return the counts of a motion over two ranges of a counter of so many bits."""
    half = 1 << (bits - 1)
    return (np.arange(0, 4 * half, half // 200) + half) % (2 * half) - half


def zeroed():
    counts = MOVED.copy()
    counts[1500:] -= counts[1500]
    return counts


def held():
    counts = MOVED.copy()
    counts[1400:1450] = counts[1400]
    return counts


def one_wrong():
    counts = MOVED.copy()
    counts[900] += 5000
    return counts


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        (zeroed(), r"if the counter was set to 0, add \d+ in this line and all after it, or cut the recording at th.*"),
        (held(), r"if the sensor or its reading stood, for 49 samples before it, take it so \(--gaps hold\), or keep .*"),
        (one_wrong(), r"correct this line, or cut the recording at this line"),
    ],
    ids=["set to 0", "held", "one wrong"],
)
def test_a_step_that_no_motion_makes_is_refused_by_its_line_with_a_cure(refused, counts, said):
    """Such a step set the range and the gains of every estimator."""
    message = refused("counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000)
    steps = np.abs(np.diff(counts, prepend=counts[0]))
    line = int(np.argmax(steps > max(60, 2 * np.median(steps)))) + 2
    assert f"line {line}, column counts: the count must not go by {np.diff(counts)[line - 3]} in one sample" in message
    assert re.search(rf"for no motion does that: {said}$", message)


@pytest.mark.parametrize("place", [0, 1, 2, 2996, 2997, 2998])
def test_a_wrong_step_near_an_end_is_refused_too(refused, place):
    counts = MOVED.copy()
    counts[place + 1 :] += 9999
    assert f"line {place + 3}, column counts: the count must not go by " in refused(
        "counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000
    )


@pytest.mark.parametrize("speed", [1, 30, 900, 30_000])
@pytest.mark.parametrize("place", [1, 2, 50, 98])
def test_an_impact_is_a_motion(read, speed, place):
    """A handle that bounces, starts or stops within a sample has steps that are supported on one side."""
    for after in (-speed, 0, speed // 3, 5 * speed):
        steps = np.full(100, speed)
        steps[place:] = after
        steps[place - 1] = (speed + after) // 2
        counts = np.concatenate([[0], np.cumsum(steps)])
        text = "counts\n" + "".join(f"{count}\n" for count in counts)
        assert (read(text, rate_hz=1000).counts == counts).all()


@pytest.mark.parametrize("unit", [1, 16])
def test_single_counts_and_tremor_are_motions(read, unit):
    rng = np.random.default_rng(7)
    for counts in (np.arange(2000) // 300, rng.integers(0, 8, 2000), np.arange(2000) % 2 * 1000, np.zeros(50, int)):
        text = "counts\n" + "".join(f"{unit * count}\n" for count in counts)
        assert (read(text, rate_hz=1000).counts == unit * counts).all()
