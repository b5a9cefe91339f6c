"""What the compiled loop holds of the Verilated axis: where its functions are, and what was read of it."""

from typing import NamedTuple


class Rtl(NamedTuple):
    """Addresses: of the two functions of `sim/rtl/library.cpp`, and of the context that holds the Verilated axis."""

    advance: int
    read: int
    context: int
    latency: int  # of the axis, clocks from a strobe to the changed drive


class RtlState(NamedTuple):
    """What was read of the hardware after the last sample; its registers live in its context."""

    drive: int
    velocity: int
    flags: int
