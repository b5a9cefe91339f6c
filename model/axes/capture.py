"""The capture memory of several axes: `capture` for one of them at a time; twin of `hardwall.hdl.axes.capture`.

There is one memory for all axes. A `capture_start` selects the axis in the word `capture_axis`. Until the next start
the memory sees only this axis, even if the word changes.

The values of a sample come at two clocks. Its record has all of them except the state and the limited drive. These two
come with the axis's turn. Both are kept until the axis's next sample. The memory takes the sample `SAMPLED` clocks
after its record. So every value of a record in the memory is of one sample. Triggers are found as for a single axis,
except that a trip comes with a turn.

The pulses come to the memory `PULSED` clocks late: a sample of the axis before, which may be on its way, comes with the
start at the latest, and does not count.

A record takes 8 clocks and the memory one more, as for an axis alone. A rota may have fewer, with 8 axes or less: then
there can be no capture memory.
"""

from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import UQ
from ..axis import capture
from ..axis.capture import RECORD_REGISTERS
from ..words import Word
from .axis import AxesSpec

SAMPLED = 2
"""Clocks from a record of the axis to the clock at which the memory takes its sample."""
PULSED = 2
"""Clocks from a pulse of the host to the clock at which the memory takes it."""
ROTA_LEAST = RECORD_REGISTERS + 1
"""The fewest clocks of a rota with a capture memory: the ring is frozen a clock behind its last record."""


class Inputs(NamedTuple):
    """The inputs of the hardware just before a clock edge, by the same names but for `driven`."""

    record_valid: int = 0
    record_axis: int = 0
    record_count: int = 0
    record_velocity: int = 0
    record_wall_force: int = 0
    record_flags: int = 0
    turn_valid: int = 0
    turn_axis: int = 0
    turn_state: int = 0
    driven: tuple[int, ...] = ()  # of every axis the drive that is let out
    live: int = 0
    stamp: int = 0
    capture_address: int = 0
    capture_start: int = 0
    capture_trigger: int = 0
    capture_sources: int = 0
    capture_level: int = 0
    capture_before: int = 0
    capture_decimation: int = 1
    capture_axis: int = 0


class Seen(NamedTuple):
    """The values kept of the axis's last sample."""

    count: int = 0  # type: ignore[assignment]  # a tuple has a method of this name
    velocity: int = 0
    wall_force: int = 0
    flags: int = 0


class State(NamedTuple):
    """Every register beside the memory."""

    captured: capture.State
    axis: int  # whose samples are captured
    states: tuple[int, ...]  # of every axis that of its supervisor after its last turn
    seen: Seen
    driven: int  # with its last turn
    samples: tuple[int, int]  # whether a record of the axis came at the last clock, and at the one before
    starts: tuple[int, int]  # the same of the pulses
    triggers: tuple[int, int]


class Design(capture.Design):
    """Formats and run-time words of the capture memory of several axes; the attributes are as of `capture.Design`.

    Args:
        spec: the axes.
        records: records of the ring, a power of two.

    Raises:
        TypeError: if `records` is not an int.
        ValueError: if there cannot be so many records, or a rota has fewer clocks than `ROTA_LEAST`.
    """

    spec: AxesSpec

    def __init__(self, spec: AxesSpec, records: int):
        super().__init__(spec, records)
        doc = "the axis that a capture takes with its start"
        fmt = UQ(max(spec.axes - 1, 1).bit_length(), 0)
        self.words = (*self.words, Word("capture_axis", fmt, 1.0, "", 0, doc, 0, spec.axes - 1))

    @property
    def sampled_clocks(self) -> int:
        # The record comes a clock behind the changed drive.
        return self.spec.latency + 1 + SAMPLED

    @property
    def fewest_clocks(self) -> int:
        return ROTA_LEAST

    @property
    def start(self) -> State:
        """The state after a reset."""
        none = 0, 0
        return State(capture.START, 0, (0,) * self.spec.axes, Seen(), 0, none, none, none)


def step(design: Design, memory: np.ndarray, state: State, inputs: Inputs) -> State:
    """Return the state after one clock edge, and write to the memory.

    Args:
        design: the design.
        memory: the ring, as from `Design.memory`; changed.
        state: `Design.start`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    heard = capture.Inputs(
        **state.seen._asdict(),
        sampled=state.samples[1],
        driven=state.driven,
        state=state.states[state.axis],
        live=inputs.live,
        stamp=inputs.stamp,
        address=inputs.capture_address,
        capture_start=state.starts[1],
        capture_trigger=state.triggers[1],
        capture_sources=inputs.capture_sources,
        capture_level=inputs.capture_level,
        capture_before=inputs.capture_before,
        capture_decimation=inputs.capture_decimation,
    )
    captured = capture.step(design.params, memory, state.captured, heard)
    recorded = int(inputs.record_valid and inputs.record_axis == state.axis)
    states, driven = list(state.states), state.driven
    if inputs.turn_valid:
        states[inputs.turn_axis] = inputs.turn_state
        driven = inputs.driven[state.axis] if inputs.turn_axis == state.axis else driven
    narrowed = design.spec.design.estimator.velocity.width - design.velocity.width
    now = Seen(inputs.record_count, inputs.record_velocity >> narrowed, inputs.record_wall_force, inputs.record_flags)
    return State(
        captured=captured,
        axis=inputs.capture_axis if inputs.capture_start else state.axis,
        states=tuple(states),
        seen=now if recorded else state.seen,
        driven=driven,
        samples=(recorded, state.samples[0]),
        starts=(inputs.capture_start, state.starts[0]),
        triggers=(inputs.capture_trigger, state.triggers[0]),
    )
