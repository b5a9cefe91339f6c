"""The traces in a real browser: which signals are shown, a pause, two cursors, and ranges by hand."""

import re

import pytest

from support.browser_tests import browsers_or_skip
from support.page_at_rest import PANEL, SIZES
from support.processes import line, started, wait_until

browsers = browsers_or_skip()
LEFT, RIGHT, SHOWN_S = 58, 96, 10
"""The edges beside the drawing, pixels, and the time that it shows."""
TEXTS = """new Promise((done) => {
  const real = CanvasRenderingContext2D.prototype.fillText, texts = [];
  CanvasRenderingContext2D.prototype.fillText = function (text, ...place) {
    if (this.canvas.id === "traces") texts.push(text);
    return real.call(this, text, ...place);
  };
  requestAnimationFrame(() => requestAnimationFrame(() => {
    CanvasRenderingContext2D.prototype.fillText = real;
    done(texts);
  }));
})"""
"""What is written in the drawing in a frame."""


def shown(tab) -> list[str]:
    return tab.of("signals", "shownSignals().map((each) => each.name)")


def paused(tab) -> list[list[float]]:
    """Let the traces stand still; return the samples that they show, when there are some seconds of them."""
    wait_until(
        lambda: tab.of("traces", "samples.length") > 100 and tab.sample[0] - tab.of("traces", "samples[0][0]") > 5
    )
    tab.page.locator("#pause").click()
    return tab.of("traces", "drawnSamples()")


def readout(tab) -> dict[str, list[str]]:
    """Return the rows of the readout, without their names: A, B, and the difference."""
    rows = [row.inner_text().replace("\u2212", "-").split("\t") for row in tab.page.locator("#readout tr").all()]
    return {name: values for name, *values in rows}


def nearest(samples: list[list[float]], age_s: float) -> list[float]:
    return min(samples, key=lambda each: abs(samples[-1][0] - age_s - each[0]))


def test_the_signals_that_are_chosen_are_drawn_for_as_long_as_the_page_lives(tab):
    canvas = tab.page.locator("#traces")
    assert shown(tab) == ["position", "velocity", "force"]
    before = canvas.bounding_box()["height"]
    tab.page.get_by_text("Signals and ranges").click()
    tab.page.get_by_role("checkbox", name="wall force, N", exact=True).press("Space")
    tab.page.get_by_role("checkbox", name="velocity, mm/s", exact=True).uncheck()
    tab.page.get_by_role("checkbox", name="position, mm", exact=True).uncheck()
    assert shown(tab) == ["wall force", "force"]
    texts = tab.page.evaluate(TEXTS)
    assert "wall force, N" in texts
    assert "velocity, mm/s" not in texts
    wait_until(lambda: canvas.bounding_box()["height"] < before)
    wait_until(lambda: "wall force" in canvas.get_attribute("aria-label"))
    tab.page.get_by_text("Signals and ranges").click()
    tab.arm()
    tab.press("disarm")
    assert shown(tab) == ["wall force", "force"]
    tab.page.get_by_text("Signals and ranges").click()
    for name in ("wall force, N", "force, N"):
        tab.page.get_by_role("checkbox", name=name, exact=True).uncheck()
    assert any("No signal is chosen" in text for text in tab.page.evaluate(TEXTS))
    wait_until(lambda: "no signal is chosen" in canvas.get_attribute("aria-label"))


def test_a_board_with_an_acceleration_has_its_trace_and_captures_it(tab, chromium):
    assert "acceleration" not in tab.of("signals", "SIGNALS.map((each) => each.name)")
    assert not tab.page.get_by_label("Record").is_visible()
    with started(*PANEL, "--set", "controller.estimator=kalman") as process:
        other = browsers.Tab(chromium, line(process).removeprefix("page: "))
        assert shown(other) == ["position", "velocity", "force"]
        other.page.get_by_text("Signals and ranges").click()
        other.page.get_by_role("checkbox", name="acceleration, m/s\u00b2", exact=True).check()
        assert shown(other) == ["position", "velocity", "acceleration", "force"]
        assert "acceleration, m/s\u00b2" in other.page.evaluate(TEXTS)
        card = other.page.locator(".capture")
        card.get_by_label("Record").click()
        other.page.get_by_role("option", name="acceleration").click()
        card.get_by_label("Trigger").click()
        other.page.get_by_role("option", name="now").click()
        card.get_by_text("Capture", exact=True).last.click()
        wait_until(lambda: "records at" in card.locator(".state").inner_text())
        names = """(chart) => getElement(Number(chart.id.slice(1))).chart.getOption().yAxis.map((each) => each.name)"""
        chart = card.locator(".nicegui-echart")
        wait_until(lambda: "acceleration (m/s\u00b2)" in chart.evaluate(names))
        assert other.errors == []
        other.page.context.close()


def test_a_pause_holds_the_traces_while_the_data_goes_on_and_says_so(tab):
    tab.arm()
    samples = paused(tab)
    assert "The board goes on" in tab.text("paused")
    assert tab.page.locator("#pause").get_attribute("aria-pressed") == "true"
    wait_until(lambda: tab.sample[0] > samples[-1][0] + 1.5)
    assert tab.of("traces", "drawnSamples()") == samples
    wait_until(lambda: float(re.search(r"They are ([\d.]+) s old", tab.text("since"))[1]) > 1)
    # And it is no reason to disarm: the tab shows that it lives.
    tab.until(lambda: tab.state == "ARMED")
    tab.page.locator("#pause").press("Enter")
    assert not tab.page.locator("#still").is_visible()
    assert tab.of("traces", "drawnSamples() === all.samples")
    tab.press("disarm")


def test_two_cursors_show_the_differences_in_time_and_in_value(tab):
    with tab.dragged(-2):
        wait_until(lambda: tab.sample[1] > 1e-3)
        tab.page.wait_for_timeout(1500)
    samples = paused(tab)
    tab.page.locator("#cursors").press("Enter")
    first = tab.page.get_by_role("slider", name="Cursor A", exact=True)
    for _ in range(10):
        first.press("ArrowRight")
    tab.page.get_by_role("slider", name="Cursor B", exact=True).press("End")
    a, b = nearest(samples, 3.8), samples[-1]
    found = readout(tab)
    assert [float(each) for each in found["time, s"]] == pytest.approx([a[0] - b[0], 0.0, b[0] - a[0]], abs=0.51e-3)
    assert float(found["1/\u0394t, Hz"][2]) == pytest.approx(1 / (b[0] - a[0]), abs=0.51e-3)
    position = [1e3 * a[1], 1e3 * b[1], 1e3 * (b[1] - a[1])]
    assert [float(each) for each in found["position, mm"]] == pytest.approx(position, abs=0.51e-3)
    velocity = [1e3 * a[2], 1e3 * b[2], 1e3 * (b[2] - a[2])]
    assert [float(each) for each in found["velocity, mm/s"]] == pytest.approx(velocity, abs=0.051)
    said = first.get_attribute("aria-valuetext")
    assert "position" in said
    assert "difference" in said
    # At one place there is no rate.
    first.press("End")
    assert readout(tab)["1/\u0394t, Hz"][2] == "\u2013"
    # By the mouse: the nearer cursor follows a drag.
    tab.page.get_by_role("slider", name="Cursor B", exact=True).press("Home")
    canvas = tab.page.locator("#traces")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    across = lambda age_s: box["x"] + LEFT + (box["width"] - LEFT - RIGHT) * (1 - age_s / SHOWN_S)  # noqa: E731
    tab.page.mouse.move(across(0.5), box["y"] + 60)
    tab.page.mouse.down()
    tab.page.mouse.move(across(2), box["y"] + 60, steps=4)
    tab.page.mouse.up()
    tab.page.mouse.move(across(4), box["y"] + 60)
    assert tab.of("cursors", "cursors.ages") == pytest.approx([2, SHOWN_S], abs=0.05)
    # The thumb of a slider is where its cursor is drawn.
    slider = first.bounding_box()
    assert slider["x"] + 8 == pytest.approx(across(SHOWN_S), abs=1.5)
    assert slider["x"] + slider["width"] - 8 == pytest.approx(across(0), abs=1.5)
    tab.page.locator("#cursors").click()
    assert not tab.page.locator("#measure").is_visible()


def test_a_range_by_hand_stays_until_it_is_automatic_again(tab):
    tab.page.get_by_text("Signals and ranges").click()
    follows = tab.page.get_by_role("checkbox", name="Range of position, mm: automatic", exact=True)
    low, high = (
        tab.page.get_by_role("spinbutton", name=f"Range of position, mm: {end}", exact=True) for end in ("from", "to")
    )
    assert low.is_disabled()
    # While the traces stand still, what is drawn and its range are of one moment.
    tab.page.locator("#pause").click()
    follows.uncheck()
    seen = tab.of("signals", "SIGNALS[0].range")
    assert [float(low.input_value()), float(high.input_value())] == seen
    drawn = tab.of("traces", "drawnSamples()")
    positions = [1e3 * sample[1] for sample in drawn if sample[0] > drawn[-1][0] - SHOWN_S]
    assert seen[0] < min(positions) <= max(positions) < seen[1]
    tab.page.locator("#pause").click()
    low.fill("-40")
    high.fill("40")
    assert tab.of("signals", "SIGNALS[0].range") == [-40, 40]
    assert {"\u221240", "40"} <= set(tab.page.evaluate(TEXTS))
    for wrong in ("-40", "-50", "", "1e12"):
        high.fill(wrong)
        assert "from must be a number below to" in tab.page.locator(".wrong").first.inner_text()
        assert high.get_attribute("aria-invalid") == "true"
        assert tab.of("signals", "SIGNALS[0].range") == [-40, 40]
    high.fill("30")
    assert tab.page.locator(".wrong").first.inner_text() == ""
    follows.check()
    assert tab.of("signals", "SIGNALS[0].range") is None
    assert low.is_disabled()
    assert "\u221240" not in tab.page.evaluate(TEXTS)


def test_a_readout_that_fails_is_told_once_and_ends_no_drawing(tab):
    tab.page.locator("#cursors").click()
    tab.page.evaluate("Element.prototype.replaceChildren = () => { throw new Error('no rows today') }; 0")
    wait_until(lambda: tab.page.wait_for_timeout(50) or tab.errors)
    assert "position, mm" in tab.page.evaluate(TEXTS)
    tab.arm()
    tab.page.wait_for_timeout(1500)
    tab.until(lambda: tab.state == "ARMED")
    assert tab.errors == ["no rows today"]
    tab.errors.clear()
    tab.press("disarm")


def test_on_a_phone_a_finger_moves_a_cursor_and_nothing_scrolls_sideways(panel, chromium, tab):
    phone = browsers.Tab(chromium, panel.url, *SIZES["phone"])
    phone.open_all()
    canvas = phone.page.locator("#traces")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    across = box["x"] + LEFT + (box["width"] - LEFT - RIGHT) * 0.1
    # The head covers what is at the top.
    phone.page.touchscreen.tap(across, box["y"] + box["height"] - 60)
    wait_until(lambda: phone.of("cursors", "cursors.ages[0]") == pytest.approx(9, abs=0.2))
    assert phone.page.evaluate("document.documentElement.scrollWidth") <= SIZES["phone"][0]
    small = phone.page.evaluate("""() => {
      const controls = "#pause, #cursors, .signal label, .cursor input, #filter, #tree summary";
      return [...document.querySelectorAll(controls)].filter((each) => each.getBoundingClientRect().height < 24)
        .map((each) => each.outerHTML);
    }""")
    assert small == []
    assert phone.errors == []
    phone.page.context.close()


def test_in_the_dark_the_drawings_are_light_on_dark(panel, chromium, tab):
    dark = browsers.Tab(chromium, panel.url, *SIZES["desk"], "dark")
    for each, is_dark in ((dark, True), (tab, False)):
        ink, paper = each.page.evaluate("""() => {
          const card = getComputedStyle(document.querySelector(".of-traces"));
          return [card.color, card.backgroundColor].map((text) => Number(text.match(/\\d+/)[0]));
        }""")
        assert (ink > paper) == is_dark
        assert (int(each.of("canvas", "colours.ink")[1:3], 16) > 128) == is_dark
    # A browser that changes its mind is followed.
    dark.page.emulate_media(color_scheme="light")
    wait_until(lambda: int(dark.of("canvas", "colours.ink")[1:3], 16) < 128)
    assert dark.errors == []
    dark.page.context.close()
