"""Numbers that a browser sends with its events, checked to be finite and in a range: a socket may bring anything."""

import math
from typing import Any

from ...model.checks import NUMBERS, check_number, check_range

MOST = NUMBERS[1]
"""The largest number, either way, that is taken where there is no other range."""
TIMED, VALUED = "() => emit(window.hardwallNow())", "(value) => emit(value, window.hardwallNow())"
"""The page's arguments of an event: its time, and its value if it has one."""


def number_of(name: str, value: Any, least: float = -MOST, most: float = MOST) -> float:
    """Return a number as a float.

    Args:
        name: what it is called in the error.
        value: what came.
        least, most: the range that is accepted.

    Raises:
        TypeError: if it is no number.
        FieldError: if it is out of its range, infinite or NaN.
    """
    check_number(name, value)
    check_range(name, value, least, most)
    return float(value)


def time_from(value: object) -> float:
    """Return the time of a wish, s of time.monotonic; None, from a page that does not know it, counts as too old.

    Raises:
        TypeError, FieldError: as `number_of` does.
    """
    return -math.inf if value is None else number_of("at_s", value)
