"""The page of a virtual board for tests in a browser: the command, the sizes of windows, and the page at rest."""

from typing import TYPE_CHECKING

from .processes import HARDWALL, wait_until
from .virtual_boards import SCENE

if TYPE_CHECKING:
    from .browsers import Tab

PANEL = [
    str(HARDWALL),
    "panel",
    "virtual",
    *(word for key, value in SCENE.items() for word in ("--set", f"{key}={value}")),
]
"""The words of the command."""
SIZES = {"desk": (1280, 1100), "phone": (390, 844)}
"""Width and height of windows, pixels."""


def rests(tab: "Tab") -> None:
    """Mend what is broken, acknowledge what stands, disarm, and bring the handle in front of the wall."""
    while (broken := tab.page.locator(".fault.broken")).count():
        broken.first.click()
        tab.page.wait_for_timeout(200)
    wait_until(lambda: tab.press("disarm") or tab.press("acknowledge") or tab.state == "DISARMED")
    if abs(tab.sample[1]) > 2e-3:
        with tab.dragged(-5):
            wait_until(lambda: abs(tab.sample[1]) < 1e-3)
