"""Times that a caller gives."""

from ..model.checks import check_number, check_range

SECONDS_MAX = 1e9
"""The longest time that can be waited."""


def check_seconds(name: str, seconds: float) -> None:
    """Raise TypeError unless a time is a number, and FieldError unless it is finite and not negative."""
    check_number(name, seconds)
    check_range(name, seconds, 0.0, SECONDS_MAX)
