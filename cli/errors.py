"""The error for invalid input, and the one line in which any error is printed."""

import re

WORD_MAX = 200
"""The most characters of a word in a message."""


def one_line(message: str) -> str:
    """Return a message as it is printed: no character of it breaks the line, and no word is longer than `WORD_MAX`.

    Line breaks and other unprintable characters, for instance in the name of a file, are escaped.
    """
    text = "".join(letter if letter.isprintable() else letter.encode("unicode_escape").decode() for letter in message)
    half = WORD_MAX // 2 - 2
    return re.sub(rf"\S{{{WORD_MAX + 1},}}", lambda word: f"{word[0][:half]}...{word[0][-half:]}", text)


class BadInput(Exception):
    """Invalid input. The message is one line: the fault, and the accepted values."""
