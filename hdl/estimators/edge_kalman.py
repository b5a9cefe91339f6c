"""Velocity from the clock stamps of edges: a Kalman filter of edges whose places are uncertain."""

from amaranth.hdl import Array, Cat, Const, Module, Mux, unsigned
from amaranth.lib.memory import Memory
from amaranth.lib.wiring import Member

from hardwall.model.estimators.edge_kalman import BLEND_BITS, KX_BITS, LENGTH_SHIFT, LONGEST, RATE_SHIFT
from hardwall.model.estimators.edge_kalman_design import GUARD_BITS, Design
from hardwall.model.estimators.edge_kalman_tables import (
    AGILE_AT,
    ALARM_AT,
    BETTER,
    BLEND,
    GAIN_FORMATS,
    GROW,
    KA,
    KV,
    KX,
    LEARN_BITS,
    LIMIT_WIDTHS,
    QUIET_AT,
    SHARE_BITS,
    USUAL,
    USUAL_SHARE,
    WORSE,
    gain_words,
)

from ..arithmetic.fixed import fitted, length_of, saturate, shift_floor, shift_round_half_up
from ..encoder.scale_map import ScaleMap
from .acceleration import AcceleratedBlock
from .edge_kalman_signals import LIMB_BITS, Signals

HIGH = "TURN HIGH", "TRAVEL HIGH", "MEAN HIGH", "PLACE HIGH", "VELOCITY HIGH", "BEND HIGH", "LINE HIGH", "LINE TURN"
"""The states in which the multiplier takes the rest."""


class Estimator(AcceleratedBlock):
    """Position, velocity and acceleration at the last edge, corrected at every edge by gains for the time between them.

    Equation, with D clocks a sample, T clocks and n counts from the last edge to this one, s clocks since this edge:

        at an edge       r = n D - (v + a T/2) T - x
                         z <- z + blend (r - z)
                         the memory is agile if |z| is above its bound, and else grows with T
                         the error of an edge is halved or doubled by how often |r| is above the usual
                         x <- K_x r - r,  v <- v + a T + K_v r,  a <- a + K_a r
        at every sample  line = v + a s, held within the bound for no further edge

    with the bounds of a table's row for T and the error of an edge, and the gains of another's for T and the memory.
    The velocity is the line. The acceleration is a D, and 0 at rest. Start: at the first sample, and with `restart`,
    everything is forgotten; v = 0 until the second edge.

    With a map of the scale (`design.scale`) n is the difference of the places of the two edges: their numbers, each
    with the error that the map has for it.

    Latency: `latency` clocks from `strobe` to `valid`; the next `strobe` may come with `valid`. One multiplier makes
    all eight products, each in two halves: the right operand is wider than a multiplier of the part.

    Rounding and overflow: the values that a product corrects are rounded half up, and so are the mean, the share of
    large innovations and the line; the change of velocity, the bound and a D are rounded down. Velocities and the error
    of the place saturate, with flags; the acceleration saturates, which is its limit. Count and stamp may wrap.

    Parameters
    ----------
    design : hardwall.model.estimators.edge_kalman.Design
        Formats and table; its module derives them.

    Members, with a map of the scale, beside those of every estimator
    -----------------------------------------------------------------
    map_enabled, map_shift, map_shift_count, map_write, map_bin, map_written : In As of
        `hardwall.hdl.encoder.scale_map.ScaleMap`. They change only before a sample with `restart`.
    map_outside : Out(1)
        From `valid` until the next `strobe`: the last edge is beyond the map's bins.

    Source: Kalman 1960 for the filter; its use on edges is this project's.
    """

    design_class = Design

    @staticmethod
    def members(design: Design) -> dict[str, Member]:
        own = AcceleratedBlock.members(design)
        if design.scale is None:
            return own
        of_map = {f"map_{name}": member for name, member in ScaleMap.members(design.scale).items()}
        del of_map["map_number"], of_map["map_error"]
        return own | of_map

    def elaborate(self, platform):
        m = Module()
        s = Signals(self._design)
        self._watch(m, s)
        self._multiply(m, s)
        self._look_up(m, s)
        if self._design.scale is not None:
            self._displace(m, s)
        m.d.sync += self.valid.eq(0)
        sequence = self._sample(s) | self._innovation(s) | self._correction(s) | self._line(s)
        after = [*list(sequence)[1:], "SAMPLE"]
        with m.FSM():
            with m.State("SAMPLE"), m.If(self.strobe):
                self._take(m, s)
                m.next = next(iter(sequence))
            # Every state takes one clock: first its unconditional actions, then the conditional ones.
            for (name, statements), following in zip(sequence.items(), after, strict=True):
                with m.State(name):
                    m.d.sync += statements
                    if name in HIGH:
                        m.d.comb += s.limb.eq(s.right[LIMB_BITS:])
                    self._decide(m, s, name)
                    if self._design.halvings_max:
                        self._learn(m, s, name)
                    m.next = following
        return m

    def _watch(self, m, s):
        """Add the watch over bursts."""
        bursts = self._bursts(m)
        m.d.comb += [s.bursts.eq(bursts.found), s.jolt.eq(bursts.jolt)]

    def _multiply(self, m, s):
        """Add the multiplier. A product takes two clocks, its sum another, with which the next product may begin."""
        m.d.comb += s.limb.eq(s.right[:LIMB_BITS])
        m.d.sync += s.product.eq(s.left * s.limb)

    def _look_up(self, m, s):
        """Add the tables: a row's words are there two clocks after its number."""
        d = self._design
        m.submodules.limits = _table(m, d.limits, LIMIT_WIDTHS, s.limits_row, s.limit)
        m.submodules.gains = _table(m, gain_words(), [fmt.width for fmt in GAIN_FORMATS], s.gains_row, s.gain)
        m.d.comb += s.gains_row.eq(Cat(s.length[0], (s.length - s.time + LONGEST)[: len(s.gains_row) - 1]))
        shift = (s.length[1:] - d.shortest)[: len(s.length) - 1]
        m.d.comb += [s.rate.eq((s.word << RATE_SHIFT) >> shift), s.nearer.eq(s.total >> KX_BITS)]

    def _displace(self, m, s):
        """Add the map: the error of this edge is there two clocks after its number, before it is used."""
        m.submodules.scale = scale = ScaleMap(self._design.scale)
        m.d.comb += [
            scale.number.eq(s.to),
            scale.enabled.eq(self.map_enabled),
            scale.shift.eq(self.map_shift),
            scale.shift_count.eq(self.map_shift_count),
            scale.write.eq(self.map_write),
            scale.bin.eq(self.map_bin),
            scale.written.eq(self.map_written),
            self.map_outside.eq(scale.outside),
            s.error.eq(scale.error),
        ]

    def _take(self, m, s):
        """Add what the strobe takes."""
        d, seen = self._design, self.seen
        stamps = Array([seen.stamp_a_rise, seen.stamp_b_rise, seen.stamp_a_fall, seen.stamp_b_fall])
        m.d.sync += [
            s.fresh.eq(self.restart | ~s.running),
            s.running.eq(1),
            s.now.eq(seen.stamp >> d.unit),
            s.at.eq(stamps[seen.edge] >> d.unit),
            s.to.eq(seen.count + seen.down),
            s.flags.eq(0),
        ]

    def _sample(self, s):
        """Return the states that take the interval and the edges passed in it."""
        d, half = self._design, _size(s.v) >> 1
        return {
            "DIFFERENCE": [
                s.interval.eq(Mux(s.fresh, 0, s.at - s.stamp)),
                # The difference of two counts is taken modulo their width: a wrapped counter is no jump.
                s.passed.eq(Mux(s.fresh, 0, (s.to - s.number)[: len(s.passed)].as_signed())),
                s.room.eq(Mux(s.v < 0, s.bound + s.v, s.bound - s.v)),
                s.was_down.eq(s.v < 0),
                s.was_still.eq(s.v == 0),
                s.doubt.eq(s.doubt - (s.doubt != 0)),
            ],
            "DECISION": [
                s.left.eq(s.a),
                s.right.eq(s.interval),
                # The fastest that the axis is at the next edge, if the bound of the last sample was one.
                s.fastest.eq(Mux(s.room < half, half, s.room)),
            ],
            "TURN LOW": [s.interval_size.eq(length_of(s.interval)), s.age.eq(s.now - Mux(s.anchor, s.at, s.stamp))],
            "TURN HIGH": [
                s.waits(0),
                *s.displaced,
                s.limits_row.eq(Cat(s.time, s.halvings)),
                # An age of half the range of the stamp is at rest, however long it is.
                s.age_size.eq(length_of(s.age[:-1])),
            ],
            "TURN SUM": [s.summed, s.way.eq(shift_floor(s.exact * d.clocks, s.place_shift))],
        }

    def _innovation(self, s):
        """Return the states that predict the place of the edge, and take the mean of the errors."""
        p = s.params
        travelled = shift_floor(s.total, p.travel_shift)
        limited = saturate(s.far, -p.error_max, p.error_max)
        # The low bits of a memory of the table are 0, so its words are compared with the top bits alone.
        quiet, agile = s.limit[QUIET_AT] << LENGTH_SHIFT, s.limit[AGILE_AT] << LENGTH_SHIFT
        short = s.memory[LENGTH_SHIFT:] < s.limit[AGILE_AT]
        long = s.grown[LENGTH_SHIFT:] >= s.limit[QUIET_AT]
        return {
            "TURN": [s.turned, s.behind.eq(s.way - s.place), s.grown.eq(Mux(short, agile, s.memory))],
            "TRAVEL": [
                s.left.eq(s.v + (s.turn >> 1)),
                s.right.eq(s.interval),
                s.ahead.eq(s.v + s.turn),
                s.length.eq(s.nearest(s.grown)),
            ],
            "TRAVEL LOW": [],
            "TRAVEL HIGH": [s.waits(p.travel_shift), s.grown.eq(s.grown + s.gain[GROW])],
            "TRAVEL SUM": [s.summed, s.grown.eq(Mux(long, quiet, s.grown))],
            "DISTANCE": [s.far.eq(s.behind - travelled)],
            "INNOVATION": [s.r.eq(limited), s.flags[0].eq(s.correct & (s.beyond | (limited != s.far)))],
            "MEAN": [s.left.eq(s.r - s.mean), s.right.eq(s.limit[BLEND])],
            "MEAN LOW": [],
            "MEAN HIGH": [s.waits(BLEND_BITS)],
            "MEAN SUM": [s.summed],
            "BLEND": [],
        }

    def _correction(self, s):
        """Return the states that choose the memory, and correct the motion by its gains."""
        p = s.params
        magnitude = shift_floor(s.without_sign(s.mean), p.alarm_shift)
        far_faster = shift_floor(s.total, p.velocity_shift)
        faster = saturate(far_faster, ~p.turn_max, p.turn_max)
        return {
            "ALARM": [s.alarm.eq(magnitude > s.limit[ALARM_AT])],
            "MEMORY": [],
            "READ": [],
            "GAINS": [s.left.eq(s.r), s.right.eq(s.gain[KX]), s.word.eq(s.gain[KV])],
            "PLACE LOW": [],
            "PLACE HIGH": [s.waits(KX_BITS)],
            "PLACE SUM": [s.summed],
            "VELOCITY": [s.left.eq(s.nearer), s.right.eq(s.rate), s.word.eq(s.gain[KA])],
            "VELOCITY LOW": [],
            "VELOCITY HIGH": [s.waits(p.velocity_shift)],
            "VELOCITY SUM": [s.summed],
            "FASTER": [s.left.eq(faster), s.right.eq(s.rate), s.far_faster.eq(faster != far_faster)],
            "BEND LOW": [s.far_v.eq(s.ahead + s.left)],
            "BEND HIGH": [s.waits(p.bend_shift)],
            "BEND SUM": [s.summed],
            "BEND": [s.bent.eq(s.a + shift_floor(s.total, p.bend_shift))],
            "UPDATE": [s.refuted.eq((s.was_still | ((s.v < 0) == s.was_down)) & (_size(s.v) > s.fastest))],
        }

    def _line(self, s):
        """Return the states that extrapolate the velocity from the anchor, and hold it within the bound for no edge."""
        p = s.params
        onward = Mux(s.room < 0, 0, s.room)
        limited = saturate(s.straight, -p.velocity_max, p.velocity_max)
        held = Mux(s.line < s.least, s.least, Mux(s.line > s.most, s.most, s.line))
        return {
            "LINE": [s.left.eq(s.a), s.right.eq(s.age), s.room.eq(Mux(s.v < 0, s.bound + s.v, s.bound - s.v))],
            "LINE LOW": [s.least.eq(Mux(s.v < 0, -onward, -s.v)), s.most.eq(Mux(s.v < 0, -s.v, onward))],
            # The product of a and the units of a sample follows, in which the multiplier has nothing else to do.
            "LINE HIGH": [s.waits(0), s.right.eq(p.per_sample)],
            "LINE SUM": [s.summed],
            "LINE TURN": [s.turned, s.waits(0)],
            "STRAIGHT": [s.straight.eq(s.v + s.turn), s.summed],
            "LIMIT": [s.line.eq(limited), s.far_line.eq(limited != s.straight)],
            "HOLD": [
                s.held.eq(Mux(s.doubt != 0, s.line, held)),
                s.rest.eq(s.gone | (s.doubt == 0) & (_size(s.line) >= s.bound << 1)),
            ],
            "OUTPUT": [
                self.velocity.eq(Mux(s.rest, 0, shift_round_half_up(s.held, GUARD_BITS))),
                self.acceleration.eq(Mux(s.rest, 0, s.total >> p.sample_shift)),
                self.saturated.eq(Cat(s.flags[0], s.flags[1] | s.far_line & ~s.rest, s.bursts)),
                self.valid.eq(1),
            ],
        }

    def _decide(self, m, s, name):
        """Add what a state does under a condition."""
        d, p = self._design, s.params
        match name:
            case "DIFFERENCE":
                with m.If(s.fresh):
                    m.d.sync += [s.number.eq(s.to), s.stamp.eq(s.at), s.known.eq(0), *s.forgotten]
                    m.d.sync += s.unlearned
            case "DECISION":
                came, unknown = (s.interval != 0) | (s.passed != 0), ~s.known | s.interval[-1]
                counted = fitted(s.passed, d.distance.width)
                below = counted < -p.distance_max
                m.d.sync += [
                    s.anchor.eq(came),
                    s.correct.eq(came & ~unknown),
                    s.distance.eq(Mux(below, -p.distance_max, counted)),
                    s.beyond.eq((counted != s.passed) | below),
                ]
                with m.If(came & unknown):
                    m.d.sync += [s.known.eq(1), *s.forgotten]
            case "TURN SUM":
                bound = Const(p.bound) >> Mux(s.age_size == 0, 0, s.age_size - 1)[: len(s.age_size)]
                m.d.sync += [
                    s.gone.eq(s.age[-1]),
                    s.bound.eq(Mux(bound > p.bound_max, p.bound_max, bound)),
                ]
            case "BLEND":
                with m.If(s.correct):
                    m.d.sync += s.mean.eq(s.mean + (s.total >> BLEND_BITS))
            case "MEMORY":
                agile = s.limit[AGILE_AT] << LENGTH_SHIFT
                with m.If(s.correct):
                    m.d.sync += s.memory.eq(Mux(s.alarm, agile, s.grown))
                with m.If(s.alarm):
                    m.d.sync += s.length.eq(s.nearest(agile))
            case "VELOCITY":
                with m.If(s.correct):
                    m.d.sync += s.place.eq(s.nearer - s.r)
            case "BEND HIGH":
                limited = saturate(s.far_v, -p.velocity_max, p.velocity_max)
                with m.If(s.correct):
                    m.d.sync += [s.v.eq(limited), s.flags[1].eq(s.far_faster | (limited != s.far_v))]
            case "UPDATE":
                with m.If(s.correct):
                    m.d.sync += s.a.eq(saturate(s.bent, -p.acceleration_max, p.acceleration_max))
                with m.If(s.anchor):
                    m.d.sync += [s.number.eq(s.to), s.stamp.eq(s.at)]
                if d.scale is not None:
                    with m.If(s.anchor | s.fresh):
                        m.d.sync += s.before.eq(s.error)
            case "LINE":
                with m.If(s.correct & s.refuted | s.jolt):
                    m.d.sync += s.doubt.eq(p.doubt)
            case "OUTPUT":
                with m.If(s.rest):
                    m.d.sync += [s.memory.eq(0), s.mean.eq(0), s.v.eq(0), s.a.eq(0), s.known.eq(s.known & ~s.gone)]

    def _learn(self, m, s, name):
        """Add what a state learns of the error of an edge."""
        p = s.params
        match name:
            case "MEAN":
                m.d.sync += s.large.eq(shift_floor(s.without_sign(s.r), p.usual_shift) > s.limit[USUAL])
            case "MEAN LOW":
                change = shift_round_half_up((s.large << SHARE_BITS) - s.share, LEARN_BITS)
                with m.If(s.correct & (s.passed != 0)):
                    m.d.sync += s.share.eq(s.share + change)
            case "MEAN HIGH":
                with m.If((s.share > WORSE) & (s.halvings != 0)):
                    m.d.sync += [s.share.eq(USUAL_SHARE), s.halvings.eq(s.halvings - 1)]
                with m.If((s.share < BETTER) & (s.halvings != p.halvings_max)):
                    m.d.sync += [s.share.eq(USUAL_SHARE), s.halvings.eq(s.halvings + 1)]


def _table(m, rows, widths, row, words):
    """Return a memory of a table's rows, whose columns at `row` are in `words` a clock later."""
    starts = [sum(widths[:n]) for n in range(len(widths))]
    lines = [sum(word << start for word, start in zip(line, starts, strict=True)) for line in rows.tolist()]
    table = Memory(shape=unsigned(sum(widths)), depth=len(lines), init=lines)
    read = table.read_port()
    m.d.comb += [read.addr.eq(row), read.en.eq(1), Cat(*words).eq(read.data)]
    return table


def _size(value):
    """Return the magnitude of a signed value."""
    return Mux(value < 0, -value, value)
