"""Several axes, from pins to force, through one pipeline: each samples in its turn, with words of its own."""

from typing import Any

from amaranth.hdl import C, Cat, Module, Mux, Shape, Signal, Value, signed
from amaranth.lib import wiring
from amaranth.lib.data import ArrayLayout
from amaranth.lib.wiring import In, Out

from hardwall.model.axes.axis import FRONT_LATENCY, WALL_LATENCY, AxesSpec
from hardwall.model.axis.design import GLITCH_WIDTH, ILLEGAL_WIDTH
from hardwall.model.words import Word

from ..arithmetic.fixed import shape
from ..encoder.quadrature import Quadrature
from . import finite_difference, levant, output, wall, window
from .estimator import Entered
from .pipe import Pipe, chosen

ESTIMATORS = {"fdm": finite_difference.estimate, "levant": levant.estimate, "window": window.estimate}
"""The pipelines of estimators, by the estimator's name."""
GROUP_BITS = 3
"""Of so many bits of the axis's number, the first clock chooses among decoders; the second chooses by the others."""
ENCODER_WORDS = "encoder_glitch_clocks", "encoder_invert"
"""The words of the decoders, which act at every clock."""


class Axes(wiring.Component):
    """Axes from encoder pins to drive: a decoder and a drive each, and one estimator, wall and output stage for all.

    In a rota of `spec.clocks_per_sample` clocks, beginning with the first one after a reset, clock i takes the count of
    axis i; `latency` clocks later its drive has changed. Every axis equals a `hardwall.hdl.axis.axis.Axis` with its
    words, sample for sample. Bit i of an input with one bit for each axis belongs to axis i. Element i of an output
    array is the word of axis i.

    Parameters at run time: while `word_ready`, a clock with `word_write` puts `word_value` into the shadow of word
    `word_number` of axis `word_axis`; words are numbered as in `spec.design.words`. A pulse of an axis's `commit` makes
    all words of its shadow act together from its next sample on; until then its `commit_pending` is high. The shadow
    keeps its words. After a reset every word, and its shadow, has its reset value (the wall is off); `word_ready` is
    low during the first rota, and what is written then is lost.

    Faults: as of a single axis, for each axis alone. After an illegal transition, or at a speed beyond the decoder, the
    axis's drive is zero from its next sample on until `clear_flags`. `drive_enable` low makes its drive zero at the
    next clock; it stays zero until `drive_enable` has been high from the force to the drive of a sample of an
    actuation. A sample raises `flags` with its drive.

    Latency: `latency` clocks from a strobe to the changed drive, more than a rota if that is short; the decoder's
    latency from a pin to the strobe. Throughput: a sample of one axis or another every clock.

    Rounding and overflow: as of the blocks of a single axis.

    Parameters
    ----------
    spec : hardwall.model.axes.axis.AxesSpec
        Rates, ranges, the number of axes and the estimator.

    Members
    -------
    encoder_a, encoder_b, encoder_z : In(axes)
        Asynchronous pins.
    drive_enable, clear_flags, commit : In(axes)
        As above; `clear_flags` and `commit` are pulses.
    preload, origin_shift : In(axes), preload_count : In(signed)
        A pulse of `preload` sets the count of its axis to `preload_count`, one of `origin_shift` adds it; the estimator
        of the axis starts afresh at the next sample.
    slip : In(axes)
        The count has lost its scale, as somebody else has found.
    index_arm : In(axes)
        Pulse: latch the place of the next index.
    word_write : In(1), word_axis, word_number, word_value : In
        As above; a signed word is taken modulo its width.
    word_ready : Out(1)
        As above.
    drive, flags, count : Out(array)
        Force on the handle, force LSB; sticky flags, bits as in `spec.design.flags`, the encoder's as the samples saw
        them; the live count.
    sampled, actuated : Out(axes)
        High for one clock with the changed drive: `sampled` after every sample, `actuated` after a sample at which the
        drive follows the force.
    stepped, edge_down : Out(axes), edge_kind : Out(array), indexed : Out(axes)
        High for one clock with the count of a new edge; whether the last edge counted -1, and its kind; high for one
        clock with the count at an index.
    strobe, strobe_axis : Out High in a clock in which an axis is sampled; and the number of this axis.
    estimated : Out(axes), velocity, saturated, estimated_count : Out
        High for one clock with a sample's velocity; the velocity, whether the estimator is saturated, and the count.
    illegal, overspeed, wrapped : Out(axes), illegal_count : Out(array)
        The encoder's sticky flags, now, and the illegal transitions since the last clear; saturates.
    index_count : Out(array), index_armed, index_latched, referenced : Out(axes)
        The index latch, and whether the origin was moved by it.
    commit_pending : Out(axes)
        Words wait for the axis's next strobe.
    stamp : Out
        The number of this clock.
    record_valid : Out(1)
        High for one clock, a clock after the end of every sample of any axis.
    record_axis, record_count, record_velocity, record_wall_force, record_drive, record_flags : Out
        With `record_valid`: the sample's axis, its count, what was made of it, and the axis's flags at its end.

    Raises
    ------
    TypeError
        If `spec` is not an AxesSpec.
    """

    def __init__(self, spec: AxesSpec):
        if not isinstance(spec, AxesSpec):
            raise TypeError(f"spec must be an AxesSpec, not {spec!r}")
        self._spec = spec
        design, axes, count, number = spec.design, spec.axes, signed(spec.count_width), range(max(spec.axes, 2))
        bits = ("encoder_a", "encoder_b", "encoder_z", "drive_enable", "clear_flags", "preload", "origin_shift", "slip")
        bits += ("index_arm", "commit")
        shown = ("sampled", "actuated", "stepped", "edge_down", "indexed", "estimated", "illegal", "overspeed")
        shown += ("wrapped", "index_armed", "index_latched", "referenced", "commit_pending")
        arrays = {
            "drive": shape(spec.force),
            "flags": len(design.flags),
            "count": count,
            "edge_kind": 2,
            "illegal_count": ILLEGAL_WIDTH,
            "index_count": count,
        }
        record = {
            "valid": 1,
            "axis": number,
            "count": count,
            "velocity": shape(design.estimator.velocity),
            "wall_force": shape(spec.force),
            "drive": shape(spec.force),
            "flags": len(design.flags),
        }
        super().__init__(
            {
                **{name: In(axes) for name in bits},
                "preload_count": In(count),
                "word_write": In(1),
                "word_axis": In(number),
                "word_number": In(range(len(design.words))),
                "word_value": In(max(word.format.width for word in design.words)),
                "word_ready": Out(1),
                **{name: Out(axes) for name in shown},
                **{name: Out(ArrayLayout(each, axes)) for name, each in arrays.items()},
                "strobe": Out(1),
                "strobe_axis": Out(number),
                "velocity": Out(shape(design.estimator.velocity)),
                "saturated": Out(1),
                "estimated_count": Out(count),
                "stamp": Out(spec.stamp_width),
                **{f"record_{name}": Out(each) for name, each in record.items()},
            }
        )

    @property
    def spec(self) -> AxesSpec:
        return self._spec

    @property
    def latency(self) -> int:
        """Clocks from the strobe of an axis to its changed drive."""
        return self._spec.latency

    def elaborate(self, platform):
        m = Module()
        spec, design = self._spec, self._spec.design
        # The rota. Its first one after a reset gives every axis its reset words and no past.
        clock, first = Signal(range(max(spec.clocks_per_sample, 2))), Signal(init=1)
        phase = Signal(range(max(design.output.decimation, 2)))
        with m.If(clock == spec.clocks_per_sample - 1):
            m.d.sync += [clock.eq(0), first.eq(0), phase.eq(Mux(phase == design.output.decimation - 1, 0, phase + 1))]
        with m.Else():
            m.d.sync += clock.eq(clock + 1)
        axis = clock[: Shape.cast(range(max(spec.axes, 2))).width]
        m.d.comb += [self.word_ready.eq(~first), self.strobe.eq(clock < spec.axes), self.strobe_axis.eq(axis)]
        pipe = Pipe(m, spec.axes, axis, self.strobe)
        strobes = pipe.turns(0)
        m.d.sync += self.commit_pending.eq(self.commit | (self.commit_pending & ~Cat(strobes)))

        word = self._words(pipe, first)
        entered, fault = self._entered(pipe, self._decoders(m, strobes), first, word)
        estimate = ESTIMATORS[spec.estimator](pipe, design.estimator, entered)
        stage = FRONT_LATENCY + spec.pipeline.latency
        count = pipe.later(entered.count, spec.pipeline.latency)
        m.d.comb += [
            self.estimated.eq(Cat(pipe.turns(stage))),
            self.velocity.eq(estimate.velocity),
            self.saturated.eq(estimate.saturated.any()),
            self.estimated_count.eq(count),
        ]
        force = wall.force(pipe, design.wall, stage, count, estimate.velocity, word)

        stage += WALL_LATENCY
        forced = output.Forced(
            stage, force, pipe.later(phase == 0, stage), pipe.later(fault.any(), stage - FRONT_LATENCY)
        )
        driven = output.drive(pipe, design.output, forced, self.drive_enable, word)
        end = stage + 3
        raised = Cat(pipe.later(fault, end - FRONT_LATENCY), pipe.later(estimate.saturated, end - stage + WALL_LATENCY))
        self._end(pipe, end, driven, raised)
        m.d.sync += [
            self.record_valid.eq(pipe.valid(end + 1)),
            self.record_axis.eq(pipe.axis(end + 1)),
            self.record_count.eq(pipe.later(count, end + 1 - stage + WALL_LATENCY)),
            self.record_velocity.eq(pipe.later(estimate.velocity, end + 1 - stage + WALL_LATENCY)),
            self.record_wall_force.eq(pipe.later(force, end + 1 - stage)),
            self.record_flags.eq(pipe.of(list(self.flags), end + 1)),
        ]
        return m

    def _words(self, pipe: Pipe, first: Value):
        """Add the shadow and the words in use, except the encoders'; return a function: the word of the axis in a
        stage, by name.

        The words of a sample are read at its strobe, all at once, and go along with it.
        """
        kept = [word for word in self._spec.design.words if word.name not in ENCODER_WORDS]
        reset = Cat(C(word.reset, shape(word.format)) for word in kept)
        shadow = pipe.taken(Cat(self._shadow(pipe, word, first) for word in kept), "shadow")
        in_use = pipe.kept("words", sum(word.format.width for word in kept))
        before = pipe.taken(in_use.read(0), "words_before")
        pending = pipe.taken(pipe.of(list(self.commit_pending), 0), "pending")
        words = Mux(pipe.later(first, 1), reset, Mux(pending, shadow, before))
        in_use.leave(1, words)
        words, taken, low = pipe.taken(words, "words_now"), {}, 0
        for word in kept:
            bits = words[low : low + word.format.width]
            taken[word.name] = bits.as_signed() if word.format.signed else bits
            low += word.format.width

        return lambda name, stage: pipe.later(taken[name], stage - 2)

    def _written(self, word: Word) -> Value:
        """Return whether the host writes a word, of whichever axis."""
        return self.word_write & self.word_ready & (self.word_number == self._spec.design.words.index(word))

    def _shadow(self, pipe: Pipe, word: Word, first: Value) -> Value:
        """Return the shadow of a word, of the axis that is in stage 0; a first pass gives it its reset value."""
        bits = word.format.width
        shadow = pipe.kept(f"shadow_{word.name}", bits)
        shadow.write(
            Mux(first, word.reset & (1 << bits) - 1, self.word_value[:bits]),
            axis=Mux(first, pipe.axis(0), self.word_axis),
            enable=Mux(first, pipe.valid(0), self._written(word)),
        )
        return shadow.read(0)

    def _decoders(self, m: Module, strobes: list[Value]) -> list[Any]:
        """Return a decoder for every axis."""
        spec = self._spec
        glitch, invert = (word for word in spec.design.words if word.name in ENCODER_WORDS)
        decoders = []
        for number, strobe in enumerate(strobes):
            decoder = Quadrature(spec.count_width, spec.stamp_width, GLITCH_WIDTH, ILLEGAL_WIDTH)
            m.submodules[f"decoder_{number}"] = decoder
            decoders.append(decoder)
            for word, port in ((glitch, decoder.glitch_clocks), (invert, decoder.invert)):
                shadow = Signal(shape(word.format), init=word.reset, name=f"shadow_{word.name}_{number}")
                in_use = Signal(shape(word.format), init=word.reset, name=f"{word.name}_{number}")
                with m.If(self._written(word) & (self.word_axis == number)):
                    m.d.sync += shadow.eq(self.word_value)
                with m.If(strobe & self.commit_pending[number]):
                    m.d.sync += in_use.eq(shadow)
                m.d.comb += port.eq(in_use)
            m.d.comb += [
                decoder.a.eq(self.encoder_a[number]),
                decoder.b.eq(self.encoder_b[number]),
                decoder.z.eq(self.encoder_z[number]),
                decoder.preload.eq(self.preload[number]),
                decoder.origin_shift.eq(self.origin_shift[number]),
                decoder.preload_count.eq(self.preload_count),
                decoder.slip.eq(self.slip[number]),
                decoder.arm.eq(self.index_arm[number]),
                decoder.clear.eq(self.clear_flags[number]),
                self.count[number].eq(decoder.seen.count),
                self.stepped[number].eq(decoder.stepped),
                self.edge_kind[number].eq(decoder.seen.edge),
                self.edge_down[number].eq(decoder.seen.down),
                self.indexed[number].eq(decoder.indexed),
                self.illegal[number].eq(decoder.illegal),
                self.overspeed[number].eq(decoder.overspeed),
                self.wrapped[number].eq(decoder.wrapped),
                self.illegal_count[number].eq(decoder.illegal_count),
                self.index_count[number].eq(decoder.index_count),
                self.index_armed[number].eq(decoder.index_armed),
                self.index_latched[number].eq(decoder.index_latched),
                self.referenced[number].eq(decoder.referenced),
            ]
        m.d.comb += self.stamp.eq(decoders[0].seen.stamp)
        return decoders

    def _entered(self, pipe: Pipe, decoders: list[Any], first: Value, word) -> tuple[Entered, Value]:
        """Return the sample that is in stage `FRONT_LATENCY`, and its encoder's flags."""
        m = pipe.m
        # A preload or a shift of the origin changes the count without a motion.
        restart = Signal(self._spec.axes)
        m.d.sync += restart.eq(self.preload | self.origin_shift | (restart & ~Cat(pipe.turns(0))))
        rows = [
            Cat(each.seen.count, restart[number], each.illegal, each.overspeed, each.wrapped)
            for number, each in enumerate(decoders)
        ]
        groups = [rows[low : low + (1 << GROUP_BITS)] for low in range(0, len(rows), 1 << GROUP_BITS)]
        of_groups = [pipe.taken(chosen(m, group, pipe.axis(0)[:GROUP_BITS]), "of_group") for group in groups]
        taken = pipe.taken(chosen(m, of_groups, pipe.axis(1)[GROUP_BITS:]), "of_axis")
        width = self._spec.count_width
        fresh = taken[width] | pipe.later(first, FRONT_LATENCY)
        return Entered(FRONT_LATENCY, taken[:width].as_signed(), fresh, word), taken[width + 1 :]

    def _end(self, pipe: Pipe, end: int, driven: output.Driven, raised: Value) -> None:
        """Let the sample in that stage change the drive and the flags of its axis."""
        m, off = pipe.m, [mine | ~self.drive_enable[number] for number, mine in enumerate(driven.dropped)]
        for number, turn in enumerate(pipe.turns(end)):
            limited = driven.limited & ~driven.dropped[number].replicate(2)
            with m.If(turn):
                m.d.sync += self.drive[number].eq(driven.drive)
            with m.If(off[number]):
                m.d.sync += self.drive[number].eq(0)
            sticky = Mux(self.clear_flags[number], 0, self.flags[number])
            m.d.sync += [
                self.flags[number].eq(sticky | Mux(turn, Cat(raised, limited), 0)),
                self.sampled[number].eq(turn),
                self.actuated[number].eq(turn & driven.turn),
            ]
        m.d.sync += self.record_drive.eq(pipe.taken(Mux(pipe.of(off, end), 0, driven.drive), "drive_now"))
