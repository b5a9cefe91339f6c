"""Numbers as they are written on the command line: decimal, with an exponent or without one, and nothing else."""

import re

PLAIN = re.compile(r"[+-]?(([0-9]+\.?[0-9]*|\.[0-9]+)(e[+-]?[0-9]+)?|inf|infinity|nan)", re.IGNORECASE)
"""A decimal number. What is no finite one is for the range of its option to refuse."""
OTHER = re.compile(
    r"[+-]?(0[xob][0-9a-f_]+|[0-9]+(_[0-9]+)*(\.[0-9]+(_[0-9]+)*)?(e[+-]?[0-9]+(_[0-9]+)*)?)", re.IGNORECASE
)
"""A number as TOML has it: with `_` between digits, or of another base than 10."""


def is_plain(text: str) -> bool:
    """Return whether a text is a number as it is written on the command line; blanks around it do not count."""
    return PLAIN.fullmatch(text.strip(" ")) is not None


def plain_number(text: str) -> float:
    """Return the number that a text is.

    Raises:
        ValueError: if it is no number, or one with `_` between digits, of another base or in other digits than 0 to 9.
    """
    if not is_plain(text):
        from ..model.checks import shown  # noqa: PLC0415  (NumPy comes with it, and the help needs none)

        raise ValueError(f"must be a decimal number such as 0.5 or 5e-4, not {shown(text)}")
    return float(text)


def has_other_numbers(text: str) -> bool:
    """Return whether a TOML value, or a list of them, has numbers that are not plain."""
    words = re.split(r"[\s,\[\]]+", re.sub(r"\"[^\"]*\"|'[^']*'", "", text))
    return any(OTHER.fullmatch(word) and not is_plain(word) for word in words)
