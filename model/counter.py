"""Counters that wrap in records: a count that wrapped is unwrapped."""

from typing import Any

import numpy as np

from .checks import FieldError, check_int

WIDTHS = 8, 16, 32
"""The usual widths of counters, bits."""


def modulus_of(bits: Any, modulus: Any) -> int | None:
    """Return at how many counts a counter wraps, from `count_bits` or `count_modulus`; None if it does not.

    Raises:
        TypeError: if one is no int.
        ValueError: unless they are 2 to 62 bits, or 4 to 2**62 counts; or if both are given.
    """
    if bits is not None:
        check_int("count_bits", bits, 2, 62)
    if modulus is not None:
        check_int("count_modulus", modulus, 4, 1 << 62)
    if bits is not None and modulus is not None:
        raise FieldError("count_modulus", "and count_bits are both the range of the counter: give one of them")
    return modulus if bits is None else 1 << bits


def check_span(counts: np.ndarray, modulus: int | None) -> None:
    """Raise ValueError if counts, as they are read, span more than their counter has."""
    if modulus is not None and counts.size and (span := int(counts.max()) - int(counts.min())) >= modulus:
        raise ValueError(f"counts must span less than the {modulus} counts of their counter, not {span}")


def unwrapped(counts: np.ndarray, modulus: int | None) -> np.ndarray:
    """Return int64 counts, shape (..., samples), with every step taken modulo `modulus`; as they are for None.

    A step is then at most half of the counter's range.
    """
    if modulus is None:
        return counts
    half = modulus // 2
    # The counts are reduced first: no sum exceeds int64.
    steps = (np.diff(counts % modulus, axis=-1) + half) % modulus - half
    return np.concatenate([counts[..., :1], counts[..., :1] + np.cumsum(steps, axis=-1)], axis=-1)


def width_of(step: int) -> int | None:
    """Return the width of the usual counter that has probably wrapped where a count goes by `step`; None for none."""
    return next((bits for bits in WIDTHS if 0.9 * 2**bits <= abs(step) <= 2**bits), None)


def cure(step: int) -> str:
    """Return the end of a message on a step that may be a wrap; empty for none."""
    bits = width_of(step)
    return f"; if the counter wraps, give count_bits={bits}" if bits else ""
