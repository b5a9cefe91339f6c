"""The quantities of a scene, each a type with the range that is accepted.

`tests/scene/test_quantities.py` runs the loop at both ends of every range. The ranges are wide enough for any device
that a hand touches. They are narrow enough that no sum or product of such numbers leaves the range of float64.
"""

from decimal import ROUND_CEILING, ROUND_FLOOR, Context
from typing import Annotated, Any

from pydantic import BeforeValidator, Field

from ...model.requirements import RATES_HZ


def number(least: float, most: float) -> Any:
    """Return the type of a number from `least` to `most`."""
    return Annotated[float, Field(ge=least, le=most, allow_inf_nan=False)]


def _as_int(value: Any) -> Any:
    """Return a float that is a whole number as an int, as people write a clock of `12e6`; else the value."""
    return int(value) if type(value) is float and value.is_integer() else value


def whole(least: int, most: int) -> Any:
    """Return the type of a whole number from `least` to `most`, which may be written as `1e3`."""
    return Annotated[int, Field(ge=least, le=most), BeforeValidator(_as_int)]


MARGIN = 1 + 1e-12
"""The factor on a computed limit, for the last bits of its products: so a limit written with few digits is accepted."""


def rounded_down(limit: float) -> str:
    """Return an upper limit in six digits, not above it: what a message says is accepted."""
    return f"{float(Context(6, ROUND_FLOOR).create_decimal(repr(float(limit * MARGIN)))):g}"


def rounded_up(limit: float) -> str:
    """Return a lower limit in six digits, not below it."""
    return f"{float(Context(6, ROUND_CEILING).create_decimal(repr(float(limit / MARGIN)))):g}"


def or_none(quantity: Any) -> Any:
    """Return the type of a number that may also be 0: the part or effect is then absent."""
    (limits,) = quantity.__metadata__
    return number(0.0, next(mark.le for mark in limits.metadata if hasattr(mark, "le")))


Mass = number(1e-6, 1e3)  # the needle of an instrument, to a vehicle
SignedMass = number(-1e3, 1e3)
Length = number(1e-12, 1e3)  # a count of an interferometer, to a hall
Place = number(-1e3, 1e3)
Part = number(0.0, 1.0)
Speed = number(1e-9, 1e5)  # a nanometre in a second, to what no encoder follows
Acceleration = number(1e-9, 1e9)  # what shows after minutes, to the largest force on a gram
Jerk = number(1e-12, 1e15)  # what takes the least acceleration minutes, to the largest in a microsecond
Force = number(1e-12, 1e6)  # one step of the smallest force, to a press
Stiffness = number(1e-6, 1e10)  # a hair, to a block of steel
Damping = number(1e-9, 1e7)  # air on a needle, to many dampers of a vehicle
Time = number(1e-9, 1e6)  # one clock of the fastest FPGA, to eleven days
Step = number(1e-13, 1.0)  # the most steps of the slowest and of the fastest sample
Threshold = number(1e-9, 1e3)  # mm: a picometre, to a metre
Bandwidth = number(1e-3, 1e9)  # of a loop that takes minutes, to the clock of the fastest FPGA
SlewRate = number(1e-9, 1e15)  # from none to the largest force in a nanosecond
Current = number(1e-6, 1e6)
Voltage = number(1e-3, 1e5)
Offset = number(-1e5, 1e5)  # volts or amperes
ForcePerUnit = number(1e-9, 1e9)  # newtons of a volt or an ampere
Resistance = number(1e-3, 1e6)
Inductance = number(1e-9, 1e3)
Capacitance = number(1e-12, 1e3)  # of a winding, to a bank of the largest capacitors
TorqueConstant = number(1e-6, 1e3)
Radius = number(1e-4, 1e1)
EdgeError = number(-1.0, 1.0)  # counts: a whole one puts an edge upon its neighbour
EdgeErrorMax = number(1e-6, 1.0)  # counts: below what any stamp resolves, to a whole one
Gain = number(1e-15, 1e15)  # in various units; the words of each estimator hold less, and say so
Rate = whole(*RATES_HZ)
