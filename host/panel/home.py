"""The card of homing: the position that the index gets, and the state of the wait."""

from nicegui import events, ui

from .driver import Driver
from .numbers import TIMED, number_of, time_from

BEGIN, LEAVE = "Home", "Leave it"


class HomeCard:
    """The card, for one tab.

    Args:
        driver: the board.
        tab: the tab.
    """

    def __init__(self, driver: Driver, tab: str):
        self._driver, self._tab = driver, tab
        with ui.element("div").classes("card home"):
            ui.html('<div class="title"><h2>Origin</h2></div>', sanitize=False)
            with ui.element("div").classes("asks"):
                self._at = ui.number("Index is at", value=0, suffix="mm", format="%.7g")
                self._at.props("dense outlined hide-bottom-space")
                self._button = ui.button(BEGIN).props("dense no-caps")
                self._button.on("click", self._press, js_handler=TIMED)
            self._said = ui.label().classes("said")

    def refresh(self) -> None:
        """Show whether the axis is homed, and what homing waits for."""
        view = self._driver.view
        self._button.set_text(LEAVE if view.homing else BEGIN)
        if view.homing:
            self._said.set_text(f"It waits for {view.homing}.")
        else:
            homed = view.status and view.status.referenced
            self._said.set_text("It is homed." if homed else "It is not homed yet.")

    def _press(self, event: events.GenericEventArguments) -> None:
        if self._driver.view.homing:
            self._driver.leave_home()
        elif self._at.value is not None:
            try:
                at_mm, asked_s = number_of("index", self._at.value), time_from(event.args)
            except (TypeError, ValueError) as error:
                self._driver.refuse(f"{error}")
            else:
                self._driver.home(self._tab, 1e-3 * at_mm, asked_s)
