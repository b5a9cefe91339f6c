"""The content of the page: its head, which the socket fills, the drawings, and a knob for every word."""

import time
from collections.abc import Callable
from functools import partial
from html import escape
from pathlib import Path

from nicegui import events, ui

from .captures import CaptureCard
from .driver import Driver
from .hand import FAULTS
from .home import HomeCard
from .knobs import DIGITS, Field, Group, Knob, Way, knobs_of
from .live import Bench
from .numbers import TIMED, VALUED, number_of, time_from
from .register_tree import markup

STEPS = 1000
"""Places of a slider."""
TOUCH_S = 0.4
"""A touched knob is at rest after this time."""
REFRESH_S = 0.15
"""The time between two looks at what the board uses."""
HEAD, TRACES, REGISTERS = (
    Path(__file__).with_name("static").joinpath(f"{name}.html").read_text(encoding="utf-8")
    for name in ("head", "traces", "registers")
)


def add_page(driver: Driver, bench: Bench | None, title: str, access: str) -> None:
    """Add the page of a board, which every tab builds for itself.

    Args:
        driver: the board.
        bench: what is beside a virtual board; None at a real one.
        title: what the board is called.
        access: what a person must know of the page's address.
    """

    @ui.page("/", language="en-US")
    def _() -> None:
        tab = ui.context.client.id
        ui.add_head_html('<link rel="stylesheet" href="static/panel.css">')
        device = driver.view.device
        accelerates = "true" if device and device.accelerates else "false"
        ui.add_head_html(f'<script>window.hardwallTab = "{tab}"; window.hardwallAccelerates = {accelerates}</script>')
        ui.add_body_html('<script type="module" src="static/panel.js"></script>')
        ui.colors(primary="#1f5f8b")
        ui.html(HEAD, sanitize=False).classes("head")
        with ui.element("div").classes("body"):
            with ui.element("div").classes("drawings"):
                if bench:
                    _hand()
                ui.html(TRACES, sanitize=False).classes("card of-traces")
                if bench and bench.estimates:
                    _estimates(*bench.estimates.names, bench.estimates.sample_hz)
                capture = CaptureCard(driver, tab) if driver.view.span_s[1] else None
                _registers(driver)
            with ui.element("aside").props('aria-label="Words of the board"'):
                knobs = _knobs(driver, tab)
                home = HomeCard(driver, tab)
        about = f"<p>Whoever has the address of this page may arm the board. {escape(access)}</p>"
        ui.html(f"<details><summary>Who may open this page</summary>{about}</details>", sanitize=False).classes(
            "access"
        )
        ui.timer(REFRESH_S, _refresher(driver, knobs))
        ui.timer(REFRESH_S, home.refresh)
        if capture:
            ui.timer(REFRESH_S, capture.refresh)


def _hand() -> None:
    faults = "".join(
        f'<button class="fault" data-fault="{name}" data-mending="{fault.mending}">{fault.breaking}</button>'
        for name, fault in FAULTS.items()
    )
    about = (
        "Drag the handle into the wall, with mouse or finger. With keys: the arrows move it by 0.5 mm, Page Up and "
        "Page Down by 5 mm, and Enter lets go."
    )
    _drawing("hand", "The hand", about, faults)


def _registers(driver: Driver) -> None:
    """Add the card of all registers, whose values come by the socket while it is open."""
    device = driver.view.device
    if device:
        ui.html(REGISTERS.replace("<!-- tree -->", markup(device)), sanitize=False).classes("card of-registers")


def _estimates(own: str, plain: str, sample_hz: int) -> None:
    about = (
        f"The same counts of the encoder, at all {sample_hz} samples a second, through the bit-accurate models of both "
        "estimators, with the words that the board uses; and the force that the wall would make of each."
    )
    sound = (
        '<label class="sound">Sound of the force <select id="sound"><option value="">off</option>'
        f'<option value="0">{own}</option><option value="1">plain difference</option></select></label>'
    )
    _drawing("estimates", f"{own.capitalize()} and the plain difference ({plain})", about, sound, own, sample_hz)


def _drawing(name: str, heading: str, about: str, more: str = "", own: str = "", sample_hz: int = 0) -> None:
    data = f'data-own="{own}" data-rate="{sample_hz}"' if own else ""
    title = f'<div class="title"><h2>{heading}</h2><div class="more">{more}</div><p>{about}</p></div>'
    of = 'role="slider" tabindex="0" aria-valuenow="0"' if name == "hand" else 'role="img"'
    canvas = f'<canvas id="{name}" {of} aria-label="{heading}" {data}></canvas>'
    ui.html(f"{title}{canvas}", sanitize=False).classes(f"card of-{name}")


class _Row:
    """A knob on the page: a slider with a field of numbers, or a switch; and what the board uses.

    Args:
        knob: the word.
        give: takes its new SI value, and when it was wished for.
        refuse: takes the fault of a browser's message.
    """

    def __init__(self, knob: Knob, give: Callable[[float, float], None], refuse: Callable[[str], None]):
        self.knob, self._give, self._refuse, self._touched_s = knob, give, refuse, 0.0
        self._slider = self._number = self._switch = None
        self._field = Field(knob)
        named = f'aria-label="{knob.spoken}"'
        with ui.element("div").classes("knob").props(f'data-word="{knob.name}"'):
            ui.label(knob.label).classes("name")
            if knob.way is Way.SWITCH:
                self._switch = ui.switch().props("dense").props(named)
                self._switch.on("update:model-value", self._switched, js_handler=VALUED)
            else:
                self._slider = ui.slider(min=0, max=STEPS, step=1).props("dense").props(named)
                self._slider.on("update:model-value", self._slid, throttle=0.05, js_handler=VALUED)
                least, most = knob.shown(knob.least), knob.shown(knob.most)
                self._number = ui.number(min=least, max=most, suffix=knob.unit, format=DIGITS)
                self._number.props("dense outlined hide-bottom-space").props(named)
                for event in ("blur", "keydown.enter"):
                    self._number.on(event, self._typed, js_handler=TIMED)
            self._used = ui.label().classes("used")

    @property
    def rests(self) -> bool:
        """Whether nobody has touched it for a while: a knob does not move under a hand."""
        return time.monotonic() - self._touched_s > TOUCH_S

    def show(self, value: float) -> None:
        """Show what the board uses, an SI value."""
        knob = self.knob
        if self._switch:
            self._switch.set_value(value > 0)
            self._used.set_text("on" if value > 0 else "off")
        elif self._slider and self._number:
            self._slider.set_value(round(STEPS * knob.to_slider(value)))
            self._number.set_value(self._field.show(value))
            self._used.set_text(f"{DIGITS % knob.shown(value)} {knob.unit}")

    def _take(self, value_of: Callable[[], float], at: object) -> None:
        """Give a value of a browser, and refuse what is none."""
        self._touched_s = time.monotonic()
        try:
            self._give(value_of(), time_from(at))
        except (TypeError, ValueError) as error:
            self._refuse(f"{error}")

    def _switched(self, event: events.GenericEventArguments) -> None:
        on, at = event.args
        self._take(lambda: float(bool(on)), at)

    def _slid(self, event: events.GenericEventArguments) -> None:
        place, at = event.args
        self._take(lambda: self.knob.from_slider(number_of(self.knob.name, place, 0, STEPS) / STEPS), at)

    def _typed(self, event: events.GenericEventArguments) -> None:
        if self._number and self._field.takes(shown := self._number.value):
            self._take(lambda: self.knob.in_si(number_of(self.knob.name, shown)), event.args)


def _knobs(driver: Driver, tab: str) -> list[_Row]:
    """Add a card for every group of words."""
    device = driver.view.device
    knobs = knobs_of(device) if device else ()
    rows = []
    for group in Group:
        with ui.expansion(group.value, value=group is not Group.WIRING) as card:
            card.classes(f"card group of-{group.name.lower()}").props("dense")
            for knob in knobs:
                if knob.group is group:
                    rows.append(_Row(knob, partial(driver.set, tab, knob.name), driver.refuse))
    return rows


def _refresher(driver: Driver, rows: list[_Row]) -> Callable[[], None]:
    """Return a function that shows the board's values where they are new, or differ from a hand's wish."""
    shown: dict[str, int] = {}

    def refresh() -> None:
        view = driver.view
        for row in rows:
            name = row.knob.name
            if shown.get(name) != view.revision and row.rests and name in view.values:
                shown[name] = view.revision
                row.show(view.values[name])

    return refresh
