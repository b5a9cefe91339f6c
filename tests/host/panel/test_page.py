"""The page of a panel in a real browser, with a virtual board behind it: seen, set, armed, pushed, broken and left."""

import re
import signal
import time
import urllib.error
import urllib.request

import numpy as np
import psutil
import pytest

from hardwall.host.panel.view import ADVICE
from support.browser_tests import browsers_or_skip
from support.page_at_rest import SIZES, rests
from support.processes import HARDWALL, ended, line, started, wait_until
from support.virtual_boards import SCENE, running

browsers = browsers_or_skip()
Axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe


def refused(url: str) -> int:
    with pytest.raises(urllib.error.HTTPError) as error:
        urllib.request.urlopen(url, timeout=60)
    return error.value.code


def test_nothing_is_served_without_the_token(panel, tab):
    root, token = re.fullmatch(r"(http://127\.0\.0\.1:\d+/)([\w-]{22})/", panel.url).groups()
    assert refused(root) == refused(f"{root}live") == refused(f"{root}{token[:-1]}/") == 403
    assert refused(f"{root}_nicegui_ws/socket.io/?EIO=4&transport=polling") == 403
    open_ = """(url) => new Promise((done) => {
      const socket = new WebSocket(url);
      socket.onopen = () => done("open");
      socket.onerror = () => done("refused");
    })"""
    socket = root.replace("http", "ws")
    assert tab.page.evaluate(open_, f"{socket}live?tab=a") == "refused"
    assert tab.page.evaluate(open_, f"{socket}{'x' * 22}/live?tab=a") == "refused"
    assert tab.page.evaluate(open_, f"{socket}{token}/live?tab=a") == "open"


def test_everything_comes_from_the_panel_itself(panel, tab):
    assert len(tab.asked) > 10
    assert [url for url in tab.asked if not url.startswith((panel.url, panel.url.replace("http", "ws"), "data:"))] == []
    # The system's browser shows the fonts of the page, too.
    assert tab.page.evaluate("document.fonts.ready.then((fonts) => fonts.check('16px Roboto'))")


def test_a_stiffness_arrives_at_the_board(tab):
    tab.type("wall_stiffness", 3000)
    wait_until(lambda: tab.used("wall_stiffness") == pytest.approx(3000, abs=4))
    slider = tab.page.locator("[data-word=wall_stiffness] .q-slider")
    box = slider.bounding_box()
    tab.page.mouse.click(box["x"] + box["width"] * 0.75, box["y"] + box["height"] / 2)
    wait_until(lambda: tab.used("wall_stiffness") > 10_000)
    tab.type("wall_stiffness", 2000)
    wait_until(lambda: tab.used("wall_stiffness") == pytest.approx(2000, abs=4))


def test_a_hand_is_pushed_back_by_the_wall_while_it_is_armed(tab):
    with tab.dragged(4):
        wait_until(lambda: tab.sample[1] > 7e-3)
        assert tab.sample[4] == 0
    rests(tab)
    tab.arm()
    with tab.dragged(4):
        tab.until(lambda: tab.sample[4] < -0.5 and tab.state == "ARMED")
        assert tab.sample[1] > 5e-3
    tab.press("disarm")
    wait_until(lambda: tab.state == "DISARMED")


def test_what_the_estimators_make_is_sent_and_played(tab):
    assert tab.of("estimates", "sound.next") == 0
    tab.page.select_option("#sound", "1")
    wait_until(lambda: tab.of("estimates", "sound.next") > 0)
    assert tab.of("estimates", "sound.entry.context.state") == "running"
    tab.page.select_option("#sound", "")
    tab.page.wait_for_timeout(300)
    before = tab.of("estimates", "sound.next")
    tab.page.wait_for_timeout(300)
    assert tab.of("estimates", "sound.next") == before


@pytest.mark.parametrize(("fault", "cause"), [("stop", "emergency_stop: "), ("wire", "encoder_loss: ")])
def test_what_breaks_trips_and_is_acknowledged_when_it_is_mended(tab, fault, cause):
    tab.arm()
    tab.fault(fault)
    wait_until(lambda: tab.state == "TRIPPED" and cause in tab.text("why"))
    assert "Then acknowledge" in tab.text("do")
    # On a slow machine the link's time-out may come besides, and the first press names other causes.
    wait_until(
        lambda: tab.press("acknowledge") or tab.page.wait_for_timeout(300) or "still tripped" in tab.text("said")
    )
    assert tab.state == "TRIPPED"
    tab.fault(fault)
    wait_until(lambda: not tab.page.locator(".fault.broken").count())
    wait_until(lambda: tab.press("acknowledge") or tab.state == "DISARMED")
    tab.arm()


def test_a_drawing_that_fails_is_told_once_and_ends_no_other(panel, tab):
    tab.page.evaluate("CanvasRenderingContext2D.prototype.roundRect = () => { throw new Error('no hand today') }; 0")
    wait_until(lambda: tab.page.wait_for_timeout(50) or tab.errors)
    frames = "new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(() => done(true))))"
    assert tab.page.evaluate(frames)
    # Signs of life come with the frames.
    tab.arm()
    # And the check for a silent server.
    panel.send_signal(signal.SIGSTOP)
    try:
        wait_until(lambda: tab.state == "SILENT")
    finally:
        panel.send_signal(signal.SIGCONT)
    assert tab.errors == ["no hand today"]
    tab.errors.clear()


def test_a_window_without_room_draws_again_when_it_has_some(tab):
    tab.page.set_viewport_size({"width": 150, "height": 600})
    tab.page.wait_for_timeout(500)
    tab.page.set_viewport_size({"width": 1280, "height": 1100})
    tab.arm()
    tab.press("disarm")
    assert tab.errors == []


def test_a_clock_that_stands_is_a_board_that_is_silent(tab):
    tab.fault("clock")
    wait_until(lambda: tab.state == "SILENT")
    tab.fault("clock")
    wait_until(lambda: tab.state in ("DISARMED", "TRIPPED"))


def test_two_tabs_see_the_same_and_only_the_one_that_armed_does_more_than_disarm(panel, chromium, tab):
    other = browsers.Tab(chromium, panel.url)
    tab.until(lambda: tab.state == other.state == "ARMED" and "Another tab armed it" in other.text("do"))
    assert other.page.locator("body.locked").count() == 1
    assert tab.page.locator("body.locked").count() == 0
    assert other.page.locator("aside[inert]").count() == 1
    assert tab.page.locator("aside[inert]").count() == 0
    before = other.used("wall_damping")
    # A tab that does not keep to it is refused.
    other.page.evaluate("""() => {
      const aside = document.querySelector("aside");
      Object.defineProperty(aside, "inert", { set: () => {} });
      aside.removeAttribute("inert");
    }""")
    tab.until(lambda: other.type("wall_damping", 33) or "another tab armed" in other.text("said"))
    assert other.used("wall_damping") == before
    other.page.keyboard.press("Escape")
    wait_until(lambda: tab.state == other.state == "DISARMED")
    other.page.context.close()


WAYS = {
    "closed": lambda page: page.close(),
    "reloaded": lambda page: page.reload(),
    "hung": lambda page: page.evaluate(
        "setTimeout(() => { for (const end = Date.now() + 3000; Date.now() < end; ); })"
    ),
    "not drawn": lambda page: page.evaluate("window.requestAnimationFrame = () => {}"),
    "hidden": lambda page: page.evaluate(
        "Object.defineProperty(document, 'hidden', { get: () => true });"
        "document.dispatchEvent(new Event('visibilitychange'))"
    ),
}
"""What may become of a tab that armed."""


@pytest.mark.parametrize("way", WAYS)
def test_a_tab_that_is_gone_leaves_a_board_that_is_not_armed(panel, chromium, tab, way):
    armed = browsers.Tab(chromium, panel.url)
    armed.arm()
    wait_until(lambda: tab.state == "ARMED")
    began = time.monotonic()
    WAYS[way](armed.page)
    wait_until(lambda: tab.state in ("DISARMED", "TRIPPED"))
    print(f"{way}: {tab.state} seen after {time.monotonic() - began:.2f} s")
    armed.page.context.close()


def test_a_board_that_is_gone_is_said_and_had_again(panel, tab):
    tab.arm()
    board = next(child for child in psutil.Process(panel.pid).children() if "virtual" in child.cmdline())
    board.kill()
    wait_until(lambda: tab.state == "NO BOARD")
    assert "is gone" in tab.text("why")
    # Nothing can be asked of it, by hand or by keys.
    wait_until(lambda: tab.page.locator("aside[inert]").count() == 1)
    assert tab.page.locator(".fault:enabled").count() == 0
    tab.press("connect")
    wait_until(lambda: tab.state == "DISARMED")
    wait_until(lambda: tab.used("wall_stiffness") == pytest.approx(2000, abs=4))


def test_a_contact_is_captured_zoomed_and_saved(tab, tmp_path):
    card = tab.page.locator(".capture")
    assert not card.locator(".nicegui-echart").is_visible()
    card.get_by_label("Time").fill("40")
    tab.arm()
    card.get_by_text("Capture", exact=True).last.click()
    wait_until(lambda: "trigger" in card.locator(".state").inner_text())
    with tab.dragged(4):
        tab.until(lambda: tab.sample[4] < -0.5)
    tab.press("disarm")
    wait_until(lambda: "records at" in card.locator(".state").inner_text())
    chart = card.locator(".nicegui-echart")
    wait_until(chart.is_visible)
    shown = """(chart) => {
      const options = getElement(Number(chart.id.slice(1))).chart.getOption();
      return [options.dataZoom[0].end - options.dataZoom[0].start, options.series.map((each) => each.data.length)];
    }"""
    wait_until(lambda: chart.evaluate(shown)[1] == [2048] * 3)
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert chart.evaluate(shown)[0] == 100
    tab.page.mouse.move(box["x"] + box["width"] / 3, box["y"] + box["height"] / 2)
    tab.page.mouse.wheel(0, -500)
    wait_until(lambda: chart.evaluate(shown)[0] < 95)
    with tab.page.expect_download() as download:
        card.get_by_text("Save .npz").click()
    download.value.save_as(tmp_path / "capture.npz")
    with np.load(tmp_path / "capture.npz") as saved:
        assert len(saved["position_m"]) == 2048
        place = int(saved["place"])
        # The wall is at 5 mm, and pushes from there on.
        assert saved["force_n"][place:].min() < 0
        assert np.all(saved["force_n"][: place - 1] == 0)
        assert saved["position_m"][place] == pytest.approx(5e-3, abs=2e-4)


def test_the_index_becomes_the_origin_and_the_first_one_again(tab):
    card = tab.page.locator(".home")

    def begins() -> bool:
        """Press again where this machine was too slow for it, so that nothing was done."""
        if "move the handle over it" in card.inner_text():
            return True
        if card.get_by_text("Home", exact=True).count():
            card.get_by_text("Home", exact=True).click()
        tab.page.wait_for_timeout(1000)
        return False

    wait_until(begins)
    card.get_by_text("Leave it").click()
    wait_until(lambda: card.get_by_text("Home", exact=True).count())
    wait_until(begins)
    with tab.dragged(4):
        wait_until(lambda: "it is homed: the handle is at" in tab.text("said"))
    wait_until(lambda: "It is homed." in card.inner_text())
    at_mm = float(re.search(r"at (-?[\d.e-]+) mm", tab.text("said"))[1])
    assert abs(at_mm) < 9
    # What the hand holds is in the board's positions, which have moved.
    with tab.dragged(-3):
        wait_until(lambda: abs(tab.sample[1] - 2e-3) < 0.5e-3)


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_a_page_has_names_contrast_and_landmarks(panel, chromium, tab, size, scheme):
    """Axe, at rest and while the axis is armed and tripped, with all open that can be."""
    sized = browsers.Tab(chromium, panel.url, *SIZES[size], scheme)
    sized.open_all()
    found = []
    for fault in ("", "stop"):
        if fault:
            sized.arm()
            sized.fault(fault)
            wait_until(lambda: sized.state == "TRIPPED")
        found += [(v["id"], [n["html"] for n in v["nodes"]]) for v in Axe().run(sized.page).response["violations"]]
    sized.page.context.close()
    rests(tab)
    assert found == []


def test_what_the_page_asks_for_shows_no_bar_without_a_name(tab):
    ask = """new Promise((done) => {
      const request = new XMLHttpRequest();
      request.onloadend = () => requestAnimationFrame(() => requestAnimationFrame(done));
      request.open("GET", "static/panel.css");
      request.send();
    }).then(() => true)"""
    assert tab.page.evaluate(ask)
    assert tab.page.get_by_role("progressbar").count() == 0


def test_controls_are_called_by_what_they_set_and_drawings_by_what_they_show(tab):
    for name in ("Stiffness K, N/m", "Damping B, N s/m", "Wall begins at, mm", "Force limit, N"):
        for role in ("slider", "spinbutton"):
            assert tab.page.get_by_role(role, name=name, exact=True).count() == 1
    assert tab.page.get_by_role("switch", name="Never pull", exact=True).count() == 1
    assert tab.page.locator("html").get_attribute("lang") == "en-US"
    said = tab.page.get_by_role("status")
    assert said.count() == 1
    assert "DISARMED" in said.inner_text()
    wait_until(
        lambda: re.search(r"position -?\S+ mm, velocity", tab.page.locator("#traces").get_attribute("aria-label"))
    )
    wait_until(lambda: "plain difference" in tab.page.locator("#estimates").get_attribute("aria-label"))


def test_a_phone_has_the_sliders_of_the_wall_within_reach_of_the_hand(panel, chromium, tab):
    phone = browsers.Tab(chromium, panel.url, *SIZES["phone"])
    phone.arm()
    phone.fault("stop")
    wait_until(lambda: phone.state == "TRIPPED")
    # The longest texts, whole, with a refusal and without one.
    longest = max(ADVICE.values(), key=len)
    for said in ("", "The wish is older than 2 s, and was dropped"):
        height, cut = phone.page.evaluate(
            """([advice, said]) => {
              const parts = ["head", "why", "do", "said"].map((id) => document.getElementById(id));
              parts[2].textContent = `${advice}. Then acknowledge, and arm again.`;
              parts[3].textContent = said;
              return [parts[0].clientHeight, parts.some((part) => part.scrollHeight > part.clientHeight + 1)];
            }""",
            [longest, said],
        )
        assert height <= 120
        assert not cut
    assert phone.page.evaluate("document.documentElement.scrollWidth") <= 390
    hand = phone.page.locator("#hand").bounding_box()
    slider = phone.page.locator("[data-word=wall_stiffness] .q-slider").bounding_box()
    assert 0 < slider["y"] - (hand["y"] + hand["height"]) < 150
    phone.page.context.close()
    rests(tab)


def test_a_hand_moves_by_keys_and_lets_go(tab):
    hand = tab.page.locator("#hand")
    hand.focus()
    before = tab.sample[1]
    hand.press("ArrowRight")
    hand.press("ArrowRight")
    wait_until(lambda: "held at" in (hand.get_attribute("aria-valuetext") or ""))
    wait_until(lambda: tab.sample[1] == pytest.approx(before + 1e-3, abs=0.4e-3))
    # A mouse that only goes over it is no hand.
    box, held = hand.bounding_box(), hand.get_attribute("aria-valuetext").rpartition("held at")[2]
    tab.page.mouse.move(box["x"] + 20, box["y"] + 90, steps=5)
    tab.page.wait_for_timeout(1000)
    assert hand.get_attribute("aria-valuetext").rpartition("held at")[2] == held
    hand.press("PageUp")
    wait_until(lambda: "inside the wall" in hand.get_attribute("aria-valuetext"))
    hand.press("Enter")
    wait_until(lambda: "free" in hand.get_attribute("aria-valuetext"))


def test_a_board_at_a_port_is_armed_and_has_no_hand(chromium):
    with running(SCENE) as board, started(HARDWALL, "panel", board.path) as process:
        tab = browsers.Tab(chromium, line(process).removeprefix("page: "))
        assert tab.page.locator("canvas").count() == 1
        assert tab.page.locator(".fault").count() == 0
        tab.arm()
        board.order("open emergency_stop")
        wait_until(lambda: tab.state == "TRIPPED")
        process.send_signal(signal.SIGINT)
        assert ended(process)[0] == 130
        wait_until(lambda: tab.state == "NO PANEL")
        assert tab.errors == []
        tab.page.context.close()
