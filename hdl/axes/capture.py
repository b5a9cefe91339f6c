"""The capture memory of several axes: it is fed with samples and turns of the axis that its start has taken."""

from amaranth.hdl import Cat, Module, Mux, Signal, Value
from amaranth.lib.data import ArrayLayout
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axes import capture as axes_capture
from hardwall.model.axes.capture import PULSED, SAMPLED
from hardwall.model.axis import supervisor
from hardwall.model.axis.capture import REGISTER_BITS

from ..arithmetic.fixed import shape
from ..axis.capture import Capture
from ..block import Block
from ..link.axis_status import word_of
from ..wires import given, names_of, ports

OUTPUTS = "capture_state", "capture_place", "capture_stamp"


class AxesCapture(Block):
    """A `Capture` for all axes, one of them at a time, and its connection to `SupervisedAxes`.

    Equation: the model's, word for word. A `capture_start` takes the axis that `capture_axis` names then; until the
    next start the word has no effect. A record in the memory has the values of one sample of that axis: its record's,
    and the state and the drive of its turn.

    Latency: the memory hears of a sample `SAMPLED` clocks behind its record, and of the host's pulses `PULSED` clocks
    behind them; `capture_data` is the register at `capture_address` one clock later.

    Rounding and overflow: as of `Capture`.

    Reset: as of `Capture`; axis 0 is taken.

    Parameters
    ----------
    design : hardwall.model.axes.capture.Design
        Formats and the number of records; its module derives them.

    Members
    -------
    the outputs of `SupervisedAxes` that show records, turns and the drives that are let out, `live`, `stamp` : In
        As there.
    capture_start, capture_trigger : In(1)
        Pulses: begin a capture, and trigger it by hand.
    one input for each word of `design.words` : In
        Run-time parameters, which act at the next clock.
    capture_address : In A register of the window, which begins with the oldest record.
    capture_data : Out(16)
        The register that `capture_address` had a clock before, if the capture was done then.
    capture_done : Out(1)
        The capture is done, and the memory frozen.
    capture_state, capture_place, capture_stamp : Out
        As of `Capture`.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = axes_capture.Design

    def __init__(self, design: axes_capture.Design):
        super().__init__(design)
        self._memory = Capture(design)

    @staticmethod
    def members(design: axes_capture.Design) -> dict[str, Member]:
        spec, inside = design.spec, Capture.members(design)
        axis = range(max(spec.axes, 2))
        return {
            "record_valid": In(1),
            "record_axis": In(axis),
            "record_count": In(shape(design.count)),
            "record_velocity": In(shape(spec.design.estimator.velocity)),
            "record_wall_force": In(shape(spec.force)),
            "record_flags": In(len(spec.design.flags)),
            "turn_valid": In(1),
            "turn_axis": In(axis),
            "turn_state": In(2),
            "magnitude": In(ArrayLayout(shape(supervisor.Design(spec).limit), spec.axes)),
            "negative": In(spec.axes),
            **{name: inside[name] for name in ("live", "stamp", "capture_start", "capture_trigger")},
            **{word.name: In(shape(word.format)) for word in design.words},
            "capture_address": inside["address"],
            "capture_data": Out(REGISTER_BITS),
            "capture_done": Out(1),
            **{name: inside[name] for name in OUTPUTS},
        }

    def elaborate(self, platform):
        m = Module()
        m.submodules.capture = memory = self._memory
        axis = Signal.like(self.capture_axis, name="axis")
        with m.If(self.capture_start):
            m.d.sync += axis.eq(self.capture_axis)

        # The record and the turn of a sample are kept until the next sample's.
        recorded = self.record_valid & (self.record_axis == axis)
        velocity = self.record_velocity >> len(self.record_velocity) - len(memory.velocity)
        seen = {"count": self.record_count, "velocity": velocity, "wall_force": self.record_wall_force}
        seen |= {"flags": self.record_flags}
        for name, taken in ports(memory, seen).items():
            held = Signal.like(taken, name=f"held_{name}")
            with m.If(recorded):
                m.d.sync += held.eq(seen[name])
            m.d.comb += taken.eq(held)
        driven, states = Signal.like(memory.driven, name="held_driven"), Signal(2 * self.design.spec.axes)
        magnitude = word_of(self.magnitude, axis, self.design.spec.axes)
        with m.If(self.turn_valid):
            m.d.sync += states.word_select(self.turn_axis, 2).eq(self.turn_state)
            with m.If(self.turn_axis == axis):
                m.d.sync += driven.eq(Mux(self.negative.bit_select(axis, 1), -magnitude, magnitude))

        m.d.comb += [
            memory.driven.eq(driven),
            memory.state.eq(states.word_select(axis, 2)),
            memory.live.eq(self.live),
            memory.stamp.eq(self.stamp),
            memory.address.eq(self.capture_address),
            memory.sampled.eq(self._late(m, recorded, SAMPLED)),
            memory.capture_start.eq(self._late(m, self.capture_start, PULSED)),
            memory.capture_trigger.eq(self._late(m, self.capture_trigger, PULSED)),
            *given(memory, ports(self, names_of(memory.design.words))),
            self.capture_data.eq(memory.data),
            self.capture_done.eq(memory.done),
            *given(self, ports(memory, OUTPUTS)),
        ]
        return m

    @staticmethod
    def _late(m: Module, pulse: Value, clocks: int) -> Value:
        """Return a pulse, some clocks later."""
        row = Signal(clocks)
        m.d.sync += row.eq(Cat(pulse, row))
        return row[-1]
