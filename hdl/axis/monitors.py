"""The monitors of an axis: what is wrong with it, seen from its signals, for the supervisor."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value, signed
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis import monitors
from hardwall.model.axis.monitors import (
    ENCODER_LOSS,
    ESTIMATOR_SATURATED,
    IDLE_EDGES,
    INDEX_SPACING,
    POSITION_RANGE,
    POSITION_WRAP,
    RUNAWAY,
    VELOCITY_LIMIT,
)
from hardwall.model.axis.supervisor import COUNT

from ..arithmetic.fixed import shape
from ..block import Block


class Monitors(Block):
    """One bit for everything that is wrong, as `hardwall.model.axis.monitors` says for each.

    Equation: in the model's module, bit by bit.

    Latency: `latency` of a cause, from the inputs to `causes`; a new limit of the position acts a clock later.
    `velocity` and `saturated` are looked at with `valid`, `edge_kind` with `stepped`, and the distance to the last
    index edge with `indexed`: velocity_limit and index_spacing are pulses. The others last as long as their fault; a
    position must be out of range for two clocks. Ways are counted edge by edge: a preload or a shift of the origin is
    no motion.

    Rounding and overflow: distances are taken modulo the count's width; counters stop at their limits.

    Parameters
    ----------
    design : hardwall.model.axis.monitors.Design
        Formats; its module derives them.

    Members
    -------
    count : In(SQ)
        The live count.
    stepped, edge_kind, edge_down : In
        An edge has changed the count, its kind, and whether it counted -1.
    indexed : In(1)
        Pulse, with `stepped`: that edge has found an index, at the count before it.
    valid, velocity, saturated : In
        The estimator's result, and whether it is saturated.
    at_limit, negative : In(1)
        The drive that is let out is as large as it may be, and is negative.
    a, a_n, b, b_n : In(1)
        Synchronised levels of the channels and of their complements.
    one input for each word of `design.words` : In
        Run-time parameters.
    causes : Out Bits as in `supervisor.CAUSES`; causes from elsewhere are 0.
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
            "edge_down": In(1),
            "indexed": In(1),
            "valid": In(1),
            "velocity": In(shape(design.velocity)),
            "saturated": In(1),
            "at_limit": In(1),
            "negative": In(1),
            **dict.fromkeys(("a", "a_n", "b", "b_n"), In(1)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "causes": Out(COUNT),
            "a_channel_idle": Out(1),
        }

    def latency(self, cause: str) -> int:
        """Return the most clocks from inputs that are wrong to the cause of a name."""
        return monitors.latency(cause)

    def elaborate(self, platform):
        m = Module()
        top = self.count[-3:]
        found = {
            POSITION_RANGE: self._out_of_range(m),
            # Beyond three quarters of the range of two's complement, by the first three bits.
            POSITION_WRAP: (top == 0b011) | (top == 0b100),
            VELOCITY_LIMIT: self.valid & self._too_fast(),
            RUNAWAY: self._runaway(m),
            ESTIMATOR_SATURATED: self._saturated(m),
            ENCODER_LOSS: self._lost(m, "lost_a", self.a == self.a_n) | self._lost(m, "lost_b", self.b == self.b_n),
            INDEX_SPACING: self._index_is_wrong(m),
        }
        m.d.sync += self.causes.eq(Cat(found.get(bit, Const(0, 1)) for bit in range(COUNT)))

        channel, edges = Signal(), Signal(range(IDLE_EDGES + 1))
        idle = edges == IDLE_EDGES
        with m.If(self.stepped):
            m.d.sync += channel.eq(self.edge_kind[0])
            with m.If(channel != self.edge_kind[0]):
                m.d.sync += edges.eq(1)
            with m.Elif(~idle):
                m.d.sync += edges.eq(edges + 1)
        m.d.comb += self.a_channel_idle.eq(idle)
        return m

    def _out_of_range(self, m: Module) -> Value:
        """Return whether the count is beyond a limit: one comparison, of both limits in turn."""
        at_low, wrong, wrong_before = Signal(init=1), Signal(), Signal()
        limit = Signal.like(self.count)
        # The limit waits as its complement, which a subtraction adds. The low limit is added with a carry: the
        # difference is then negative below it. The high limit is added without: the difference is then not negative
        # above it.
        m.d.sync += [
            at_low.eq(~at_low),
            limit.eq(~Mux(at_low, self.supervisor_position_high, self.supervisor_position_low)),
            wrong_before.eq(wrong),
        ]
        difference = (Cat(Const(1, 1), self.count).as_signed() + Cat(at_low, limit).as_signed()) >> 1
        m.d.comb += wrong.eq((difference < 0) == at_low)
        return wrong | wrong_before

    def _too_fast(self) -> Value:
        """Return whether |velocity| is above its limit."""
        limit = Cat(Const(0, self._design.params.velocity_shift), self.supervisor_velocity_limit)
        return ~_within(self.velocity, limit)

    def _runaway(self, m: Module) -> Value:
        """Return whether the handle has moved too far against a drive at its limit."""
        pressed_before, negative_before = Signal(), Signal()
        m.d.sync += [pressed_before.eq(self.at_limit), negative_before.eq(self.negative)]
        held = self.at_limit & pressed_before & (self.negative == negative_before)
        # The way is negative, so that a sum compares it.
        way = Signal.like(self.count)
        with m.If(~held):
            m.d.sync += way.eq(0)
        with m.Elif(self.stepped):
            m.d.sync += way.eq(way + _one(way, self.edge_down ^ self.negative))
        return self.supervisor_runaway + way < 0

    def _saturated(self, m: Module) -> Value:
        """Return whether the estimate has been saturated for too many samples."""
        # The number is negative, so that a sum compares it.
        samples = Signal(signed(len(self.supervisor_saturated) + 1))
        too_many = Signal()
        m.d.comb += too_many.eq(self.supervisor_saturated + samples < 0)
        with m.If(self.valid & ~self.saturated):
            m.d.sync += samples.eq(0)
        with m.Elif(self.valid & ~too_many):
            m.d.sync += samples.eq(samples - 1)
        return too_many

    def _lost(self, m: Module, name: str, wrong: Value) -> Value:
        """Return whether a channel has equalled its complement for too many clocks."""
        passed, too_long = Signal.like(self.supervisor_loss, name=name), Signal(name=f"{name}_too_long")
        m.d.comb += too_long.eq(passed >= self.supervisor_loss)
        with m.If(~wrong):
            m.d.sync += passed.eq(0)
        with m.Elif(~too_long):
            m.d.sync += passed.eq(passed + 1)
        return wrong & too_long

    def _index_is_wrong(self, m: Module) -> Value:
        """Return whether an index is neither at the last one nor a turn away."""
        tolerance, down = self.supervisor_index_tolerance, self.edge_down
        has_index, away = Signal(), Signal()
        m.d.sync += has_index.eq(has_index | self.indexed)
        # The distance from the last index, negative, and its side. An edge that finds an index is one count beyond it.
        distance, upwards, grows = Signal.like(self.count), Signal(), Signal()
        m.d.comb += grows.eq((distance == 0) | (down ^ upwards) | self.indexed)
        with m.If(self.stepped):
            m.d.sync += distance.eq(Mux(self.indexed, 0, distance) + _one(distance, grows))
            with m.If(grows):
                m.d.sync += upwards.eq(~down)

        low, high = _halves(distance, len(tolerance))
        near = (distance == 0) | (high.all() & (low + tolerance)[-1])
        beyond = Signal(signed(len(self.count) + 1))
        m.d.sync += [away.eq(self.indexed & has_index & ~near), beyond.eq(distance + self.supervisor_turn)]
        low, high = _halves(beyond, len(tolerance))
        return away & ~((high == beyond[-1].replicate(len(high))) & _within(Cat(low, beyond[-1]), tolerance))


def _one(like: Signal, negative: Value) -> Value:
    """Return 1, or -1 if `negative`, as wide as `like`: all of its bits but the lowest are the sign."""
    return Cat(Const(1, 1), negative.replicate(len(like) - 1)).as_signed()


def _within(value: Value, limit: Value) -> Value:
    """Return whether the magnitude of a signed value is at most a limit that has its bits but the sign.

    A subtraction adds the complement of the magnitude and one: of a negative value, the value itself.
    """
    sign, bits = value[-1], value[:-1]
    return (Cat(Const(1, 1), limit) + Cat(~sign, bits ^ ~sign.replicate(len(bits))))[-1]


def _halves(value: Signal, bits: int) -> tuple[Value, Value]:
    """Return so many low bits of a signed value, and the other bits with the sign."""
    wide = Cat(value, value[-1].replicate(max(bits + 1 - len(value), 0)))
    return wide[:bits], wide[bits:]
