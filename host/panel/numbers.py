"""Numbers that a browser sends with its events: finite and in a range, for what comes from a socket may be anything."""

import math
from typing import Any

from ...model.checks import NUMBERS, check_number, check_range

MOST = NUMBERS[1]
"""The largest number, either way, that is taken where there is no other range."""
TIMED, VALUED = "() => emit(window.hardwallNow())", "(value) => emit(value, window.hardwallNow())"
"""What the page sends of an event: when it was; and of one with a value that, too."""


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
    """Return the time of a wish, s of time.monotonic; a page that does not know it sends None, which is too old.

    Raises:
        TypeError, FieldError: as `number_of` does.
    """
    return -math.inf if value is None else number_of("at_s", value)
