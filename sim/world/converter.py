"""The output from FPGA to amplifier: the command as steps of a converter, or as pulses."""

import math
from typing import NamedTuple

from ...model.runtime.compiled import compiled


class Converter(NamedTuple):
    """A digital-to-analogue converter: its code is the nearest to the command, and half a step rounds up."""

    step_n: float
    lowest: int  # code
    highest: int  # code


class Pulse(NamedTuple):
    """Pulses: the output is at one level for a part of every carrier period, and at its opposite for the rest.

    The width is taken from the command at the beginning of the period, in whole steps.
    """

    level_n: float  # the command whose pulse fills the period
    period: int  # clocks; 0 for an output that gives the command as it is
    step: int  # clocks


AS_IT_IS = Pulse(0.0, 0, 0)


@compiled
def converted(converter, command_n):
    """Return the output of a converter for a command; without a converter, the command itself."""
    if converter is None:
        return command_n
    code = min(max(command_n / converter.step_n + 0.5, converter.lowest), converter.highest)
    return converter.step_n * math.floor(code)


@compiled
def width_of(pulse, command_n):
    """Return the width (clocks) of the pulse for a command; a command beyond the level saturates."""
    steps = pulse.period // pulse.step
    width = (command_n / pulse.level_n + 1.0) * 0.5 * steps + 0.5
    return pulse.step * math.floor(min(max(width, 0.0), steps))
