"""A board of the model for a host, and the real one in simulation."""

from collections.abc import Iterator

import pytest

from hardwall.host.axis import Axis
from hardwall.host.connect import connect
from hardwall.model.axis.registers import RegisterMap
from hardwall.sim.scene.load import load
from host.twin_board import PATIENT, TwinBoard


@pytest.fixture(scope="session")
def registers() -> RegisterMap:
    return RegisterMap(load("mhz").spec)


@pytest.fixture
def board(registers) -> Iterator[TwinBoard]:
    with TwinBoard(registers) as twin:
        yield twin


@pytest.fixture
def axis(board) -> Iterator[Axis]:
    with connect(board.name, **PATIENT) as found:
        yield found
