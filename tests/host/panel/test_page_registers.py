"""The tree of all registers in a real browser: read while it is open, found by a filter, and never written."""

import re

import pytest

from support.browser_tests import browsers_or_skip
from support.processes import wait_until

browsers_or_skip()


@pytest.fixture
def tree(tab) -> object:
    """The tree of a tab, opened by keys and read once."""
    tab.page.locator("#registers > summary").press("Enter")
    wait_until(lambda: "at most a fifth" in tab.text("rate"))
    return tab.page.locator("#tree")


def item(tab, name: str) -> list[str]:
    """Return value, word, range and address of a register."""
    parts = ("value", "word", "range", "address")
    return [tab.page.locator(f"[data-register={name}] .{part}").text_content() for part in parts]


def test_a_register_shows_value_word_range_and_address(tab, tree):
    value, word, ranged, address = item(tab, "wall_stiffness")
    assert value == "2000 N/m"
    assert re.fullmatch(r"\d+ = 0x[0-9A-F]{8}", word)
    assert re.fullmatch(r"range 0 to [\d.e+]+ N/m", ranged)
    assert re.fullmatch(r"at 0x00[0-9A-F]{2}", address)
    assert item(tab, "state")[0] == "DISARMED"
    assert item(tab, "arm")[:2] == ["", ""]
    assert float(re.search(r"every ([\d.]+) s", tab.text("rate"))[1]) >= 0.5


def test_a_word_that_is_written_elsewhere_is_seen(tab, tree):
    tab.type("wall_damping", 12)
    wait_until(lambda: item(tab, "active_wall_damping")[0] == item(tab, "wall_damping")[0] == "12 N s/m")
    tab.type("wall_damping", 10)
    wait_until(lambda: item(tab, "active_wall_damping")[0] == "10 N s/m")


def test_a_filter_finds_by_name_block_unit_and_address(tab, tree):
    everything = tab.page.locator("#tree li").count()
    tab.page.locator(".branch summary").first.press("Enter")
    field = tab.page.get_by_role("searchbox", name="Filter")
    visible = tab.page.locator("#tree li:visible .name")
    for text, names in (
        ("wall_stiff", ["wall_stiffness", "active_wall_stiffness"]),
        ("LIVE words watchdog", ["supervisor_watchdog"]),
        ("0x0020", ["drive"]),
        ("hz", ["clock_hz"]),
    ):
        field.fill(text)
        assert visible.all_inner_texts() == names
        assert tab.text("found") == f"{len(names)} of {everything} registers"
    field.fill("nothing like it")
    assert tab.page.locator("#tree .branch:visible").count() == 0
    assert tab.text("found") == f"0 of {everything} registers"
    # Without a filter, what was open is open.
    field.fill("")
    assert [block.get_attribute("open") is not None for block in tab.page.locator(".branch").all()] == [True] + [
        False
    ] * 7


def test_a_tree_that_is_closed_is_neither_read_nor_shown_as_if_it_were_of_now(panel, chromium, tab):
    sent = []
    tab.page.on("websocket", lambda socket: socket.on("framesent", lambda text: sent.append(f"{text}")))
    tab.page.reload()
    wait_until(lambda: tab.state == "DISARMED" and len(sent) > 20)
    asked = lambda: sum('"registers"' in text for text in sent)  # noqa: E731
    assert asked() == 0
    assert item(tab, "state")[:2] == ["not read yet", ""]
    summary = tab.page.locator("#registers > summary")
    summary.click()
    wait_until(lambda: item(tab, "state")[0] == "DISARMED")
    assert asked() > 0
    summary.click()
    wait_until(lambda: item(tab, "state")[:2] == ["not read yet", ""])
    assert tab.text("rate") == "" or "Nothing is read" in tab.page.locator("#rate").text_content()
    before = asked()
    tab.page.wait_for_timeout(1500)
    assert asked() == before


def test_a_board_that_is_silent_is_not_read_and_what_is_shown_is_old(tab, tree):
    tab.fault("clock")
    wait_until(lambda: "what is shown is old" in tab.text("rate"))
    assert tab.state == "SILENT"
    assert tab.page.locator("#tree .value").first.evaluate("(value) => Number(getComputedStyle(value).opacity)") < 0.5
    tab.fault("clock")
    wait_until(lambda: "at most a fifth" in tab.text("rate"))


def test_nothing_in_the_tree_writes(tab, tree):
    assert tab.page.locator("#tree").locator("button, input, select, textarea, a, [contenteditable]").count() == 0
    assert tab.page.locator("#registers input").count() == 1


def test_a_tree_that_fails_is_told_once_and_ends_no_drawing(tab, tree):
    tab.page.evaluate("""() => {
      const real = WebSocket.prototype.send;
      WebSocket.prototype.send = function (text) {
        if (`${text}`.includes('"registers"')) throw new Error("no tree today");
        return real.call(this, text);
      };
    }""")
    wait_until(lambda: tab.page.wait_for_timeout(50) or tab.errors)
    before = tab.sample[0]
    wait_until(lambda: tab.sample[0] > before + 1.5)
    tab.arm()
    tab.press("disarm")
    assert tab.errors == ["no tree today"]
    tab.errors.clear()
