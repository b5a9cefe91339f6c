"""Markdown tables and the numbers in them."""

from collections.abc import Iterable
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
    median, low, high = (number(row[f"{key}{end}"] / unit) for end in ("", "_low", "_high"))
    return median if low == high else f"{median} ({low} to {high})"
