"""A board of the model that arms and trips as a board does, behind a driver."""

from collections.abc import Iterator

import pytest
from host.twin_board import TwinBoard

from hardwall.host.connect import connect
from hardwall.host.panel.driver import Driver
from hardwall.model.axis.supervisor import ARMED, DISARMED


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
