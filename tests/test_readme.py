"""The README stays short, as that of the tests; both and every page name only what exists."""

import re
import tomllib

import pytest

from support.pages import PAGES, ROOT, command_line, slugs, text_of

README_LINES, README_WORDS = 120, 900
# NAME and PATH in a page stand for names that the reader fills in.
PLACEHOLDER = re.compile(r"NAME|PATH|CHOICE")


def test_the_readme_is_one_screen_and_a_bit():
    assert len(text_of("README.md").splitlines()) <= README_LINES
    assert len(text_of("README.md").split()) <= README_WORDS


def test_the_readme_leads_to_every_guide_and_the_first_page_to_every_page():
    guides = {name for name in PAGES if name.startswith("docs/guide/")}
    assert guides - set(re.findall(r"\]\((docs/[\w/-]+\.md)\)", text_of("README.md"))) == set()
    pages = {name.removeprefix("docs/").removesuffix(".md") for name in PAGES if name.startswith("docs/")} - {"index"}
    first = text_of("docs/index.md")
    listed = re.findall(r"^((?:guide|results|reference)/[\w-]+)$", first, re.MULTILINE)
    assert sorted(listed) == sorted(pages)
    # The contents are links on the site alone.
    assert pages - set(re.findall(r"\]\(([\w/-]+)\.md\)", first)) == set()


def test_old_addresses_lead_to_pages():
    moved = tomllib.loads(text_of("docs/moved.toml"))
    assert len(moved) > 20
    assert {f"docs/{new}.md" for new in moved.values()} - {*PAGES} == set()
    assert {f"docs/{old}.md" for old in moved} & {*PAGES} == set()


def test_the_tests_say_in_one_screen_where_what_is():
    text = text_of("tests/README.md")
    assert len(text.splitlines()) <= 50
    folders = {path.name for path in (ROOT / "tests").iterdir() if path.is_dir() and path.name != "__pycache__"}
    assert set(re.findall(r"`(\w+)/`", text)) >= folders
    named = re.findall(r"`(test_\w+\.py)`", text)
    assert named
    assert [name for name in named if not (ROOT / "tests" / name).exists()] == []


@pytest.mark.parametrize("name", PAGES)
def test_every_command_that_a_page_names_exists(name):
    commands = set(command_line().list_commands(None))
    assert set(re.findall(r"(?:^|`)hardwall ([a-z]+)", text_of(name), re.MULTILINE)) - commands == set()


@pytest.mark.parametrize("name", PAGES)
def test_every_make_target_that_a_page_names_exists(name):
    targets = set(re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert set(re.findall(r"(?:^|`)make (\w+)", text_of(name), re.MULTILINE)) <= targets


@pytest.mark.parametrize("name", PAGES)
def test_every_variable_of_make_that_a_page_names_exists(name):
    given = re.findall(r"\bmake\b[^`\n]*?\s([A-Z_]+)=", text_of(name))
    named = re.findall(r"`([A-Z_]{2,})`\s+in\s+the\s+`Makefile`", text_of(name))
    # Those that it sets, and those that it only reads.
    known = set(re.findall(r"(?:^|\$\()([A-Z_]+)(?= *[:?]?=|\))", (ROOT / "Makefile").read_text(), re.MULTILINE))
    assert {*given, *named} - known == set()


@pytest.mark.parametrize("name", PAGES)
def test_every_file_that_a_page_names_exists(name):
    named = re.findall(r"`((?:cli|hdl|host|model|sim|tests|constraints|docs)/[\w./-]*)`", text_of(name))
    places = [ROOT, *(ROOT / "docs/examples").iterdir()]
    missing = [each for each in named if not any((place / each).exists() for place in places)]
    assert [each for each in missing if not PLACEHOLDER.search(each) and "..." not in each] == []


@pytest.mark.parametrize("name", PAGES)
def test_every_link_leads_somewhere(name):
    folder = (ROOT / name).parent
    for target in re.findall(r"\]\(([^)\s]+)\)", text_of(name)):
        if re.match(r"https?:|#", target):
            continue
        file, _, anchor = target.partition("#")
        assert (folder / file).exists(), target
        assert not anchor or anchor in slugs((folder / file).read_text()), target
