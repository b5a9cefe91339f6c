"""Pages are short and plain: their length, their sentences, their pictures; and no measured number was typed."""

import ast
import re

import pytest

from support import claims
from support.pages import PAGES, ROOT, text_of
from support.prose import faults, numbers, sentences, words

GUIDES = [name for name in PAGES if name.startswith("docs/guide/")]
WORDS, LONGEST, AVERAGE, NUMBERS = 1500, 25, 18, 2
"""The most words a guide, words a sentence, words a sentence on average, and numbers a sentence."""
RESULTS = [name for name in PAGES if name.startswith("docs/results/")]
RESULTS_WORDS = 800
ROOMS = "cli", "docs", "hdl", "host", "model", "sim"
ARGUED = {"model/estimators/levant_semi_implicit.py"}
"""Modules whose docstrings hold a bound that they derive against what was measured."""


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


@pytest.mark.parametrize("name", RESULTS)
def test_results_come_from_what_commands_wrote(name):
    text = text_of(name)
    assert len(text.split()) <= RESULTS_WORDS
    assert re.search(r"^%(?:report|findings) ", text, re.MULTILINE)
    assert claims.in_results(text, sentences(text)) == []


@pytest.mark.parametrize("name", [name for name in PAGES if name not in RESULTS])
def test_no_other_page_has_a_measured_number(name):
    text = text_of(name)
    assert claims.elsewhere([*sentences(text), *claims.ROWS.findall(text)]) == []


def test_no_docstring_has_a_measured_number():
    found = {}
    for path in (path for room in ROOMS for path in (ROOT / room).rglob("*.py")):
        nodes = ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        texts = (
            ast.get_docstring(node) for node in nodes if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef)
        )
        said = claims.elsewhere([each for text in texts if text for each in sentences(text)])
        if said:
            found[str(path.relative_to(ROOT))] = said
    assert {*found} == ARGUED, found


def test_a_measured_number_is_found():
    shown = ["3.5 mm", "4 kN/m", "12 %", "7 N s/m of 20", "0.3 ms", "1089 LUT4", "3.4 times"]
    assert claims.in_results("", [*shown, "at 10 kHz", "K to 3 Hz", "2 starts", "It must reach 98 %"]) == shown
    table = "| setting | value |\n| --- | --- |\n| hand | 11.7 N |\n\n| estimator | error |\n| `fdm` | 4 mm/s |\n"
    assert claims.in_results(table, []) == ["| `fdm` | 4 mm/s |"]
    told = ["It is 3 times as fast", "The error was measured: 0.3 mm/s", "A run took 3 s"]
    assert claims.elsewhere([*told, "A wall of 4 kN/m", "The timer is 16 ms", "It is faster at 10 kHz"]) == told


@pytest.mark.parametrize("name", [*GUIDES, *RESULTS])
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
