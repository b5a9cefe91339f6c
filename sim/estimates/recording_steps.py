"""The steps of recorded counts: a counter that wrapped is unwrapped, and a step that is no motion is refused.

A handle does not reach a speed and lose it again within one sample. So a step is held against the `BESIDE` steps on
either side of it. With the median of these and their spread, the largest less the smallest, a step is no motion if

    |step - median| > JUMP * max(spread, FLOOR * (the smallest step of the recording that is not 0))

Where the speed itself jumps, at an impact, the spread is that jump, and the step lies within it. At the ends of a
recording, where one side is missing, the largest of the other steps stands for the spread. A single wrong sample makes
two opposite steps, which do not support each other.
"""

from collections.abc import Sequence

import numpy as np

from .recording_error import RecordingError, plain

SPAN_BITS = 32
BESIDE = 3
JUMP, FLOOR = 4, 8
"""How often the spread a step may be off, and the least spread in smallest steps: single counts are no jump."""
WRAP_BITS = range(8, SPAN_BITS)
"""The widths of counters that a message knows."""
CHUNK = 1 << 16


def unwrapped(name: str, column: str, lines: Sequence[int], counts: np.ndarray) -> np.ndarray:
    """Return the counts with every step taken modulo 2**SPAN_BITS.

    Args:
        name: the file, for a message.
        column: the column of the counts.
        lines: the line of every count in the file.
        counts: the counts as they are in the file, int64.

    Raises:
        RecordingError: if the counts span too much, or a step is no motion.
    """
    # A difference of two int64 that is not negative is exact as an unsigned number modulo 2**64.
    spread = np.maximum.accumulate(counts).view(np.uint64) - np.minimum.accumulate(counts).view(np.uint64)
    wide = np.flatnonzero(spread >> np.uint64(SPAN_BITS))
    if len(wide):
        raise RecordingError(
            f"{name}, line {lines[wide[0]]}, column {plain(column)}: counts must span less than 2**{SPAN_BITS}, "
            f"not {spread[wide[0]]} up to here"
        )
    half = 1 << (SPAN_BITS - 1)
    steps = ((np.diff(counts) + half) & (2 * half - 1)) - half
    jump = _jump(steps)
    if jump is not None:
        place, usual, near = jump
        raise RecordingError(
            f"{name}, line {lines[place + 1]}, column {plain(column)}: the count must not go by {steps[place]} in one "
            f"sample where {usual:g} is usual beside it, for no motion does that: "
            f"{_cure(counts, steps, place, steps[place] - usual, near)}"
        )
    return counts[0] + np.concatenate([[0], np.cumsum(steps)])


def _jump(steps: np.ndarray) -> tuple[int, float, float] | None:
    """Return the number of the first step that is no motion, the median of the steps beside it, and how much a step
    may be off; None if there is none, or there are too few steps to tell.
    """
    if len(steps) <= 2 * BESIDE or not steps.any():
        return None
    least = FLOOR * float(np.abs(steps[steps != 0]).min())
    # A jump differs from both its neighbours by nearly all that it is off: most steps are not looked at again.
    changes = np.abs(np.diff(steps))
    beside = np.concatenate([changes[:1], np.minimum(changes[1:], changes[:-1]), changes[-1:]])
    suspects = np.flatnonzero(beside > JUMP * least // 2)
    for first in range(0, len(suspects), CHUNK):
        places = suspects[first : first + CHUNK]
        usual, spread = _around(steps, places)
        near = JUMP * np.maximum(spread, least)
        found = np.flatnonzero(np.abs(steps[places] - usual) > near)
        if len(found):
            return int(places[found[0]]), float(usual[found[0]]), float(near[found[0]])
    return None


def _around(steps: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the median and the spread of the steps beside those at `places`."""
    first = np.clip(places - BESIDE, 0, len(steps) - 2 * BESIDE - 1)
    window = first[:, None] + np.arange(2 * BESIDE + 1)
    others = window[window != places[:, None]].reshape(len(places), -1)
    values = steps[others].astype(np.float64)
    usual = np.median(values, axis=1)
    off = steps[places] - usual
    # The way back from a single wrong sample is none of what is usual.
    next_to = np.abs(others - places[:, None]) == 1
    back = next_to & (np.abs((values - usual[:, None]) + off[:, None]) < np.abs(off[:, None]) / 2)
    values = np.where(back, usual[:, None], values)
    at_an_end = first != places - BESIDE
    spread = np.where(at_an_end, np.abs(values).max(axis=1), values.max(axis=1) - values.min(axis=1))
    return usual, spread


def _cure(counts: np.ndarray, steps: np.ndarray, place: int, off: float, near: float) -> str:
    """Return what has probably happened at a step that is `off` by so much, and what helps."""
    count, cut = int(counts[place + 1]), "cut the recording at this line"
    bits = next((bits for bits in WRAP_BITS if abs(abs(off) - 2.0**bits) <= near / JUMP), None)
    if bits is not None:
        change = "add" if off < 0 else "subtract"
        return f"if a counter of {bits} bits wrapped, {change} 2**{bits} in this line and all after it"
    if abs(count) <= near / JUMP:
        return f"if the counter was set to 0, add {-round(off)} in this line and all after it, or {cut}"
    moved = np.flatnonzero(steps[:place])
    held = place - (int(moved[-1]) + 1 if len(moved) else 0)
    if held > BESIDE:
        return f"if the sensor or its reading stood, for {held} samples before it, {cut}"
    return f"correct this line, or {cut}"
