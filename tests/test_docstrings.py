"""Docstrings are read once, as pages are: short sentences, and no chains of pronouns."""

import pytest
from test_layout import SOURCES, identity

from support.docstrings import of, sentences
from support.prose import faults, words

LONGEST = 25
"""The most words of a sentence, or of a part of it at a semicolon or a colon: as in a guide."""
CHAIN = "a chain of pronouns"
TEXT = """Return the bound of a motion, and its time: both in counts.

    bound = speed / rate, of which nothing here counts as a sentence because it is an equation of the module

It holds at rest, e.g. at a wall. x is its place; see `the code of it`.

- The first item.

Args:
    speed, rate: counts/s. The latter is that of the axis.

Members
-------
name : In(1)
    A member.
"""


@pytest.mark.parametrize("path", SOURCES, ids=identity)
def test_a_docstring_is_read_once(path):
    every = [each for docstring in of(path) for each in sentences(docstring)]
    assert [each for each in every if len(words(each)) > LONGEST] == []
    assert [each for each in every if CHAIN in faults(each)] == []


def test_the_sentences_of_a_docstring_are_found(tmp_path):
    assert sentences(TEXT) == [
        *("Return the bound of a motion, and its time:", "both in counts."),
        *("It holds at rest, e.g. at a wall.", "x is its place;", "see code."),
        *("The first item.", "counts/s.", "The latter is that of the axis.", "A member."),
    ]
    assert [each for each in sentences(TEXT) if CHAIN in faults(each)] == ["The latter is that of the axis."]
    source = tmp_path / "source.py"
    source.write_text(
        '"""A module."""\nSIZE = 1\n"""A size."""\n\ndef f():\n    """A function."""\n    return "none"\n'
    )
    assert [*of(source)] == ["A module.", "A size.", "A function."]
