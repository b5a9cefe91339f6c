"""The supervisor, between the output stage and the pins: it alone lets a drive out."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, Value
from amaranth.lib.wiring import In, Member, Out

from hardwall.model.axis import supervisor
from hardwall.model.axis.supervisor import ALWAYS, ARMED, COUNT, COUNT_BITS, DISARMED, LINK, REQUIRED, TRIPPED

from ..arithmetic.fixed import below, negated, not_above, shape
from ..block import Block


class Supervisor(Block):
    """The states DISARMED, ARMED and TRIPPED, and the drive, which is zero in all but ARMED.

    Equation, at every clock:

        standing <- causes & (enabled | required) & (all if ARMED else those always watched)
        state    <- TRIPPED if standing
                    DISARMED if TRIPPED and acknowledged == latched with acknowledge
                    DISARMED if not TRIPPED, and enable is low or disarm is high
                    ARMED if DISARMED, and arm, live and the reference that is asked for; all but arm is `ready`
        limit    =  min(ceiling, supervisor_force_limit)
        driven   <- drive within +-limit if ARMED stays ARMED, else 0
        at_limit <- 0 < limit <= |drive| if ARMED stays ARMED, else 0
        ceiling  <- 0 unless ARMED; else the lower of ceiling and supervisor_force_limit, with strobe + supervisor_ramp

    `link_timeout` is made here: it stands while ARMED and not `live`. The host is live from a change of `heartbeat`
    until so many ticks later as `supervisor_watchdog` says, up to one less because they run freely. The word is taken
    with the change; whether it is in its range is for the cause word_range. `latched` collects the causes until they
    are acknowledged. An acknowledgement that does not name exactly these causes has no effect. So a cause that came
    after the host's last look is not lost. `counts` are the occurrences of every cause since reset.

    Latency: one clock. It holds from `drive` to `driven`, from a cause or a low enable to zero, and from a lower
    `supervisor_force_limit` to the drive. No word is committed here: all act at the next clock.

    Rounding and overflow: the ceiling is rounded down to the force LSB. It keeps its fraction when the force limit
    lowers it. Counts saturate. The tick is a whole number of half periods of `alive`, 1 ms or just below.

    Parameters
    ----------
    design : hardwall.model.axis.supervisor.Design
        Formats; its module derives them.

    Members
    -------
    strobe : In(1)
        Pulse for every sample: the ceiling rises.
    drive : In(SQ)
        The output stage's drive, force LSB.
    causes : In
        The causes that are present, bits as in `supervisor.CAUSES`; `link_timeout` is ignored.
    stamp : In
        The number of this clock.
    enable : In(1)
        The loop of `drive_enable` is closed.
    referenced : In(1)
        The index has been found.
    arm, disarm : In(1)
        Pulses of the host.
    acknowledge, acknowledged : In
        A pulse, and the causes that the host has read.
    heartbeat : In
        A word of the host; every change of it is a beat.
    one input for each word of `design.words` : In
        Run-time parameters.
    driven : Out(SQ)
        The drive that is let out, force LSB.
    magnitude, negative : Out The same as a magnitude and a sign. The sign is the one of `drive`, also where the limit
        is zero.
    at_limit : Out(1) The drive is at its limit, and is not zero.
    state : Out(2)
        0: DISARMED, 1: ARMED, 2: TRIPPED.
    alive : Out(1)
        A square wave while ARMED, for the charge pump of an amplifier's enable; otherwise low. Its first edge comes
        within half a period of ARMED, for the divider runs freely.
    live : Out(1)
        The host's heartbeat is not overdue.
    ready : Out(1)
        An `arm` at the last clock would have led to ARMED.
    latched : Out
        Causes since the last acknowledgement.
    first, first_stamp : Out
        The causes of the clock that led to the last trip, and its number.
    counts : Out
        Occurrences of every cause, `COUNT_BITS` each, the first cause's lowest; they saturate.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    design_class = supervisor.Design

    @staticmethod
    def members(design: supervisor.Design) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "drive": In(shape(design.force)),
            "causes": In(COUNT),
            "stamp": In(design.stamp_width),
            "enable": In(1),
            "referenced": In(1),
            "arm": In(1),
            "disarm": In(1),
            "acknowledge": In(1),
            "acknowledged": In(COUNT),
            "heartbeat": In(supervisor.BEAT_BITS),
            **{word.name: In(shape(word.format)) for word in design.words},
            "driven": Out(shape(design.force)),
            "magnitude": Out(shape(design.limit)),
            "negative": Out(1),
            "at_limit": Out(1),
            "state": Out(2),
            "alive": Out(1),
            "live": Out(1),
            "ready": Out(1),
            "latched": Out(COUNT),
            "first": Out(COUNT),
            "first_stamp": Out(design.stamp_width),
            "counts": Out(COUNT * COUNT_BITS),
        }

    def elaborate(self, platform):
        m = Module()
        armed, tripped = self.state == ARMED, self.state == TRIPPED
        standing, before = Signal(COUNT), Signal(COUNT)
        watched = (self.supervisor_causes | REQUIRED) & (Const(ALWAYS, COUNT) | armed.replicate(COUNT))
        present = Cat(~self.live if bit == LINK else cause for bit, cause in enumerate(self.causes))
        m.d.comb += standing.eq(present & watched)
        m.d.sync += before.eq(standing)

        go, ready = Signal(), Signal()
        allowed = self.enable & self.live & (self.referenced | ~self.supervisor_reference)
        m.d.comb += ready.eq((self.state == DISARMED) & ~standing.any() & allowed)
        m.d.sync += self.ready.eq(ready)
        m.d.comb += go.eq(armed & ~standing.any() & self.enable & ~self.disarm)
        m.d.sync += self.latched.eq(self.latched | standing)
        with m.If(standing.any()):
            m.d.sync += self.state.eq(TRIPPED)
            with m.If(~tripped):
                m.d.sync += [self.first.eq(standing), self.first_stamp.eq(self.stamp)]
        with m.Elif(tripped), m.If(self.acknowledge & (self.acknowledged == self.latched)):
            m.d.sync += [self.state.eq(DISARMED), self.latched.eq(0)]
        with m.Elif(~self.enable | self.disarm):
            m.d.sync += self.state.eq(DISARMED)
        with m.Elif(self.arm & ready):
            m.d.sync += self.state.eq(ARMED)

        for bit in range(COUNT):
            count = self.counts.word_select(bit, COUNT_BITS)
            with m.If(standing[bit] & ~before[bit]):
                m.d.sync += count.eq(Cat(count.all() | (count[k] ^ count[:k].all()) for k in range(COUNT_BITS)))

        self._limit(m, go)
        turns = self._pump(m, go)
        self._watch(m, turns)
        return m

    def _limit(self, m: Module, go: Signal) -> None:
        """Let the drive out within the ceiling and the force limit, and raise the ceiling."""
        fraction, bits = self._design.params.ramp_fraction, len(self.magnitude)
        # The part of the ceiling above the force LSB waits as its complement, which a comparison adds. It is set before
        # it counts, so it needs no reset, which would be a second value to be set to.
        waiting = Signal(fraction + bits + 1, reset_less=True)
        complement = ((1 << bits + 1) - 1) << fraction
        missing, limit, lowered = waiting[fraction:], Signal(bits), Signal()
        m.d.comb += [
            lowered.eq(~not_above(missing, self.supervisor_force_limit)),
            limit.eq(Mux(lowered, self.supervisor_force_limit, ~missing)),
        ]
        ceiling = Cat(waiting[:fraction], limit)
        raised = Mux(self.strobe, ceiling + self.supervisor_ramp, ceiling)
        m.d.sync += waiting.eq(Mux(go, raised ^ complement, complement))

        # The complement of the drive's magnitude.
        less, within = Signal(len(self.drive)), Signal()
        m.d.comb += [less.eq(~negated(self.drive, self.drive[-1])), within.eq(below(less, limit))]
        m.d.sync += [
            self.magnitude.eq(Mux(go, Mux(within, ~less, limit), 0)),
            self.negative.eq(go & self.drive[-1]),
            self.at_limit.eq(go & ~within & limit.any()),
        ]
        m.d.comb += self.driven.eq(negated(self.magnitude, self.negative))

    def _watch(self, m: Module, turns: Value) -> None:
        """Count the milliseconds that are left to the host, each of so many turns of the pump."""
        tick, left = Signal(range(max(self._design.params.tick_turns, 2))), Signal.like(self.supervisor_watchdog)
        last_beat = Signal.like(self.heartbeat)
        ticks = tick == self._design.params.tick_turns - 1
        with m.If(turns):
            m.d.sync += tick.eq(Mux(ticks, 0, tick + 1))
        m.d.sync += last_beat.eq(self.heartbeat)
        with m.If(self.heartbeat != last_beat):
            m.d.sync += left.eq(self.supervisor_watchdog)
        with m.Elif(turns & ticks & left.any()):
            m.d.sync += left.eq(left - 1)
        m.d.comb += self.live.eq(left.any())

    def _pump(self, m: Module, go: Signal) -> Value:
        """Toggle `alive` while ARMED; return whether this is the clock for it."""
        clocks = self._design.params.pump_clocks
        pump = Signal(range(max(clocks, 2)))
        turns = pump == clocks - 1
        m.d.sync += [pump.eq(Mux(turns, 0, pump + 1)), self.alive.eq(go & (self.alive ^ turns))]
        return turns
