"""The pages as a browser shows them: no table scrolls sideways on a screen, and nothing does on a phone.

`make browser` builds the pages and runs it; pictures of five pages, light and dark, are in `build/pages/`.
"""

import os
from pathlib import Path

import pytest

from hardwall.model.runtime.build_folder import build_dir
from support.browsers import ABSENT, CHROMIUM, browser
from support.pages import PAGES, ROOT

SITE = ROOT / "build/docs"
SHOWN = "index", "guide/start", "guide/motor", "results/estimators", "reference/scenes"
"""The pages of which pictures are kept."""
SCREEN, PHONE = 1280, 390
"""Widths in pixels."""
TOO_WIDE = """() => [...document.querySelectorAll('.table-wrapper')].filter(e => e.scrollWidth > e.clientWidth + 1)
    .map(e => `${e.querySelector('th')?.textContent}: ${e.scrollWidth} > ${e.clientWidth}`)"""
BEYOND = "() => document.documentElement.scrollWidth - window.innerWidth"
NAMES = [name.removeprefix("docs/").removesuffix(".md") for name in PAGES if name.startswith("docs/")]

pytestmark = [
    pytest.mark.skipif(not os.environ.get("HARDWALL_BROWSER"), reason="a browser: make browser"),
    pytest.mark.skipif(not CHROMIUM.exists(), reason=ABSENT),
]


@pytest.fixture(scope="module")
def chromium():
    with browser() as found:
        yield found


@pytest.mark.parametrize("width", [SCREEN, PHONE])
def test_nothing_scrolls_sideways(chromium, width):
    tab = chromium.new_page(viewport={"width": width, "height": 900})
    wide = {}
    for name in NAMES:
        tab.goto((SITE / f"{name}.html").as_uri())
        found = tab.evaluate(TOO_WIDE) if width == SCREEN else []
        if tab.evaluate(BEYOND) > 0:
            found.append("the page itself")
        if found:
            wide[name] = found
    tab.close()
    assert wide == {}


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("width", [SCREEN, PHONE])
def test_pictures_of_pages_are_kept(chromium, width, scheme):
    folder = Path(build_dir()) / "pages"
    folder.mkdir(parents=True, exist_ok=True)
    tab = chromium.new_page(viewport={"width": width, "height": 900}, color_scheme=scheme)
    for name in SHOWN:
        tab.goto((SITE / f"{name}.html").as_uri())
        picture = folder / f"{name.replace('/', '-')}-{width}-{scheme}.png"
        tab.screenshot(path=picture)
        assert picture.stat().st_size > 10_000
    tab.close()
