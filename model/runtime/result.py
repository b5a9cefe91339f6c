"""The result of a study: a report for programs, tables and notes for people."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

NOTHING = 1e-12
"""Smaller numbers, in any unit of a report, are zero within rounding."""


class Table(NamedTuple):
    """Rows of text; `columns` maps each heading to `left` or `right`, and is empty for a table without headings."""

    columns: dict[str, str]
    rows: list[list[str]]


class Result(Protocol):
    """The interface of every study's result."""

    def report(self) -> dict[str, Any]:
        """Return the values that are printed as one JSON object, with units in the keys; a list is under `rows`."""

    def tables(self) -> list[Table]:
        """Return the tables that are printed for people."""

    def notes(self) -> list[str]:
        """Return remarks on the tables, one line for each."""


class Summary(ABC):
    """A result with its report as its only table, one row for every key."""

    @abstractmethod
    def report(self) -> dict[str, Any]:
        """See `Result`."""

    def tables(self) -> list[Table]:
        return [Table({}, [[key, text_of(value)] for key, value in self.report().items()])]

    def notes(self) -> list[str]:
        return []


@dataclass(frozen=True)
class Values(Summary):
    """A result with a report of given values, by key."""

    values: dict[str, Any]

    def report(self) -> dict[str, Any]:
        return self.values


@dataclass(frozen=True)
class Rows:
    """A result whose report is its rows alone; each kind lays them out in tables of its own."""

    rows: list[dict[str, Any]]

    def report(self) -> dict[str, Any]:
        """Return the rows, units in the keys."""
        return {"rows": self.rows}

    def notes(self) -> list[str]:
        return []


def text_of(value: Any) -> str:
    """Return a value of a report as text for people: numbers with six digits, lists in a row, a dash for no value."""
    if value is None or value == []:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"0 (< {NOTHING:g})" if 0 < abs(value) < NOTHING else f"{value:.6g}"
    if isinstance(value, dict):
        return ", ".join(f"{key} {text_of(member)}" for key, member in value.items())
    return ", ".join(map(text_of, value)) if isinstance(value, list) else str(value)


def table_of(left: tuple[str, ...], right: tuple[str, ...], rows: list[list[str]]) -> Table:
    """Return a table with columns of words, aligned left, and columns of numbers, aligned right."""
    return Table(dict.fromkeys(left, "left") | dict.fromkeys(right, "right"), rows)
