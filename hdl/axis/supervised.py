"""An axis that may touch a motor: the axis, its monitors, and the supervisor behind both."""

from amaranth.hdl import Cat, Const, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from hardwall.model.axis.supervised import FIXED, SLIPS, Design
from hardwall.model.axis.supervisor import ARMED, CAUSES
from hardwall.model.spec import AxisSpec

from ..arithmetic.fixed import less, shape
from ..wires import given, names_of, ports
from .axis import Axis
from .monitors import Monitors
from .supervisor import Supervisor

LOOPS = ("drive_enable", "external_fault", "emergency_stop")
"""Pins of normally closed loops: high is closed and well; low is open, cut, or not connected."""
COMPLEMENTS = ("encoder_a_n", "encoder_b_n")
REQUESTS = ("arm", "disarm", "acknowledge", "acknowledged", "heartbeat")
"""Inputs of the supervisor that come from the host."""
SHOWN = (
    "driven", "magnitude", "negative", "state", "alive", "live", "ready", "latched", "first", "first_stamp", "counts",
)  # fmt: skip
"""Outputs of the supervisor."""


class SupervisedAxis(wiring.Component):
    """An axis from pins to the drive that is let out: `Axis`, `Monitors` and `Supervisor`; see there.

    The axis itself computes a drive all the time, and no host limits it; the supervisor's force limit comes last. The
    axis's own enable follows the loop of `drive_enable`, so that its slew limit begins at zero too. A commit of another
    `encoder_invert` is a `disarm`; an `arm` in the same clock gives way to it. It is a `slip`, too, and so is an
    enabled cause of `SLIPS`.

    Latency: `latency` clocks from the sample strobe to the changed `driven`, one more than the axis's. From an opening
    pin of `LOOPS` to a drive of zero: `loop_latency` clock edges; the first one sees the pin.

    Rounding and overflow: as in the blocks.

    Parameters
    ----------
    spec : hardwall.model.spec.AxisSpec
        Rates, ranges and the estimator.

    Members
    -------
    the pins, pulses and outputs of `Axis` : In and Out
        As there; `drive` is what the axis asks for.
    encoder_a_n, encoder_b_n : In(1)
        Complements of the encoder's channels; asynchronous. They count for nothing unless encoder_loss is enabled.
    drive_enable, external_fault, emergency_stop : In(1)
        Loops: high is closed; asynchronous.
    the requests of the host to `Supervisor` : In
        As there.
    one input for each word of `design.words` : In Run-time parameters. The words of `design.committed` act at the
        sample after a commit, the others at the next clock. One of these others beyond its range in `design.ranges` is
        the cause word_range.
    the outputs of `Supervisor` : Out
        As there; `driven`, or `magnitude` and `negative`, is the drive that may leave the FPGA.
    drive_inverted : Out(1)
        The sign of the drive's pins is to be reversed: `drive_invert`, as it was when the axis was last not ARMED.
    a_channel_idle : Out(1)
        A warning, see `Monitors`.

    Raises
    ------
    TypeError
        If `spec` is not an AxisSpec.
    """

    def __init__(self, spec: AxisSpec):
        self._axis = Axis(spec)
        self._design = design = Design(spec)
        self._monitors, self._supervisor = Monitors(design.monitors), Supervisor(design.supervisor)
        axis = {name: member for name, member in self._axis.signature.members.items() if name not in FIXED}
        supervisor = self._supervisor.signature.members
        super().__init__(
            {
                **axis,
                **dict.fromkeys((*COMPLEMENTS, *LOOPS), In(1)),
                **{name: supervisor[name] for name in (*REQUESTS, *SHOWN)},
                **{word.name: In(shape(word.format)) for word in design.live},
                "drive_inverted": Out(1),
                "a_channel_idle": Out(1),
            }
        )

    @property
    def design(self) -> Design:
        return self._design

    @property
    def latency(self) -> int:
        """Clocks from the sample strobe to the changed `driven`."""
        return self._axis.latency + 1

    @property
    def loop_latency(self) -> int:
        """Clock edges from the first that sees a loop open to the zeroing of the drive, both included."""
        return 3

    def elaborate(self, platform):
        m = Module()
        m.submodules.axis = axis = self._axis
        m.submodules.monitors = monitors = self._monitors
        m.submodules.supervisor = supervisor = self._supervisor

        levels = {}
        # A channel and its complement are compared as the same edge of the clock has seen them.
        for name, pin in ports(self, ("encoder_a", "encoder_b", *COMPLEMENTS, *LOOPS)).items():
            levels[name] = Signal(name=f"{name}_level")
            m.submodules[f"{name}_synchroniser"] = FFSynchronizer(pin, levels[name])

        ours = ports(self)
        for name, its in ports(axis).items():
            if axis.signature.members[name].flow == Out:
                m.d.comb += ours[name].eq(its)
            elif name == "drive_enable":
                m.d.comb += its.eq(levels[name])
            elif name not in (*FIXED, "slip"):
                m.d.comb += its.eq(ours[name])
        fixed = {word.name: word.format.max for word in self._design.spec.design.words if word.name in FIXED}
        m.d.comb += given(axis, fixed)

        m.d.comb += [
            monitors.count.eq(axis.count),
            monitors.stepped.eq(axis.stepped),
            monitors.edge_kind.eq(axis.edge_kind),
            monitors.edge_down.eq(axis.edge_down),
            monitors.indexed.eq(axis.indexed),
            monitors.valid.eq(axis.estimated),
            monitors.velocity.eq(axis.velocity),
            monitors.saturated.eq(axis.saturated),
            monitors.at_limit.eq(supervisor.at_limit),
            monitors.negative.eq(supervisor.negative),
            monitors.a.eq(levels["encoder_a"]),
            monitors.a_n.eq(levels["encoder_a_n"]),
            monitors.b.eq(levels["encoder_b"]),
            monitors.b_n.eq(levels["encoder_b_n"]),
            self.a_channel_idle.eq(monitors.a_channel_idle),
        ]

        beyond = []
        for name, (least, most) in self._design.ranges.items():
            word = ours[name]
            beyond += [less(word, least), ~less(word, most + 1)]
        outside = {
            "encoder_illegal": axis.illegal,
            "encoder_overspeed": axis.overspeed,
            "position_wrap": axis.wrapped,
            "strobe_busy": axis.strobe_busy,
            "word_range": Cat(beyond).any(),
            "external_fault": ~levels["external_fault"],
            "emergency_stop": ~levels["emergency_stop"],
        }
        m.d.comb += [
            supervisor.causes.eq(monitors.causes | Cat(outside.get(cause.name, Const(0, 1)) for cause in CAUSES)),
            supervisor.strobe.eq(axis.sampled),
            supervisor.drive.eq(axis.drive),
            supervisor.stamp.eq(axis.stamp),
            supervisor.enable.eq(levels["drive_enable"]),
            supervisor.referenced.eq(axis.referenced),
        ]
        # The other direction turns the wall around: the drive is zero before the axis takes it.
        inverted = Signal()
        with m.If(self.commit):
            m.d.sync += inverted.eq(self.encoder_invert)
        turned = self.commit & (self.encoder_invert ^ inverted)
        slips = Cat(monitors.causes[bit] & self.supervisor_causes[bit] for bit in SLIPS)
        m.d.comb += axis.slip.eq(self.slip | turned | slips.any())
        m.d.comb += given(supervisor, ports(self, REQUESTS) | {"disarm": self.disarm | turned})
        for block in (supervisor, monitors):
            m.d.comb += given(block, ports(self, names_of(block.design.words)))
        m.d.comb += given(self, ports(supervisor, SHOWN))
        with m.If(self.state != ARMED):
            m.d.sync += self.drive_inverted.eq(self.drive_invert)
        return m
