"""A register map with what a supervisor adds, and a capture memory."""

from functools import cache

from hardwall.model.arithmetic.fixed import SQ, UQ
from hardwall.model.register import Kind, Register
from hardwall.model.registers import RegisterMap

from .specs import spec

SUPERVISOR = (
    Register("state", Kind.STATUS, UQ(2, 0), "The state of the supervisor."),
    Register("causes", Kind.STATUS, UQ(16, 0), "The causes that stand."),
    Register("first_cause", Kind.STATUS, SQ(5, 0), "The cause that came first."),
    Register("trip_stamp", Kind.STATUS, UQ(32, 0), "The clock of the first cause.", 1e-6, "s"),
    Register("acknowledge", Kind.PULSE, UQ(1, 0), "The causes are acknowledged."),
    Register("arm", Kind.PULSE, UQ(1, 0), "The axis is armed."),
    Register("heartbeat", Kind.PULSE, UQ(1, 0), "The host is alive."),
)
CAPTURE_REGISTERS = 300


@cache
def supervised(name: str, estimator: str = "levant") -> RegisterMap:
    """Return the registers of an axis with a supervisor and a capture memory."""
    return RegisterMap(spec(name, estimator), SUPERVISOR, CAPTURE_REGISTERS)


def captured(address: int) -> int:
    """Return the register of the capture memory at a place in it."""
    return address * 40503 % 65536
