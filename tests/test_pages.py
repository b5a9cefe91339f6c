"""Guide pages are short and plain: their length, their sentences, their numbers, their pictures, their address."""

import re

import pytest

from support.pages import PAGES, ROOT, text_of
from support.prose import faults, numbers, sentences, words

GUIDES = [name for name in PAGES if name.startswith("docs/guide/")]
WORDS, LONGEST, AVERAGE, NUMBERS = 1500, 25, 18, 2
"""The most words a guide, words a sentence, words a sentence on average, and numbers a sentence."""
TEMPLATES = [name for name in PAGES if name.startswith("docs/results/") and "%report" in text_of(name)]
TYPED = "docs/results/estimators.md", "docs/results/walls.md"
"""Pages of results that have one table of a report, and others that were typed."""
TEMPLATE_WORDS = 800
MEASURED = re.compile(r"\d\s*(?:%|(?:[mkµnM]?(?:m|N|s|m/s|N/m|N s/m|LUT4))(?![\w/]))")
"""A number with a unit that results have. Frequencies are those of commands."""


def test_there_are_guides():
    assert len(GUIDES) > 8


@pytest.mark.parametrize("name", GUIDES)
def test_a_guide_is_read_in_ten_minutes(name):
    assert len(text_of(name).split()) <= WORDS


@pytest.mark.parametrize("name", GUIDES)
def test_a_guide_shows_a_picture(name):
    shown = re.findall(r"!\[[^\]]+\]\(([^)]+)\)", text_of(name))
    assert shown
    assert [path for path in shown if not (ROOT / name).parent.joinpath(path).exists()] == []


@pytest.mark.parametrize("name", [name for name in TEMPLATES if name not in TYPED])
def test_results_have_no_number_that_was_typed(name):
    assert len(text_of(name).split()) <= TEMPLATE_WORDS
    assert [each for each in sentences(text_of(name)) if MEASURED.search(each)] == []


def test_a_measured_number_is_found():
    shown = ["3.5 mm", "4 kN/m", "12 %", "7 N s/m of 20", "0.3 ms"]
    assert [each for each in (*shown, "at 10 kHz", "K to 3 Hz", "2 starts", "5 more") if MEASURED.search(each)] == shown


@pytest.mark.parametrize("name", [*GUIDES, *(name for name in TEMPLATES if name not in TYPED)])
def test_a_sentence_is_read_once(name):
    every = sentences(text_of(name))
    assert len(every) > 10
    assert [each for each in every if len(words(each)) > LONGEST] == []
    assert [each for each in every if len(numbers(each)) > NUMBERS] == []
    assert [(faults(each), each) for each in every if faults(each)] == []
    assert sum(len(words(each)) for each in every) / len(every) <= AVERAGE


def test_sentences_are_found():
    page = (
        "# Title of 3 words\n\nThe `wall_stiffness` word is 16 bits. See [the link](../a.md#b): It is 3.5 mm or 4.\n\n"
        "| a | 7 |\n\n```sh\nhardwall hit 9\n```\n- First item\n- Second, which is at 0.22 for 0.45\n"
    )
    assert sentences(page) == [
        "The code word is 16 bits.", "See the link:", "It is 3.5 mm or 4.", "First item",
        "Second, which is at 0.22 for 0.45",
    ]  # fmt: skip
    assert [len(numbers(each)) for each in sentences(page)] == [1, 0, 2, 0, 2]
    assert faults("Second, which is at 0.22 for 0.45") == ["a comparison with 'for'"]
    assert faults("A filter of which the delay is known") == ["a chain of pronouns"]
    assert faults("The watchdog trips the axis after 200 ms.") == []
