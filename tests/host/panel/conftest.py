"""A board of the model that arms and trips as a board does, behind a driver; and a virtual one behind a real page."""

import subprocess
from collections.abc import Iterator

import pytest
from host.twin_board import TwinBoard

from hardwall.host.connect import connect
from hardwall.host.panel.driver import Driver
from hardwall.model.axis.supervisor import ARMED, DISARMED
from support.page_at_rest import PANEL, rests
from support.processes import line, started


class ArmingBoard(TwinBoard):
    """A board that follows the pulses of arming; `beats` counts the heartbeats."""

    def react(self, pulses: tuple[str, ...]) -> None:
        if "arm" in pulses:
            self.show(state=ARMED)
        if "disarm" in pulses:
            self.show(state=DISARMED)
        if "acknowledge" in pulses:
            self.show(state=DISARMED, latched=0)


@pytest.fixture
def board(registers) -> Iterator[ArmingBoard]:
    with ArmingBoard(registers) as twin:
        twin.show(ready=1, live=1)
        yield twin


@pytest.fixture
def driver(board) -> Iterator[Driver]:
    found = Driver(lambda: connect(board.name, answer_s=2.0))
    yield found
    found.close()


@pytest.fixture(scope="module")
def panel() -> Iterator[subprocess.Popen]:
    """The page of a virtual board; its process has the `url`."""
    with started(*PANEL) as process:
        process.url = line(process).removeprefix("page: ")
        yield process


@pytest.fixture(scope="module")
def chromium() -> Iterator[object]:
    from support.browsers import browser  # noqa: PLC0415  (only tests in a browser need one)

    with browser() as found:
        yield found


@pytest.fixture
def tab(panel, chromium) -> Iterator[object]:
    """A tab whose board is whole and disarmed, with a soft wall at 5 mm, in front of which the handle is."""
    from support.browsers import Tab  # noqa: PLC0415

    found = Tab(chromium, panel.url)
    rests(found)
    yield found
    assert found.errors == []
    found.page.context.close()
