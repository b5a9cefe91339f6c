"""A browser without a screen, and the page of a panel in it."""

import re
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, Page, sync_playwright

from .processes import PATIENCE_S, wait_until

CHROMIUM = Path("/usr/bin/chromium")
ABSENT = f"there is no {CHROMIUM}: install the Debian package chromium"
PRESS_S = 1.0
"""The time in which an act has its effect, or is tried again."""
PHONE = 700
"""The width of a window, pixels, below which it is one that is touched."""
SHOWN_MM = 50
"""The width of the drawing of the hand."""


@contextmanager
def browser() -> Iterator[Browser]:
    """Yield a browser; a tab of its own has a size of its own."""
    with sync_playwright() as driver:
        # Tabs that are not in front are drawn, too: several windows of a person are.
        flags = ["--no-sandbox", "--autoplay-policy=no-user-gesture-required"]
        chromium = driver.chromium.launch(executable_path=CHROMIUM, args=flags)
        try:
            yield chromium
        finally:
            chromium.close()


class Tab:
    """A tab with the page of a panel.

    Args:
        chromium: the browser.
        url: the page's address.
        width, height: the size of its window, pixels.
        scheme: light or dark; scale: how many pixels of a picture a pixel of the page has.

    Attributes:
        page: the page; asked: the addresses that it asked for; errors: what went wrong in it.
    """

    def __init__(
        self,
        chromium: Browser,
        url: str,
        width: int = 1280,
        height: int = 1100,
        scheme: str = "light",
        scale: float = 1.0,
    ):
        context = chromium.new_context(
            viewport={"width": width, "height": height},
            color_scheme=scheme,
            device_scale_factor=scale,
            has_touch=width < PHONE,
        )
        self.page: Page = context.new_page()
        self.page.set_default_timeout(1e3 * PATIENCE_S)
        self.asked, self.errors = [], []
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.on("pageerror", lambda error: self.errors.append(f"{error}"))
        self.page.goto(url)
        wait_until(lambda: self.page.locator("#head").count() and self.state not in ("NO PANEL", ""))

    def text(self, name: str) -> str:
        """Return the text of an element by its id."""
        return self.page.locator(f"#{name}").inner_text()

    @property
    def state(self) -> str:
        return self.page.locator("#head").get_attribute("data-state") or ""

    @property
    def sample(self) -> list[float]:
        """The last look that the page has drawn: time, position, velocity, the wall's force, the force."""
        wait_until(lambda: self.of("traces", "samples.length"))
        return self.of("traces", "latest()")

    @property
    def wall_m(self) -> float:
        """Where the page shows the wall."""
        return self.of("live", "board.told.wall.position")

    def of(self, script: str, expression: str) -> Any:
        """Return an expression of a script of the page."""
        return self.page.evaluate(
            f"import(new URL('static/{script}.js', location.href)).then((all) => all.{expression})"
        )

    def press(self, name: str) -> None:
        """Press a button of the head, if it has a meaning now."""
        self.page.evaluate("(name) => document.getElementById(name).click()", name)

    def open_all(self) -> None:
        """Show all that is not shown at first: signals, cursors, and all registers once they are read."""
        self.page.locator("#cursors").click()
        self.page.evaluate("for (const each of document.querySelectorAll('details')) each.open = true")
        wait_until(lambda: "at most a fifth" in self.text("rate"))

    def fault(self, name: str) -> None:
        """Break or mend something; press again when this machine was too slow for it, so that nothing was done."""
        button = self.page.locator(f"[data-fault={name}]")
        is_broken = lambda: "broken" in (button.get_attribute("class") or "")  # noqa: E731
        before, pressed = is_broken(), -PRESS_S
        deadline = time.monotonic() + PATIENCE_S
        while is_broken() == before:
            now = time.monotonic()
            assert now < deadline, f"{name}: {self.text('said')}"
            if now - pressed > PRESS_S:
                pressed = now
                button.click()
            self.page.wait_for_timeout(50)

    def used(self, word: str) -> float:
        """Return what the board uses of a word, as the page shows it."""
        text = self.page.locator(f"[data-word={word}] .used").inner_text()
        number = re.match(r"-?[\d.e+]+", text)
        return float(number[0]) if number else float("nan")

    def type(self, word: str, value: float) -> None:
        """Type a number into the field of a word."""
        field = self.page.locator(f"[data-word={word}] input[type=number]")
        field.fill(f"{value:g}")
        field.press("Enter")

    def until(self, so: Callable[[], object]) -> None:
        """Wait until something is so while the board is armed; arm it again when this machine was too slow for it."""
        deadline, pressed = time.monotonic() + PATIENCE_S, -PRESS_S
        while not so():
            now = time.monotonic()
            assert now < deadline, f"{self.state}: {self.text('why')} {self.text('said')}"
            if now - pressed > PRESS_S:
                pressed = now
                self.press({"DISARMED": "arm", "TRIPPED": "acknowledge"}.get(self.state, "state"))
            self.page.wait_for_timeout(50)

    def arm(self) -> None:
        """Arm, and see that it is."""
        self.until(lambda: self.state == "ARMED")

    def beside(self, way_mm: float) -> tuple[float, float]:
        """Return the place on the page that is some way from the wall."""
        begin_mm = self.of("hand", "view.from")
        box = self.page.locator("#hand").bounding_box()
        return box["x"] + (1e3 * self.wall_m + way_mm - begin_mm) * box["width"] / SHOWN_MM, box["y"] + 90

    @contextmanager
    def dragged(self, way_mm: float) -> Iterator[None]:
        """Drag the handle to some way from the wall, hold it there, and let it go."""
        self.page.evaluate("window.scrollTo(0, 0)")
        self.page.mouse.move(*self.beside(1e3 * (self.sample[1] - self.wall_m)))
        self.page.mouse.down()
        self.page.mouse.move(*self.beside(way_mm), steps=5)
        try:
            yield
        finally:
            self.page.mouse.up()
