"""The monitors of an axis: what is wrong with it, seen from its signals, for the supervisor."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model import monitors
from hardwall.model.monitors import (
    ENCODER_LOSS,
    ESTIMATOR_SATURATED,
    IDLE_EDGES,
    INDEX_SPACING,
    POSITION_RANGE,
    POSITION_WRAP,
    RUNAWAY,
    VELOCITY_LIMIT,
)
from hardwall.model.supervisor import COUNT

from .arithmetic.fixed import shape
from .block import Block


class Monitors(Block):
    """One bit for everything that is wrong, as `hardwall.model.monitors` says for each.

    Equation: in the model's module, bit by bit.

    Latency: one clock from the inputs to `causes`, and `index_clocks` from an index edge, for its distance is compared
    in steps. `velocity` and `saturated` are looked at with `valid`, `edge_kind`
    with `stepped`, and the count's distance to the last index edge with `indexed`: these causes are pulses. The others
    last for as long as what is wrong does.

    Rounding and overflow: distances are taken modulo the count's width; counters stop at their limits.

    Parameters
    ----------
    design : hardwall.model.monitors.Design
        Formats; its module derives them.

    Members
    -------
    count : In(SQ)
        The live count.
    stepped, edge_kind : In
        The count has changed, and the kind of the edge that changed it.
    indexed : In(1)
        Pulse: the index edge was counted.
    valid, velocity, saturated : In
        The estimator's result, and whether it is saturated.
    driven : In(SQ)
        The drive that is let out, force LSB.
    force_limit : In(UQ)
        The limit that it obeys, force LSB.
    a, a_n, b, b_n : In(1)
        Synchronised levels of the channels and of their complements.
    one input for each word of `design.words` : In
        Run-time parameters.
    causes : Out
        Bits as in `supervisor.CAUSES`; those that are not made here are 0.
    a_channel_idle : Out(1)
        Warning: the last edges were all of one channel.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = monitors.Design

    @staticmethod
    def members(design: monitors.Design) -> dict[str, Member]:
        return {
            "count": In(signed(design.count_width)),
            "stepped": In(1),
            "edge_kind": In(2),
            "indexed": In(1),
            "valid": In(1),
            "velocity": In(shape(design.velocity)),
            "saturated": In(1),
            "driven": In(shape(design.force)),
            "force_limit": In(shape(design.limit)),
            **dict.fromkeys(("a", "a_n", "b", "b_n"), In(1)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "causes": Out(COUNT),
            "a_channel_idle": Out(1),
        }

    @property
    def index_clocks(self) -> int:
        """Clocks from an index edge to its cause."""
        return 4

    def elaborate(self, platform):
        m = Module()
        top = self.count[-3:]
        fastest = Cat(Const(0, self._design.params.velocity_shift), self.supervisor_velocity_limit)
        found = {
            POSITION_RANGE: (self.count < self.supervisor_position_low) | (self.count > self.supervisor_position_high),
            # Beyond three quarters of the range of two's complement, by the first three bits.
            POSITION_WRAP: (top == 0b011) | (top == 0b100),
            VELOCITY_LIMIT: self.valid & (abs(self.velocity) > fastest),
            RUNAWAY: self._runaway(m),
            ESTIMATOR_SATURATED: self._longer(m, "samples", self.saturated, self.supervisor_saturated, self.valid),
            ENCODER_LOSS: self._longer(m, "lost_a", self.a == self.a_n, self.supervisor_loss)
            | self._longer(m, "lost_b", self.b == self.b_n, self.supervisor_loss),
            INDEX_SPACING: self._index_is_wrong(m),
        }
        m.d.sync += self.causes.eq(Cat(found.get(bit, Const(0, 1)) for bit in range(COUNT)))

        channel, edges = Signal(), Signal(range(IDLE_EDGES + 1))
        following = Signal.like(edges)
        m.d.comb += following.eq(edges)
        with m.If(self.stepped):
            m.d.sync += channel.eq(self.edge_kind[0])
            with m.If(channel != self.edge_kind[0]):
                m.d.comb += following.eq(1)
            with m.Elif(edges != IDLE_EDGES):
                m.d.comb += following.eq(edges + 1)
        m.d.sync += [edges.eq(following), self.a_channel_idle.eq(following == IDLE_EDGES)]
        return m

    def _runaway(self, m: Module) -> Value:
        """Return whether the handle has moved too far against a drive at its limit."""
        side_before, side = Signal(signed(2)), Signal(signed(2))
        limit = Signal(signed(len(self.driven)))
        m.d.comb += limit.eq(self.force_limit)
        with m.If(self.force_limit.any()):
            with m.If(self.driven >= limit):
                m.d.comb += side.eq(1)
            with m.Elif(self.driven + limit <= 0):
                m.d.comb += side.eq(-1)
        held = (side == side_before) & (side != 0)
        anchor, moved = Signal.like(self.count), Signal.like(self.count)
        m.d.comb += moved.eq(self.count - anchor)
        m.d.sync += side_before.eq(side)
        with m.If(~held):
            m.d.sync += anchor.eq(self.count)
        most = Signal(signed(len(self.count) + 1))
        m.d.comb += most.eq(self.supervisor_runaway)
        # Both comparisons work in parallel: a negation before one would be a carry chain more.
        return held & Mux(side > 0, moved + most < 0, moved > most)

    def _longer(self, m: Module, name: str, wrong: Value, limit: Value, when: Value | int = 1) -> Value:
        """Return whether something has been wrong for more than `limit` clocks, counted where `when` is high."""
        passed, now = Signal(len(limit) + 1, name=name), Signal(len(limit) + 1, name=f"{name}_now")
        m.d.comb += now.eq(passed)
        with m.If(when):
            m.d.comb += now.eq(Mux(wrong, Mux(passed > limit, limit + 1, passed + 1), 0))
        m.d.sync += passed.eq(now)
        return now > limit

    def _index_is_wrong(self, m: Module) -> Value:
        """Return whether an index edge is neither at the last one nor a turn away."""
        has_index, last_index = Signal(), Signal.like(self.count)
        with m.If(self.indexed):
            m.d.sync += [has_index.eq(1), last_index.eq(self.count)]
        moved, distance = Signal.like(self.count), Signal(len(self.count))
        beyond = Signal(signed(len(self.count) + 1))
        measured, judged, near = Signal(), Signal(), Signal(init=1)
        m.d.sync += [
            measured.eq(self.indexed & has_index),
            moved.eq(self.count - last_index),
            judged.eq(measured),
            distance.eq(abs(moved)),
            near.eq(~judged | (distance <= self.supervisor_index_tolerance)),
            beyond.eq(distance - self.supervisor_turn),
        ]
        return ~near & (abs(beyond) > self.supervisor_index_tolerance)
