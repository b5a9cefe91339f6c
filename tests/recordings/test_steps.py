"""Steps of recorded counts: those of a motion are read, all others are refused by their line, with what helps."""

import re
import time

import numpy as np
import pytest

from hardwall.sim.recordings.error import RecordingError
from hardwall.sim.recordings.steps import Steps
from hardwall.sim.recordings.table import Arrays

TABLE = Arrays("spindle.npz", "arrays", {"counts": np.zeros(2)})

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
        (
            held(),
            r"if the sensor or its reading stood, for 49 samples before it, take it so \(--gaps hold\), or keep .*",
        ),
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


# ---- the width of the counter ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("bits", [8, 10, 14, 16, 24, 31])
@pytest.mark.parametrize("signed", [True, False], ids=["signed", "unsigned"])
@pytest.mark.parametrize("origin", [0, 12345])
def test_the_width_of_a_counter_that_wrapped_is_found_and_said(read, bits, signed, origin):
    """A log may have an origin of its own, taken off before the counter wrapped."""
    size = 1 << bits
    exact = np.round(1.7 * size * np.sin(np.arange(3000) / 300)).astype(np.int64)
    counts = exact % size - (size // 2 if signed else 0) + origin
    found = read("counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000)
    assert (np.diff(found.counts) == np.diff(exact)).all()
    wraps = np.count_nonzero(np.diff(counts) != np.diff(exact))
    assert f"a counter of {bits} bits that wrapped {wraps} times" in found.notes


def test_a_counter_that_wrapped_there_and_back_at_rest_is_found(read):
    counts = np.array([*range(200, 256), *[0, 255, 0, 255, 255, 0, 1, 0, 0, 255], *range(255, 200, -1)])
    found = read("counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000)
    assert np.abs(np.diff(found.counts)).max() == 1
    assert "a counter of 8 bits that wrapped 6 times" in found.notes


@pytest.mark.parametrize("off", [250, 240, 200])
def test_a_counter_that_was_set_back_is_not_taken_for_one_that_wrapped(refused, off):
    """An 8-bit counter that wrapped would go by 6, 16 or 56 where 1 is usual."""
    counts = np.concatenate([np.arange(0, off + 1), np.arange(0, 100)])
    said = refused("counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000)
    assert f"line {off + 3}, column counts: the count must not go by {-off}" in said


@pytest.mark.parametrize("bit", [10, 14, 16, 20])
def test_a_flipped_bit_is_not_taken_for_a_wrap(refused, bit):
    counts = np.abs(MOVED)
    counts[1234] ^= 1 << bit
    assert "line 1236, column counts: the count must not go by" in refused(
        "counts\n" + "".join(f"{count}\n" for count in counts), rate_hz=1000
    )


def test_a_motion_too_fast_for_its_counter_is_refused_with_the_way_on(read, refused):
    """At more than a quarter of the range a sample, nothing tells the direction, unless the user does."""
    exact = np.cumsum(np.concatenate([np.arange(100), np.full(100, 100), np.arange(100, 0, -1)]))
    text = "counts\n" + "".join(f"{count % 256}\n" for count in exact)
    assert refused(text, rate_hz=1000).endswith("if a counter of 8 bits wrapped, give --counter-bits 8")
    assert (np.diff(read(text, rate_hz=1000, counter_bits=8).counts) == np.diff(exact)).all()


@pytest.mark.parametrize("bits", [8, 12, 16, 32, 48, 62, 63, 64])
def test_a_width_that_is_given_is_used(read, refused, bits):
    exact = np.cumsum(np.round(20 * np.sin(np.arange(500) / 60)).astype(int))
    counts = [int(count) % (1 << bits) for count in exact]
    if 61 < bits < 64:
        counts = [count - (1 << bits if count >> (bits - 1) else 0) for count in counts]
    text = "counts\n" + "".join(f"{count}\n" for count in counts)
    found = read(text, rate_hz=1000, counter_bits=bits)
    assert (np.diff(found.counts) == np.diff(exact)).all()
    assert f"a counter of {bits} bits that wrapped" in found.notes[-1]


@pytest.mark.parametrize("first", [2**61 - 5, 2**61, 2**62, 2**63 - 5, -(2**61) + 5, -(2**63)])
@pytest.mark.parametrize("step", [1, -1])
def test_counts_of_64_bits_keep_their_origin_where_a_count_may_lie(read, first, step):
    """What a count may be, a replay takes; a counter of 64 bits that is elsewhere is counted from its first value."""
    exact = [first + step * k for k in range(10)]
    wrapped = [(count + 2**63) % 2**64 - 2**63 for count in exact]
    found = read("counts\n" + "".join(f"{count}\n" for count in wrapped), rate_hz=1000, counter_bits=64)
    kept = all(-(2**61) <= count < 2**61 for count in exact)
    assert found.counts.tolist() == [count - (0 if kept else first) for count in exact]
    assert (f"counted from the first, {first}" in found.notes) != kept


def test_counts_that_leave_their_first_by_more_than_61_bits_are_refused(refused):
    there = "".join(f"{k << 60}\n" for k in (0, 1, 2, 1, 0))
    assert "line 2, column counts: counts must stay within 2**61 of the first, unwrapped" in refused(
        f"counts\n{there}", rate_hz=1000, counter_bits=64
    )


def test_counts_beyond_the_range_of_their_counter_are_refused(refused):
    said = refused("counts\n-1\n0\n255\n", rate_hz=1, counter_bits=8)
    assert "line 4, column counts: counts must span less than 2**8, not 256 up to here: give a larger" in said


@pytest.mark.parametrize(("size", "speed"), [(2000, 7), (2000, -7), (4000, 40), (1000, 11)])
def test_a_width_that_does_not_fit_is_neither_advised_nor_accepted(refused, size, speed):
    """A counter of one turn was unwrapped by the next power of two: 55 counts at every turn where 7 is usual."""
    counts = (np.arange(3000) * speed + size // 2) % size - size // 2
    text = "counts\n" + "".join(f"{count}\n" for count in counts)
    bits = size.bit_length()
    assert "--counter-bits" not in refused(text, rate_hz=1000)
    assert f"as a counter of {bits} bits that wrapped there, where {speed} is usual beside it" in refused(
        text, rate_hz=1000, counter_bits=bits
    )


def column(counts) -> str:
    return "counts\n" + "".join(f"{count}\n" for count in counts)


@pytest.mark.parametrize("modulus", [4, 5, 360, 4000, 12_345, 10**9, 2**62])
@pytest.mark.parametrize("shift", [0, 1])
def test_a_modulus_that_is_given_is_used(read, modulus, shift):
    """Of a counter from 0 on, or of one with signs."""
    exact = np.cumsum(np.round(min(20, modulus // 4) * np.sin(np.arange(500) / 60)).astype(int))
    counts = [int(count) % modulus for count in exact]
    counts = [count - (modulus if shift and count >= modulus // 2 else 0) for count in counts]
    if modulus == 2**62 and not shift:
        counts = [min(count, 2**61 - 1) for count in np.abs(exact)]
        exact = np.array(counts)
    found = read(column(counts), rate_hz=1000, counter_modulus=modulus)
    assert (np.diff(found.counts) == np.diff(exact)).all()
    assert f"a counter of {modulus} counts that wrapped" in found.notes[-1]


@pytest.mark.parametrize("modulus", [360, 1440, 4000, 10_000, 12_345])
@pytest.mark.parametrize("speed", [0.1, 1.0, 5.3, -5.3])
def test_a_modulus_that_is_no_power_of_two_is_advised(read, refused, modulus, speed):
    exact = np.floor(speed * np.arange(5 * modulus // min(abs(speed), 1))).astype(int)[:: 1 + modulus // 4000]
    said = refused(column(exact % modulus), rate_hz=1000)
    assert f"a counter of about {modulus} counts wrapped, give the exact number, as --counter-modulus {modulus}" in said
    assert "--counter-bits" not in said
    found = read(column(exact % modulus), rate_hz=1000, counter_modulus=modulus)
    assert (np.diff(found.counts) == np.diff(exact)).all()


@pytest.mark.parametrize(("modulus", "speed"), [(4000, 75.4), (12_345, 151.7)])
def test_a_modulus_is_advised_where_the_counter_passes_its_end_fast(refused, modulus, speed):
    """It was taken for the next power of two where all steps are large."""
    exact = np.floor(speed * np.arange(3000)).astype(int)
    said = refused(column(exact % modulus), rate_hz=1000)
    assert said.partition(": if ")[2].startswith(f"a counter of about {modulus} counts wrapped")


@pytest.mark.parametrize("counts", [zeroed(), held(), one_wrong()], ids=["set to 0", "held", "one wrong"])
def test_a_modulus_is_not_advised_for_another_fault(refused, counts):
    assert "--counter-modulus" not in refused(column(counts), rate_hz=1000)


def test_a_modulus_that_does_not_fit_is_refused(refused):
    counts = np.arange(3000) * 7 % 4000
    assert refused(column(counts), rate_hz=1000, counter_modulus=4100).endswith(
        "the count must not go by 107, as a counter of 4100 counts that wrapped there, where 7 is usual beside it: "
        "correct --counter-modulus, or leave it out"
    )
    assert refused(column(counts), rate_hz=1000, counter_modulus=3000).endswith(
        "counts must span less than 3000, not 3003 up to here: give a larger --counter-modulus"
    )


@pytest.mark.parametrize("noise", [1, 30])
def test_a_width_that_is_given_is_accepted_where_the_speed_varies(read, noise):
    """Of thousands of wraps some differ from the steps beside them by more than their spread."""
    exact = np.cumsum(50 + np.random.default_rng(7).integers(-noise, noise + 1, 20_000))
    text = "counts\n" + "".join(f"{count % 256}\n" for count in exact)
    assert (np.diff(read(text, rate_hz=1000, counter_bits=8).counts) == np.diff(exact)).all()


@pytest.mark.parametrize(
    ("unit", "size", "turn"), [("deg", 0.18, 360.0), ("rad", 2 * np.pi / 2000, 2 * np.pi), ("turns", 0.0005, 1.0)]
)
@pytest.mark.parametrize("middle", [0.0, 0.5], ids=["from -1/2", "from 0"])
def test_an_angle_that_wrapped_is_unwrapped_at_one_turn(read, unit, size, turn, middle):
    exact = np.round(5000 * np.sin(np.arange(3000) / 300)).astype(int)
    angles = ((exact * size / turn + 0.5 - middle) % 1 - 0.5 + middle) * turn
    found = read("a\n" + "".join(f"{angle!r}\n" for angle in angles.tolist()), "a", rate_hz=1000, unit=unit, count=size)
    assert (np.diff(found.counts) == np.diff(exact)).all()
    wraps = np.count_nonzero(np.abs(np.diff(angles)) > turn / 2)
    assert f"an angle that wrapped {wraps} times" in found.notes


def test_an_angle_too_fast_for_its_turn_is_refused(refused):
    exact = np.cumsum(np.concatenate([np.arange(0, 600, 6), np.full(100, 600), np.arange(600, 0, -6)]))
    angles = (exact % 2000) * 0.18
    text = "a\n" + "".join(f"{angle:.2f}\n" for angle in angles)
    assert refused(text, "a", rate_hz=1000, unit="deg", count=0.18).endswith(
        "if the angle wrapped at a turn, unwrap it before: it is too fast here to tell its direction"
    )


def test_a_jump_of_a_turn_is_no_wrap_of_an_angle_of_several_turns(refused):
    angles = 0.18 * np.concatenate([np.arange(0, 4000, 7), np.arange(0, 4000, 7) + 2000])
    said = refused("a\n" + "".join(f"{a:.2f}\n" for a in angles), "a", rate_hz=1000, unit="deg", count=0.18)
    assert "line 574, column a: the count must not go by -1997" in said
    assert said.endswith("correct this line, or cut the recording at this line")


def test_jumps_after_standstills_take_linear_time():
    """Each looked at all the steps before it: eight times as many samples took forty times as long."""

    def seconds(samples):
        counts = np.arange(samples) // 20 * 500
        counts[-1] += 1
        steps = Steps(TABLE, "counts", range(samples), counts, np.ones(samples - 1, int))
        began = time.process_time()
        assert len(steps.unwrapped(None, True).cuts) == samples // 20 - 1
        return time.process_time() - began

    assert min(seconds(160_000) for _ in range(3)) < 16 * min(seconds(20_000) for _ in range(3))


# ---- a counter that wraps while samples are missing ------------------------------------------------------------------

RAMP = np.arange(2000) * 7


def with_gaps(counts, *gaps):
    return [f"{k / 1000:.3f},{c}" for k, c in enumerate(counts) if not any(first <= k < last for first, last in gaps)]


@pytest.mark.parametrize("given", [None, 12])
@pytest.mark.parametrize("gaps", [[(1165, 1185)], [(570, 600)], [(570, 600), (1165, 1185)]])
def test_a_counter_that_wraps_in_a_gap_is_unwrapped(read, given, gaps):
    """The first gap has one of three wraps; the step over it was held to be that of a single sample, and refused."""
    found = read(with_gaps(RAMP % 4096, *gaps), gaps="hold", counter_bits=given)
    exact = RAMP.copy()
    for first, last in gaps:
        exact[first:last] = exact[first - 1]
    assert (found.counts == exact).all()
    assert "a counter of 12 bits that wrapped 3 times" in found.notes


def test_the_only_wrap_in_a_gap_is_found(read):
    """It was taken for a motion, because a step over missing samples may be any."""
    found = read(with_gaps((RAMP[:1100] + 62_768) % 65536 - 32768, (300, 450)), gaps="hold")
    assert (np.diff(found.counts)[:298] == 7).all()
    assert found.counts[-1] - found.counts[0] == RAMP[1099]


@pytest.mark.parametrize("jump", [150, 3000])
def test_a_motion_in_a_gap_is_no_wrap(read, jump):
    """At any speed of the other steps, and at a faster one that no counter explains."""
    counts = RAMP[:1000].copy()
    counts[500:] += jump
    assert (read(with_gaps(counts, (480, 500)), gaps="hold").counts[500:] == counts[500:]).all()


def test_a_wrap_that_would_be_too_fast_for_a_gap_is_none(read):
    """An 8-bit counter would have gone by 56 in 10 samples, where 1 is the fastest."""
    counts = np.concatenate([np.arange(251), np.arange(50, 251)])
    lines = with_gaps(np.insert(counts, 251, [0] * 9), (251, 260))
    assert (np.diff(read(lines, gaps="hold").counts)[259:] == np.diff(counts)[250:]).all()


# ---- the limits ------------------------------------------------------------------------------------------------------


def steps_of(steps, **how):
    counts = np.concatenate([[0], np.cumsum(steps)])
    return Steps(TABLE, "counts", range(len(counts)), counts, np.ones(len(steps), int)).unwrapped(None, **how)


@pytest.mark.parametrize(
    ("beside", "most"),
    [
        ([100, 120, 100, 120, 100, 120], 110 + 4 * 20),
        ([1, 1, 1, 1, 1, 1], 1 + 4 * 8),
    ],
    ids=["four times the spread", "eight of the smallest steps"],
)
@pytest.mark.parametrize("beyond", [0, 1])
def test_how_far_a_step_may_be_off(beside, most, beyond):
    steps = [1, *([beside[0]] * 8), *beside[:3], most + beyond, *beside[3:], *([beside[-1]] * 8)]
    if beyond:
        with pytest.raises(RecordingError, match=rf"the count must not go by {most + 1} in one sample"):
            steps_of(steps, may_stand=False)
    else:
        assert len(steps_of(steps, may_stand=False).counts) == len(steps) + 1


@pytest.mark.parametrize(("number", "checked"), [(6, False), (7, True)])
def test_how_few_steps_are_not_checked(number, checked):
    steps = [1, 1, 1000] + [1] * (number - 3)
    if checked:
        with pytest.raises(RecordingError, match="the count must not go by 1000"):
            steps_of(steps, may_stand=False)
    else:
        assert steps_of(steps, may_stand=False).counts[-1] == number - 1 + 1000


@pytest.mark.parametrize(("stood", "taken"), [(3, False), (4, True)])
def test_how_long_a_sensor_stands(stood, taken):
    steps = [1] * 20 + [0] * stood + [1000] + [1] * 20
    if taken:
        assert steps_of(steps, may_stand=True).cuts.tolist() == [20 + stood + 1]
    else:
        with pytest.raises(RecordingError, match=r"the count must not go by 1000 .*: correct this line"):
            steps_of(steps, may_stand=True)


@pytest.mark.parametrize(("step", "found"), [(3, True), (4, False)])
def test_how_far_a_step_across_the_end_of_a_range_may_be_off(read, refused, step, found):
    counts = np.cumsum([1] * 255 + [step] + [1] * 300) % 256
    text = "counts\n" + "".join(f"{count}\n" for count in counts)
    if found:
        assert "a counter of 8 bits that wrapped 2 times" in read(text, rate_hz=1000).notes
    else:
        assert "line 257, column counts: the count must not go by -252" in refused(text, rate_hz=1000)


def test_a_step_longer_than_a_quarter_of_the_range_has_no_direction(read, refused):
    for step, found in ((64, True), (65, False)):
        counts = np.cumsum(np.minimum(np.arange(80), step)) % 256
        counts = np.concatenate([np.arange(256), counts])
        text = "counts\n" + "".join(f"{count}\n" for count in counts)
        if found:
            assert np.diff(read(text, rate_hz=1000).counts).max() == 64
        else:
            assert "the count must not go by" in refused(text, rate_hz=1000)
