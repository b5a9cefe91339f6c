"""What leaves the FPGA for the amplifier: the command as steps of a converter, or as pulses."""

import math
from typing import NamedTuple

from ...model.compiled import compiled


class Converter(NamedTuple):
    """A digital-to-analogue converter: its code is the nearest to the command, half a step up."""

    step_n: float
    lowest: int  # codes
    highest: int


class Pulse(NamedTuple):
    """Pulses: in every period of the carrier one level for a part of it, and its opposite for the rest.

    The width is taken from the command as the period begins, in whole steps.
    """

    level_n: float  # the command that is all pulse
    period: int  # clocks; 0 for an output that gives the command as it is
    step: int  # clocks


AS_IT_IS = Pulse(0.0, 0, 0)


@compiled
def converted(converter, command_n):
    """Return what a converter makes of a command; without one, the command."""
    if converter is None:
        return command_n
    code = min(max(command_n / converter.step_n + 0.5, converter.lowest), converter.highest)
    return converter.step_n * math.floor(code)


@compiled
def width_of(pulse, command_n):
    """Return the width (clocks) of the pulse that stands for a command; what is beyond the level is all pulse."""
    steps = pulse.period // pulse.step
    wanted = (command_n / pulse.level_n + 1.0) * 0.5 * steps + 0.5
    return pulse.step * math.floor(min(max(wanted, 0.0), steps))
