"""What a study gives: a report for programs, tables and notes for people."""

from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

NOTHING = 1e-12
"""Numbers that are less, in any unit of a report, are what rounding leaves of nothing."""


class Table(NamedTuple):
    """Rows of text; `columns` maps each heading to `left` or `right`, and is empty for a table without headings."""

    columns: dict[str, str]
    rows: list[list[str]]


class Result(Protocol):
    """What every study gives."""

    def report(self) -> Any:
        """Return what is printed as JSON, units in the keys."""

    def tables(self) -> list[Table]:
        """Return what is printed for people."""

    def notes(self) -> list[str]:
        """Return what is to be known beside the tables, a line each."""


class Summary:
    """A result whose table is its report, key by key."""

    def tables(self) -> list[Table]:
        return [Table({}, [[key, text_of(value)] for key, value in self.report().items()])]

    def notes(self) -> list[str]:
        return []


@dataclass(frozen=True)
class Values(Summary):
    """Values by key, which are the report."""

    values: dict[str, Any]

    def report(self) -> dict[str, Any]:
        return self.values


def text_of(value: Any) -> str:
    """Return a value of a report as people read it: numbers of six digits, lists in a row, a dash for what is not."""
    if value is None or value == []:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"0 (< {NOTHING:g})" if 0 < abs(value) < NOTHING else f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {text_of(each)}" for key, each in value.items())
    return ", ".join(map(text_of, value)) if isinstance(value, list) else str(value)


def table_of(left: tuple[str, ...], right: tuple[str, ...], rows: list[list[str]]) -> Table:
    """Return a table of columns of words, on the left, and of numbers."""
    return Table(dict.fromkeys(left, "left") | dict.fromkeys(right, "right"), rows)
