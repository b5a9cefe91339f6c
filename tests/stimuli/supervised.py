"""A register map with what a supervisor adds, and a capture memory."""

from functools import cache

from hardwall.model.registers import RegisterMap
from hardwall.model.supervised import Design

from .specs import spec

CAPTURE_REGISTERS = 300


@cache
def supervised(name: str, estimator: str = "levant") -> RegisterMap:
    """Return the registers of an axis with a supervisor and a capture memory."""
    axis = spec(name, estimator)
    return RegisterMap(axis, Design(axis).registers(), CAPTURE_REGISTERS)


def captured(address: int) -> int:
    """Return the register of the capture memory at a place in it."""
    return address * 40503 % 65536
