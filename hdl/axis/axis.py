"""One axis, from pins to force: the chain of blocks, a sample strobe, and parameters that change together."""

from amaranth.hdl import Cat, Const, Module, Mux, Signal, signed
from amaranth.lib import wiring
from amaranth.lib.wiring import Component, In, Member, Out

from hardwall.model.axis.design import ENCODER_FLAGS, GLITCH_WIDTH, ILLEGAL_WIDTH
from hardwall.model.estimators.acceleration import Accelerated
from hardwall.model.estimators.estimate import EstimatorDesign
from hardwall.model.spec import AxisSpec

from ..arithmetic.fixed import shape
from ..encoder.quadrature import Quadrature
from ..estimators.registry import block_of
from ..wires import given, names_of, port, ports
from .output import Output
from .passivity import Passivity
from .virtual_mass import VirtualMass
from .wall import Wall


class Axis(Component):
    """An axis from encoder pins to drive: decoder, velocity estimator, wall, and output stage.

    Between wall and output stage are a virtual mass and a passivity controller, if the spec has them.

    Every `spec.clocks_per_sample` clocks a strobe takes the count; `latency` clocks later the drive has changed. The
    next strobe may come before that. Then two samples are under way, and each sample's words travel with it.

    Parameters at run time: the words of `spec.design.words` are inputs. Pulse `commit` and hold the words until
    `commit_pending` falls: all words take effect together, from the sample of the next strobe on. The output stage
    takes its words with the velocity of that sample: until then it may still work on the sample before. After reset
    every parameter has its reset word (the wall is off).

    Faults: after an illegal transition, if the encoder is too fast for the decoder, or if the count has wrapped, the
    position is unknown. The drive is then zero from the next sample on until `clear_flags`. `drive_enable` low makes
    the drive zero at the next clock. Saturation in the path raises sticky `flags` and otherwise acts as the block's
    docstring says.

    Latency: `latency` clocks from the strobe to the changed drive; the decoder's latency from a pin to the strobe. A
    strobe may follow the last one after `spec.design.interval` clocks.

    Rounding and overflow: as in the blocks.

    Parameters
    ----------
    spec : hardwall.model.spec.AxisSpec
        Rates, ranges and the estimator.

    Members
    -------
    encoder_a, encoder_b, encoder_z : In(1)
        Asynchronous pins.
    drive_enable, clear_flags, commit : In(1)
        As above; `clear_flags` and `commit` are pulses.
    preload, origin_shift, preload_count : In
        A pulse of `preload` sets the count to `preload_count`, one of `origin_shift` adds it; the estimator starts
        afresh at the next sample.
    slip : In(1)
        The count has lost its scale, as somebody else has found.
    index_arm : In(1)
        Pulse: latch the place of the next index.
    one input for each word of `spec.design.words` : In
        Run-time parameters.
    drive : Out(signed)
        Force on the handle, force LSB.
    sampled, actuated : Out(1)
        High for one clock with the changed drive: `sampled` after every sample, `actuated` after a sample at which the
        drive follows the force.
    count, sampled_count, velocity, wall_force : Out(signed)
        The live count; a sample's velocity, a clock later its count, and then its wall force. With `sampled`, all are
        of the sample of the drive.
    acceleration : Out(signed)
        If the estimator has one: a sample's acceleration, with its velocity.
    flags : Out
        Sticky flags, bits as in `spec.design.flags`; the encoder's flags as the samples saw them, with their velocity.
    stepped, edge_kind, edge_down : Out
        High for one clock with the count of a new edge; the kind of the last edge, and whether it counted -1.
    indexed : Out(1)
        High for one clock with `stepped`, if the edge found an index, at the count before it.
    estimated, saturated : Out(1)
        High for one clock with a sample's velocity; with it, the estimator is saturated.
    strobe_busy : Out(1) High for one clock after a strobe that came before the last sample's velocity; no valid spec
        has such strobes.
    illegal, overspeed, wrapped : Out(1)
        The encoder's sticky flags, now.
    illegal_count : Out
        Illegal transitions since the last clear; saturates.
    index_count, index_armed, index_latched, referenced : Out
        The index latch, and whether the origin was moved by it.
    stamp, stamp_a_rise, stamp_b_rise, stamp_a_fall, stamp_b_fall : Out
        The number of this clock, and the stamp of the last edge of every kind.
    commit_pending : Out(1)
        Parameters wait for the next strobe, or the output stage's words for the velocity that comes of it.

    Raises
    ------
    TypeError
        If `spec` is not an AxisSpec.
    """

    def __init__(self, spec: AxisSpec):
        if not isinstance(spec, AxisSpec):
            raise TypeError(f"spec must be an AxisSpec, not {spec!r}")
        self._spec = spec
        design = spec.design
        count = signed(spec.count_width)
        super().__init__(
            {
                "encoder_a": In(1),
                "encoder_b": In(1),
                "encoder_z": In(1),
                "drive_enable": In(1),
                "clear_flags": In(1),
                "preload": In(1),
                "origin_shift": In(1),
                "preload_count": In(count),
                "slip": In(1),
                "index_arm": In(1),
                "commit": In(1),
                **{word.name: In(shape(word.format)) for word in design.words},
                "drive": Out(shape(spec.force)),
                "sampled": Out(1),
                "actuated": Out(1),
                "count": Out(count),
                "sampled_count": Out(count),
                "velocity": Out(shape(design.estimator.velocity)),
                **self._accelerations(design.estimator),
                "wall_force": Out(shape(spec.force)),
                "flags": Out(len(design.flags)),
                "stepped": Out(1),
                "edge_kind": Out(2),
                "edge_down": Out(1),
                "indexed": Out(1),
                "estimated": Out(1),
                "saturated": Out(1),
                "strobe_busy": Out(1),
                "illegal": Out(1),
                "overspeed": Out(1),
                "wrapped": Out(1),
                "illegal_count": Out(ILLEGAL_WIDTH),
                "index_count": Out(count),
                "index_armed": Out(1),
                "index_latched": Out(1),
                "referenced": Out(1),
                "stamp": Out(spec.stamp_width),
                "stamp_a_rise": Out(spec.stamp_width),
                "stamp_b_rise": Out(spec.stamp_width),
                "stamp_a_fall": Out(spec.stamp_width),
                "stamp_b_fall": Out(spec.stamp_width),
                "commit_pending": Out(1),
            }
        )

    @staticmethod
    def _accelerations(estimator: EstimatorDesign) -> dict[str, Member]:
        """Return the port of an estimator's acceleration, if it has one."""
        return {"acceleration": Out(shape(estimator.acceleration))} if isinstance(estimator, Accelerated) else {}

    @property
    def spec(self) -> AxisSpec:
        return self._spec

    @property
    def latency(self) -> int:
        """Clocks from the sample strobe to the changed drive."""
        return self._spec.design.latency_to_drive

    def elaborate(self, platform):
        m = Module()
        spec, design = self._spec, self._spec.design
        m.submodules.decoder = decoder = Quadrature(spec.count_width, spec.stamp_width, GLITCH_WIDTH, ILLEGAL_WIDTH)
        m.submodules.estimator = estimator = block_of(design.estimator)
        m.submodules.wall = wall = Wall(design.wall)
        m.submodules.output_stage = output = Output(design.output)

        divider = Signal(range(max(spec.clocks_per_sample, 2)))
        strobe = Signal()
        m.d.comb += strobe.eq(divider == spec.clocks_per_sample - 1)
        m.d.sync += divider.eq(Mux(strobe, 0, divider + 1))

        active = self._active(m, strobe, estimator.valid)
        for block in (estimator, wall, output):
            m.d.comb += given(block, {name: active[name] for name in names_of(block.design.words)})

        # A preload or a shift of the origin changes the count without a motion.
        restart = Signal()
        m.d.sync += restart.eq(self.preload | self.origin_shift | (restart & ~strobe))

        working = Signal()
        m.d.sync += [
            working.eq(strobe | (working & ~estimator.valid)),
            self.strobe_busy.eq(strobe & working & ~estimator.valid),
        ]

        # The words that a strobe has taken are kept up to the velocity; the next strobe may come with it. Then they are
        # kept up to the next velocity, which comes after the changed drive.
        taken_count = Signal.like(self.sampled_count)
        taken_fault, fault = Signal(len(ENCODER_FLAGS)), Signal()
        with m.If(strobe):
            faults = Cat(decoder.illegal, decoder.overspeed, decoder.wrapped)
            m.d.sync += [taken_count.eq(decoder.seen.count), taken_fault.eq(faults)]
        with m.If(estimator.valid):
            m.d.sync += [self.sampled_count.eq(taken_count), fault.eq(taken_fault.any())]

        wiring.connect(m, decoder.seen, estimator.seen)
        m.d.comb += [
            decoder.a.eq(self.encoder_a),
            decoder.b.eq(self.encoder_b),
            decoder.z.eq(self.encoder_z),
            decoder.glitch_clocks.eq(active["encoder_glitch_clocks"]),
            decoder.invert.eq(active["encoder_invert"]),
            decoder.preload.eq(self.preload),
            decoder.origin_shift.eq(self.origin_shift),
            decoder.preload_count.eq(self.preload_count),
            decoder.slip.eq(self.slip),
            decoder.arm.eq(self.index_arm),
            decoder.clear.eq(self.clear_flags),
            estimator.strobe.eq(strobe),
            estimator.restart.eq(restart),
            wall.lead.eq(strobe),
            wall.count.eq(decoder.seen.count),
            wall.strobe.eq(estimator.valid),
            wall.velocity.eq(estimator.velocity),
            output.fault.eq(fault),
            output.enable.eq(self.drive_enable),
        ]
        self._show(m, decoder, estimator, wall, output)

        force, forced, acts = wall.force, wall.valid, Const(0, 0)
        if design.mass is not None:
            m.submodules.mass = mass = VirtualMass(design.mass)
            m.d.comb += given(mass, {name: active[name] for name in names_of(design.mass.words)})
            m.d.comb += [
                mass.strobe.eq(estimator.valid),
                mass.acceleration.eq(estimator.acceleration),
                mass.forced.eq(wall.valid),
                *given(mass, ports(wall, ("force", "may_be_positive", "may_be_negative"))),
            ]
            force, forced = mass.given, mass.valid
        if design.passivity is not None:
            m.submodules.passivity = passivity = Passivity(design.passivity)
            m.d.comb += given(passivity, {name: active[name] for name in names_of(design.passivity.words)})
            m.d.comb += [
                passivity.lead.eq(strobe),
                passivity.count.eq(decoder.seen.count),
                passivity.restart.eq(restart),
                passivity.strobe.eq(estimator.valid),
                passivity.velocity.eq(estimator.velocity),
                passivity.drive.eq(output.drive),
                passivity.forced.eq(forced),
                passivity.force.eq(force),
            ]
            force, forced, acts = passivity.given, passivity.valid, passivity.active
        m.d.comb += [output.strobe.eq(forced), output.force.eq(force)]

        # A flag is visible from the sample that raised it until it is cleared.
        raised = Cat(
            Mux(estimator.valid, Cat(taken_fault, estimator.saturated), 0),
            Mux(output.valid, Cat(output.limited, acts), 0),
        )
        sticky = Signal(len(raised))
        m.d.sync += sticky.eq(Mux(self.clear_flags, 0, sticky) | raised)
        m.d.comb += self.flags.eq(sticky | raised)
        return m

    def _show(self, m: Module, decoder: Quadrature, estimator: Component, wall: Wall, output: Output) -> None:
        """Give what the blocks show to the outputs."""
        if isinstance(self._spec.design.estimator, Accelerated):
            m.d.comb += port(self, "acceleration").eq(estimator.acceleration)
        m.d.comb += [
            self.drive.eq(output.drive),
            self.sampled.eq(output.valid),
            self.actuated.eq(output.actuated),
            self.count.eq(decoder.seen.count),
            self.velocity.eq(estimator.velocity),
            self.wall_force.eq(wall.force),
            self.stepped.eq(decoder.stepped),
            self.edge_kind.eq(decoder.seen.edge),
            self.edge_down.eq(decoder.seen.down),
            self.indexed.eq(decoder.indexed),
            self.estimated.eq(estimator.valid),
            self.saturated.eq(estimator.valid & estimator.saturated.any()),
            self.illegal.eq(decoder.illegal),
            self.overspeed.eq(decoder.overspeed),
            self.wrapped.eq(decoder.wrapped),
            self.illegal_count.eq(decoder.illegal_count),
            self.index_count.eq(decoder.index_count),
            self.index_armed.eq(decoder.index_armed),
            self.index_latched.eq(decoder.index_latched),
            self.referenced.eq(decoder.referenced),
            self.stamp.eq(decoder.seen.stamp),
            self.stamp_a_rise.eq(decoder.seen.stamp_a_rise),
            self.stamp_b_rise.eq(decoder.seen.stamp_b_rise),
            self.stamp_a_fall.eq(decoder.seen.stamp_a_fall),
            self.stamp_b_fall.eq(decoder.seen.stamp_b_fall),
        ]

    def _active(self, m: Module, strobe: Signal, estimated: Signal) -> dict[str, Signal]:
        """Return the words in use by name: they wait at the inputs, and take effect together from a sample on."""
        design, pending = self._spec.design, self.commit_pending
        active = {
            word.name: Signal(shape(word.format), init=word.reset, name=f"active_{word.name}") for word in design.words
        }
        # The output stage's words come last: a strobe that comes with them is the next sample's.
        late = {word.name for word in design.output.words}
        begun = Signal()
        m.d.sync += [
            begun.eq(Mux(begun, ~estimated, strobe & pending)),
            pending.eq(self.commit | (pending & ~(begun & estimated))),
        ]
        waiting = ports(self, active)
        with m.If(strobe & pending):
            m.d.sync += [signal.eq(waiting[name]) for name, signal in active.items() if name not in late]
        with m.If(begun & estimated):
            m.d.sync += [signal.eq(waiting[name]) for name, signal in active.items() if name in late]
        return active
