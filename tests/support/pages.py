"""The pages as tests read them: their blocks of commands and of Python, and the command line that they describe."""

import re
import shlex
from functools import cache
from pathlib import Path
from typing import NamedTuple

import typer.main

from hardwall.cli.group import app

ROOT = Path(__file__).absolute().parents[2]
PAGES = sorted(
    ["README.md", "CONTRIBUTING.md", *(str(path.relative_to(ROOT)) for path in (ROOT / "docs").rglob("*.md"))]
)


class Block(NamedTuple):
    """A block of a page: its language, its text, whether a mark keeps it from being run, and its expected output.

    The marks are `long`, for blocks that take minutes, and `setup`, for blocks that change the reader's machine. On a
    page of the site they are attributes, `{.long}`; elsewhere, where these would be seen, comments, `<!-- long -->`.
    """

    language: str
    text: str
    marked: bool
    printed: str | None


@cache
def text_of(name: str) -> str:
    """Return the text of a page."""
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(name: str) -> list[Block]:
    """Return the blocks of commands (`sh`) and of Python of a page, in order."""
    mark = r"^((?:\{\.(?:long|setup)\}|<!-- (?:long|setup) -->)\n)?"
    pattern = r"```(sh|python)\n(.*?)^```$(?:\n\nprints\n\n```text\n(.*?)^```$)?"
    found = re.findall(mark + pattern, text_of(name), re.MULTILINE | re.DOTALL)
    return [Block(language, text, bool(mark), printed or None) for mark, language, text, printed in found]


def commands(block: Block) -> list[list[str]]:
    """Return the words of every command of a block."""
    lines = block.text.replace("\\\n", " ").splitlines()
    return [words for line in lines if (words := shlex.split(line, comments=True))]


@cache
def command_line():
    """Return the command line as an object of the library that parses its options."""
    return typer.main.get_command(app)


def slugs(text: str) -> set[str]:
    """Return the anchors of the headings of a page."""
    headings = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in headings}
