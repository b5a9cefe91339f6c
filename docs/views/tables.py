"""Markdown tables and the numbers in them."""

from collections.abc import Iterable, Sequence
from statistics import median
from typing import Any

Report = dict[str, Any]


def table(heads: Iterable[str], rows: Iterable[Iterable[str]], numbers_from: int = 1) -> list[str]:
    """Return the lines of a Markdown table, whose columns from a place on have numbers."""
    heads = list(heads)
    rules = ["---" if place < numbers_from else "---:" for place in range(len(heads))]
    return [f"| {' | '.join(line)} |" for line in (heads, rules, *rows)]


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many digits that matter, without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text else text


def spread(row: dict[str, Any], key: str, unit: float = 1.0) -> str:
    """Return the median of starts in a unit, and in brackets its range if that is seen; `none` where there is none."""
    if row[key] is None:
        return "none"
    return _ranged(*(number(row[f"{key}{end}"] / unit) for end in ("", "_low", "_high")))


def of_starts(values: Sequence[float], digits: int = 3) -> str:
    """Return the median of values, and in brackets their range if that is seen."""
    return _ranged(*(number(value, digits) for value in (median(values), min(values), max(values))))


def of_draws(value: float, low: float, high: float, unit: float = 1.0, *, whole: bool = False) -> str:
    """Return a value in a unit, and in brackets its interval if that is seen; without decimals if it is to be whole."""
    return _ranged(*(f"{each / unit:.0f}" if whole else number(each / unit) for each in (value, low, high)))


def _ranged(middle: str, low: str, high: str) -> str:
    """Return a number, and in brackets its range if that is seen."""
    return middle if low == high else f"{middle} ({low} to {high})"
