"""The card of a capture: what triggers it, how far it has come, and its records at the full rate, to be zoomed."""

from nicegui import events, ui

from .chart import chart_of, empty
from .driver import Driver
from .numbers import TIMED, number_of, time_from
from .recorder import IDLE, READING, TRIGGERS, Recording, Wish

ABOUT = "Every sample around an event, from the board's own memory. Turn the wheel over the picture, and drag it."
CALLED = {
    "contact": "contact",
    "trip": "trip",
    "rise": "upwards past a level",
    "fall": "downwards past a level",
    "now": "now",
}
"""The names of the triggers on the page."""
MOTIONS = "velocity", "acceleration"
"""What a record can have beside position and force, on a board with an acceleration."""
STATES = {
    "IDLE": "",
    "FILLING": "keeps what comes before the trigger",
    "WAITING": "waits for its trigger",
    "TRIGGERED": "takes what comes behind the trigger",
    "READING": "is read",
}


class CaptureCard:
    """The card, for one tab.

    Args:
        driver: the board.
        tab: the tab.
    """

    def __init__(self, driver: Driver, tab: str):
        self._driver, self._tab, self._shown = driver, tab, 0
        least_ms, most_ms = (1e3 * span_s for span_s in driver.view.span_s)
        with ui.element("div").classes("card capture"):
            ui.html(f'<div class="title"><h2>Capture</h2><p>{ABOUT}</p></div>', sanitize=False)
            with ui.element("div").classes("asks"):
                self._trigger = ui.select({name: CALLED[name] for name in TRIGGERS}, value=TRIGGERS[0], label="Trigger")
                self._span = ui.number("Time", value=least_ms, min=least_ms, max=most_ms, suffix="ms", format="%.6g")
                self._before = ui.number("Before it", value=25, min=0, max=100, suffix="%", format="%.3g")
                self._level = ui.number("Level", value=0, suffix="mm", format="%.7g")
                rises_or_falls = lambda name: name in ("rise", "fall")  # noqa: E731
                self._level.bind_visibility_from(self._trigger, "value", backward=rises_or_falls)
                self._motion = ui.select(list(MOTIONS), value=MOTIONS[0], label="Record").classes("motion")
                self._motion.set_visibility(driver.view.device is not None and driver.view.device.accelerates)
                for field in (self._trigger, self._span, self._before, self._level, self._motion):
                    field.props("dense outlined hide-bottom-space")
                begin = ui.button("Capture").props("dense no-caps").mark("capture")
                begin.on("click", self._begin, js_handler=TIMED)
                self._save = ui.button("Save .npz", on_click=self._download).props("dense flat no-caps")
                self._state = ui.label().classes("state")
            self._chart = ui.echart(empty())
        self._chart.set_visibility(False)
        self._save.set_visibility(False)

    def refresh(self) -> None:
        """Show what is known of the capture, where it is new."""
        recording = self._driver.view.recording
        self._state.set_text(_said(recording))
        if recording.number != self._shown and recording.captured:
            self._shown = recording.number
            self._chart.set_visibility(True)
            self._save.set_visibility(True)
            self._chart.options.clear()
            self._chart.options.update(chart_of(recording.captured))
            self._chart.update()

    def _begin(self, event: events.GenericEventArguments) -> None:
        fields = {"time": self._span, "before": self._before, "level": self._level}
        if None in (field.value for field in fields.values()):
            ui.notify("a capture needs its numbers", type="warning")
            return
        try:
            span_ms, before_percent, level_mm = (number_of(name, field.value) for name, field in fields.items())
            accelerates = self._motion.value == MOTIONS[1]
            wish = Wish(self._trigger.value, 1e-3 * span_ms, 1e-2 * before_percent, 1e-3 * level_mm, accelerates)
            asked_s = time_from(event.args)
        except (TypeError, ValueError) as error:
            ui.notify(f"{error}", type="warning")
            return
        self._driver.record(self._tab, wish, asked_s)

    def _download(self) -> None:
        captured = self._driver.view.recording.captured
        if captured:
            ui.download.content(captured.npz, f"capture-{captured.identity}.npz")


def _said(recording: Recording) -> str:
    if recording.state == READING:
        return f"It is read: {recording.read:.0%}"
    if recording.state != IDLE:
        return f"It {STATES[recording.state]}"
    captured = recording.captured
    if captured is None:
        return ""
    rate_khz = 1e-3 / (captured.time_s[1] - captured.time_s[0])
    return f"{len(captured.time_s)} records at {rate_khz:g} kHz, {captured.place} before the trigger"
