"""From the wall's force to the drive: decimation, slew limit, force limit, and the conditions that force zero.

Every `samples_per_actuation` samples the drive follows the force:

    drive <- limit(slew(force)):   first |drive| grows by at most slew_limit, then |drive| <= force_limit, last

The slew limit never holds a force on its way to zero: a drive beyond the force, or against it, gives way at once.
Between actuations the drive holds. Without `enable`, or with a fault, the drive is zero at every sample; the slew limit
then starts again from zero. The force limit is applied last.
"""

from typing import NamedTuple

from ..arithmetic.fixed import UQ, saturate
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word

FLAGS = ("slew_limited", "force_limited")
LATENCY = 1
"""Clocks from the strobe to the changed drive: see `hardwall.hdl.axis.output`."""
INTERVAL = 2
"""Clocks from a strobe to the next, at least."""
AHEAD = 2
"""Clocks from the hardware's taking of the limits to the strobe of the first force that they limit."""


class Params(NamedTuple):
    """The limits in force LSB: integer words, or floats for the float64 axis."""

    force_limit: float
    slew_limit: float
    decimation: int


class State(NamedTuple):
    """`phase` counts samples since the last actuation; the drive follows the force at phase 0."""

    phase: int
    drive: float


START = State(0, 0)
FLOAT_START = State(0, 0.0)


class Design:
    """Formats and run-time words of the output stage for an axis.

    `force_limit` is the axis's largest drive; a greater word at run time changes nothing.
    `output_slew_limit` has more bits than the largest growth of the drive, so that its largest word limits nothing.
    """

    latency = LATENCY
    interval = INTERVAL
    ahead = AHEAD
    flags = FLAGS

    def __init__(self, axis: AxisRequirements):
        self.decimation = axis.samples_per_actuation
        self.force = axis.force
        self.force_limit = axis.force_limit_word
        self.slew = UQ(axis.force.width, 0)
        limit = UQ(axis.force.width - 2, 0)
        r = axis.force_resolution_n
        self.words = (
            Word("output_force_limit", limit, r, "N", axis.force_limit_word, "largest drive, either way"),
            Word(
                "output_slew_limit", self.slew, r * axis.actuation_hz, "N/s", self.slew.max, "fastest growth of drive"
            ),
        )

    def params(self, words: dict[str, int]) -> Params:
        """Return the kernel's parameters for the given run-time words."""
        limit = min(words["output_force_limit"], self.force_limit)
        return Params(limit, words["output_slew_limit"], self.decimation)

    def float_params(self, words: dict[str, int]) -> Params:
        """Return the limits of `params` as floats."""
        limits = self.params(words)
        return Params(float(limits.force_limit), float(limits.slew_limit), self.decimation)


@compiled
def step(params, state, force, enable):
    """Take one sample's force: return (state, flags); the drive is `state.drive`.

    Args:
        params: `Params`, of the same number type as the force.
        state: `START`, `FLOAT_START`, or the state that the previous call returned.
        force: the wall's force on the handle, force LSB.
        enable: false forces zero.
    """
    zero = 0 * force
    phase = state.phase + 1 if state.phase + 1 < params.decimation else 0
    if not enable:
        return State(phase, zero), 0
    if state.phase:
        return State(phase, state.drive), 0
    slewed = saturate(force, min(state.drive, zero) - params.slew_limit, max(state.drive, zero) + params.slew_limit)
    limited = saturate(slewed, -params.force_limit, params.force_limit)
    return State(phase, limited), int(slewed != force) | int(limited != slewed) << 1
