"""Measured numbers in sentences and tables that someone typed: what a program can find of them.

A number with a unit is a setting, a limit or a measurement. On a page of results it must be a setting, and these are in
tables whose first head is `setting`, or in a sentence that says what must be. Elsewhere it is taken for a measurement
if its sentence has a word of measuring: what is measured comes from a report, and stands on a page of results.
"""

import re

UNIT = re.compile(r"\d\s*(?:%|(?:[mkµunMG]?(?:m|N|s|m/s|N/m|N s/m|J|samples/s)|LUT4|times)(?![\w/]))")
"""A number with a unit that measurements have. Frequencies are those of commands."""
MEASURING = re.compile(
    r"\b(?:measured|fmax|medians?|on average|RMS errors? (?:is|was)|of error|as fast|as stiff|as accurate|as large|"
    r"(?:times|%) (?:faster|slower|stiffer)|took)\b"
)
REQUIRED = re.compile(r"\bmust\b")
SETTINGS = re.compile(r"^\| setting \|.*\n(?:\|.*\n?)+", re.MULTILINE)
"""A table of settings."""
ROWS = re.compile(r"^\|.*\|$", re.MULTILINE)


def in_results(text: str, sentences: list[str]) -> list[str]:
    """Return the sentences and the rows of a page of results that have a measured number."""
    rows = ROWS.findall(SETTINGS.sub("", text))
    return [each for each in (*sentences, *rows) if UNIT.search(each) and not REQUIRED.search(each)]


def elsewhere(sentences: list[str]) -> list[str]:
    """Return the sentences, or rows of tables, that say that a number was measured."""
    return [each for each in sentences if UNIT.search(each) and MEASURING.search(each)]
