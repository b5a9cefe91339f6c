"""The compiled loop's view of Verilated axes: the addresses of functions, and the values last read from an axis."""

from typing import NamedTuple


class Rtl(NamedTuple):
    """The addresses of three functions of `sim/rtl/library.cpp`, and of the context that holds the Verilated axis."""

    advance: int
    read: int
    move: int  # of a coupling; else it does nothing
    context: int
    latency: int  # clocks of the axis from a strobe to the changed drive


class RtlState(NamedTuple):
    """The values read from the hardware after the last sample; its registers live in its context."""

    drive: int
    velocity: int
    flags: int


class RtlAxis(NamedTuple):
    """The addresses of three functions of `sim/rtl/axes_library.cpp` and of their context, and an axis's number."""

    give: int
    drive: int
    read: int
    context: int
    axis: int
