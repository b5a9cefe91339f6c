"""A register map with a capture memory."""

from functools import cache

from hardwall.model.axis.registers import RegisterMap

from .specs import spec

CAPTURE_REGISTERS = 256


@cache
def supervised(name: str, estimator: str = "levant") -> RegisterMap:
    """Return the registers of an axis with a capture memory."""
    return RegisterMap(spec(name, estimator), CAPTURE_REGISTERS)


def captured(address: int) -> int:
    """Return the register of the capture memory at a place in it."""
    return address * 40503 % 65536


CAPTURE_MEMORY = [captured(address) for address in range(CAPTURE_REGISTERS)]
