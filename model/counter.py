"""Counters of a few bits in records: a count that wrapped is unwrapped."""

import numpy as np

from .checks import check_int

WIDTHS = 8, 16, 32
"""The usual widths of counters, bits."""


def check_bits(bits: int | None) -> None:
    """Raise unless the width of a counter is None or 2 to 62 bits."""
    if bits is not None:
        check_int("count_bits", bits, 2, 62)


def unwrapped(counts: np.ndarray, bits: int | None) -> np.ndarray:
    """Return int64 counts, shape (..., samples), with every step taken modulo 2**bits; as they are for None.

    A step is then at most half of the counter's range.
    """
    if bits is None:
        return counts
    half = 1 << (bits - 1)
    steps = ((np.diff(counts, axis=-1) + half) & (2 * half - 1)) - half
    return np.concatenate([counts[..., :1], counts[..., :1] + np.cumsum(steps, axis=-1)], axis=-1)


def width_of(step: int) -> int | None:
    """Return the width of the usual counter that has probably wrapped where a count goes by `step`; None for none."""
    return next((bits for bits in WIDTHS if 0.9 * 2**bits <= abs(step) <= 2**bits), None)


def cure(step: int) -> str:
    """Return the end of a message on a step that may be a wrap; empty for none."""
    bits = width_of(step)
    return f"; if the counter wraps, give count_bits={bits}" if bits else ""
