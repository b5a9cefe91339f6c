"""Draw anew the pictures of the page of a panel, in docs/pictures: a real browser at a real panel of a virtual board.

`make screenshots` runs it. What it shows is a run of its own each time: a picture is looked at before it is committed.
"""

import sys
from pathlib import Path

from hardwall.sim.pictures.style import DPI, PAGE_IN
from support.browsers import ABSENT, CHROMIUM, Tab, browser
from support.processes import HARDWALL, line, started, wait_until

PICTURES = Path(__file__).absolute().parents[2] / "docs" / "pictures"
WIDTH, HEIGHT = round(PAGE_IN * DPI), 1250
CARD, MARGIN = 750, 8
"""The width of a window whose cards are below each other, and what is above a card in its picture, pixels."""
STROKES, SPEED_MM_PER_S = 2, 50.0
"""Quick strokes into the wall, and the speed of the slow one behind them, in the board's time."""


FRAMES = 50
FRAME_MS = """async (frames) => {
  const load = (name) => import(new URL(`static/${name}.js`, location.href));
  const [traces, hand, estimates] = await Promise.all(["traces", "hand", "estimates"].map(load));
  const began = performance.now();
  for (let k = 0; k < frames; k++) {
    traces.drawTraces(document.getElementById("traces"));
    hand.drawHand(document.getElementById("hand"));
    estimates.drawEstimates(document.getElementById("estimates"));
  }
  return (performance.now() - began) / frames;
}"""
"""What a frame of the page takes of the browser's processor, ms."""


def push(tab: Tab, beside: Tab) -> None:
    """Push the handle into the wall, out and in again, and draw it there; the traces beside stand still then."""
    with tab.dragged(11):
        tab.until(lambda: tab.sample[4] < -2)
        for stroke in range(2 * STROKES):
            tab.page.mouse.move(*tab.beside(-4 if stroke % 2 == 0 else 11))
            tab.until(lambda out=stroke % 2 == 0: (tab.sample[4] == 0) == out)
        # A slow stroke is in what the estimators show.
        step_ms = 1e3 / (SPEED_MM_PER_S * tab.of("live", "board.told.pace"))
        for way_mm in (*range(11, -5, -1), *range(-4, 12)):
            tab.page.mouse.move(*tab.beside(way_mm))
            tab.page.wait_for_timeout(step_ms)
        tab.until(lambda: tab.state == "ARMED" and tab.sample[4] < -2)
        tab.page.screenshot(path=PICTURES / "panel.png")
        beside.press("pause")
        print(f"{tab.text('pace')}; a frame takes {tab.page.evaluate(FRAME_MS, FRAMES):.1f} ms")


def draw_card(tab: Tab, name: str) -> None:
    """Draw a card of the page, as wide as the page."""
    card = tab.page.locator(f".of-{name}")
    card.evaluate("(card) => card.scrollIntoView({ block: 'end' })")
    box = card.bounding_box()
    clip = {"x": 0, "y": box["y"] - MARGIN, "width": CARD, "height": box["height"] + MARGIN}
    tab.page.screenshot(path=PICTURES / f"panel-{name}.png", clip=clip)


def measure(tab: Tab) -> None:
    """Put two cursors on the traces, which stand still, and draw their card."""
    tab.press("cursors")
    slider = tab.page.locator("#cursor-b")
    slider.press("PageUp")
    slider.blur()
    draw_card(tab, "traces")


def registers(tab: Tab) -> None:
    """Find some registers, and draw the card of all."""
    tab.page.locator("#registers > summary").click()
    tab.page.locator("#filter").fill("wall_")
    wait_until(lambda: "at most a fifth" in tab.text("rate"))
    tab.page.locator("#filter").blur()
    draw_card(tab, "registers")


def trip(tab: Tab) -> None:
    """Cut a wire of the encoder while the axis drives, and draw the head and the hand."""
    tab.arm()
    tab.page.mouse.move(*tab.beside(-5))
    tab.fault("wire")
    wait_until(lambda: tab.state == "TRIPPED")
    tab.page.wait_for_timeout(500)
    hand = tab.page.locator("#hand").bounding_box()
    clip = {"x": 0, "y": 0, "width": WIDTH, "height": round(hand["y"] + hand["height"] + 16)}
    tab.page.screenshot(path=PICTURES / "panel-tripped.png", clip=clip)


def main() -> int:
    if not CHROMIUM.exists():
        print(ABSENT, file=sys.stderr)
        return 1
    with started(HARDWALL, "panel", "virtual") as process, browser() as chromium:
        url = line(process).removeprefix("page: ")
        tab, beside = Tab(chromium, url, WIDTH, HEIGHT), Tab(chromium, url, CARD, HEIGHT, scale=WIDTH / CARD)
        tab.arm()
        push(tab, beside)
        measure(beside)
        registers(beside)
        trip(tab)
    for name in ("panel.png", "panel-traces.png", "panel-registers.png", "panel-tripped.png"):
        print(PICTURES / name)
    return 0


if __name__ == "__main__":
    sys.exit(main())
