"""Checks of the model's arguments: every error names the argument, the accepted range and the value in one sentence."""

from numbers import Real

import numpy as np
from numpy.typing import ArrayLike

LARGEST = (1 << 62) - 1
"""The largest count or clock; the least is -LARGEST - 1. Sums and differences of two such values fit int64."""
NUMBERS = 1e-30, 1e30
"""The least and the largest number of a specification, in units that the user may choose. They are far beyond any use;
no power or ratio of such numbers leaves the range of float64."""
SHOWN_MAX = 60
"""The most characters of a value in a message."""


class FieldError(ValueError):
    """An impossible value of a field: the message begins with the name of the field, which is also an attribute."""

    def __init__(self, field: str, message: str):
        super().__init__(field, message)
        self.field, self.message = field, message

    def __str__(self) -> str:
        return f"{self.field} {self.message}"


def shown(value: object) -> str:
    """Return a value as messages show it: on one line, printable and shortened."""
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # more digits, or a deeper nesting, than Python writes
        text = f"a very long {type(value).__name__}"
    return text if len(text) <= SHOWN_MAX else text[: SHOWN_MAX - 3] + "..."


def check_range(name: str, value: float, least: float, most: float) -> None:
    """Raise FieldError unless a number is `least` to `most`; NaN never is."""
    if not least <= value <= most:
        raise FieldError(name, f"must be {least:g} to {most:g}, not {shown(value)}")


def check_int(name: str, value: int, least: int, most: int | None = None) -> None:
    """Raise TypeError unless `value` is an int, and ValueError unless it is `least` to `most` (None: no limit)."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise TypeError(f"{name} must be an int, not {shown(value)}")
    if value < least or (most is not None and value > most):
        accepted = f"{least} or more" if most is None else f"{least} to {most}"
        raise FieldError(name, f"must be {accepted}, not {shown(value)}")


def check_number(name: str, value: float) -> None:
    """Raise TypeError unless `value` is a real number; a bool is none."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise TypeError(f"{name} must be a number, not {shown(value)}")


def integers(name: str, values: ArrayLike, least: int = -LARGEST - 1, most: int = LARGEST) -> np.ndarray:
    """Return an array of integers as int64; an array without elements may be of any type.

    Raises:
        TypeError: if `values` is not an array of integers.
        ValueError: if an element is not within `least` to `most`.
    """
    try:
        array = np.asarray(values)
    except ValueError:
        raise TypeError(f"{name} must be an array of integers, not {values!r}") from None
    if array.size and array.dtype.kind not in "iu":
        raise TypeError(f"{name} must be integers, not {array.dtype}")
    if np.ma.is_masked(values):
        raise TypeError(f"{name} must be integers, and none of them masked")
    if array.size:
        wrong = np.flatnonzero((array < least) | (array > most))
        if len(wrong):
            place = [int(index) for index in np.unravel_index(wrong[0], array.shape)]
            where = ", ".join(map(str, place))
            raise ValueError(f"{name} must be {least} to {most}, not {array[tuple(place)]} at element {where}")
    return array.astype(np.int64)


def lanes_of_counts(counts: ArrayLike, width: int, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return records of counts as int64 words of `width` bits, where a count has wrapped, and where one was outrun.

    All have the shape of the records, (samples,) or (lanes, samples). A count beyond the width wraps, and has then
    wrapped for the rest of its record. It is outrun for the rest if it changes by more than `most` in a sample, the
    counts that the decoder can make. From one sample to the next a count may change by less than half of its range, or
    wrap around the end of the range; a wrapped change is at most `most`.

    Raises:
        TypeError: if the counts are not integers.
        ValueError: if the counts do not have one or two dimensions, or jump.
    """
    array = integers("counts", counts)
    if array.ndim not in (1, 2):
        raise ValueError(f"counts must have 1 or 2 dimensions, not {array.ndim}")
    half = 1 << (width - 1)
    changes = np.diff(array, axis=-1, prepend=array[..., :1])
    far = np.abs(changes) >= half
    outrun = np.abs(((changes + half) & (2 * half - 1)) - half) > most
    if far.any():
        wrong = np.argwhere(far & outrun)
        if len(wrong):
            *lane, sample = wrong[0].tolist()
            raise ValueError(
                f"counts must change by less than {half}, half of their range, from sample to sample, "
                f"not by {changes[*lane, sample]} at sample {sample}{f' of lane {lane[0]}' if lane else ''}"
            )
    beyond = (array < -half) | (array >= half) | far
    wrapped, behind = (np.logical_or.accumulate(each, axis=-1) for each in (beyond, outrun))
    return ((array + half) & (2 * half - 1)) - half, wrapped, behind


def edges(edge_clocks: ArrayLike, edge_levels: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return the clocks and the levels of a record of edges as int64.

    Raises:
        TypeError: if clocks or levels are not integers.
        ValueError: if the shapes differ or are not (edges,), the clocks are negative or decrease, or a level is not 0
            to 3.
    """
    clocks = integers("edge_clocks", edge_clocks, 0)
    levels = integers("edge_levels", edge_levels, 0, 3)
    if clocks.ndim != 1 or clocks.shape != levels.shape:
        raise ValueError(f"edge_clocks and edge_levels must have one shape (edges,), not {clocks.shape, levels.shape}")
    back = np.flatnonzero(np.diff(clocks) < 0)
    if len(back):
        first = int(back[0])
        raise ValueError(
            f"edge_clocks must never decrease, not from {clocks[first]} to {clocks[first + 1]} at element {first + 1}"
        )
    return clocks, levels
