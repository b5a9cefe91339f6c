"""Boards of the model for a host."""

from collections.abc import Iterator
from dataclasses import replace

import pytest

from hardwall.host.axis import Axis
from hardwall.host.connect import connect
from hardwall.model.axis.registers import RegisterMap
from hardwall.sim.scene.load import load
from host.twin_board import PATIENT, TwinBoard


@pytest.fixture(scope="session")
def registers() -> RegisterMap:
    return RegisterMap(load("mhz").spec)


@pytest.fixture(scope="session")
def accelerated() -> RegisterMap:
    """The registers of a board whose estimator has an acceleration, with a virtual mass."""
    spec = load("mhz", {"controller.estimator": "kalman"}).spec
    return RegisterMap(replace(spec, virtual_mass_max_kg=0.05))


@pytest.fixture
def board(registers) -> Iterator[TwinBoard]:
    with TwinBoard(registers) as twin:
        yield twin


@pytest.fixture
def axis(board) -> Iterator[Axis]:
    with connect(board.name, **PATIENT) as found:
        yield found


@pytest.fixture
def accelerated_board(accelerated) -> Iterator[TwinBoard]:
    with TwinBoard(accelerated) as twin:
        yield twin


@pytest.fixture
def accelerated_axis(accelerated_board) -> Iterator[Axis]:
    with connect(accelerated_board.name, **PATIENT) as found:
        yield found
