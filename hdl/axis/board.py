"""An axis for real packages: the pins of an encoder, three loops, a link, and a drive that an amplifier can take."""

from amaranth.hdl import Cat, Module, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.axis.registers import EDGE_STAMPS, RegisterMap
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.link import uart
from hardwall.model.register import VALUE_BITS
from hardwall.model.spec import AxisSpec

from ..board.clocks import board_clocks
from ..board.lead_out import lead_out
from ..drive.registry import block_of
from ..link.axi_link import AxiLink
from ..link.link import Link
from ..wires import given, names_of, port, ports
from .capture import Capture
from .supervised import COMPLEMENTS, LOOPS, SupervisedAxis

ENCODER = ("encoder_a", "encoder_b", "encoder_z", *COMPLEMENTS)
"""Pins of the encoder."""
CAPTURED = ("sampled", "wall_force", "driven", "state", "live", "flags", "stamp")
"""The axis's outputs that the capture memory takes unchanged."""


class Board(wiring.Component):
    """A supervised axis behind a dozen pins: `SupervisedAxis`, its link and its capture memory; see there.

    A host reads and writes the registers of `registers`; what it asks for in one frame happens at one clock. It is
    refused an `arm` unless the axis is `ready`, and a `preload` or an `origin_shift` while ARMED. Neither is answered
    before the drive follows the new count.

    Drive: the drive stage of `spec.stage`, a block of `hdl/drive/`, makes pins of `driven`. The word `drive_invert`
    reverses the sign; it is taken in every state but ARMED.

    Safe are the pins of the drive as the stage says, and `alive` low; they are so from power-up on. A clock that stops
    would freeze the pins. The oscillator, a second clock, detects this at most `clock_monitor.Design.stop_latency_s`
    later and makes the pins safe. It then acts like the loop of `drive_enable`: when the clock comes back, the axis is
    DISARMED and without a reference, because edges may have been missed. Until both clocks run and the reset has ended,
    `outputs_enable` is low: the outputs may be left to their pulls.

    Latency: at most `latency` clocks from the sample strobe to pins that follow the changed drive. `drive_enable` or
    `emergency_stop` low makes the pins of the drive safe at once, through a gate that needs no clock; any cause makes
    them safe `safe_latency` clocks after it stands.

    Rounding and overflow: as of the stage.

    Reset: `rst` resets everything but the synchronisers and the clock's monitor, 2 to 3 clocks later; power-up does the
    same.

    Parameters
    ----------
    spec : hardwall.model.spec.AxisSpec
        The axis.
    link : Link or AxiLink, optional The link to the host, with the registers of this axis. The registers say how large
        the capture memory is, or that there is none. Default: a serial line of 921 600 baud, or the highest rate that
        the clock allows, with the registers that `RegisterMap` gives the axis.

    Members
    -------
    clk : In(1)
        Clock of `spec.clock_hz`.
    rst : In(1)
        Asynchronous pin; resets while high.
    oscillator : In(1)
        A clock of any frequency in `clock_monitor.OSCILLATOR_HZ` that does not come from `clk`'s source, such as the
        part's internal oscillator.
    encoder_a, encoder_b, encoder_z : In(1)
        Asynchronous pins.
    encoder_a_n, encoder_b_n : In(1)
        Complements of the channels; asynchronous pins.
    drive_enable, external_fault, emergency_stop : In(1)
        Loops: high is closed; asynchronous pins, which must read low when nothing is connected.
    the pins of the link : In and Out
        `uart_rx`, an asynchronous pin that must read high when nothing is connected, and `uart_tx`; or an AXI bus.
    the pins of the drive stage : Out(1)
        As in its block; 1 is negative for the drive, or positive if it is inverted.
    alive : Out(1)
        A square wave while ARMED, for the charge pump of an amplifier's enable.
    outputs_enable : Out(1)
        Enable of the output buffers of the drive's pins and `alive`: the clock runs, and the reset has ended.

    Raises
    ------
    TypeError
        If `spec` is not an AxisSpec.
    ValueError
        If the clock is too slow for a serial line, or the link has the registers of another axis.
    """

    def __init__(self, spec: AxisSpec, link: Link | AxiLink | None = None):
        self.axis = SupervisedAxis(spec)
        self.stage = block_of(spec.drive)
        self.link = Link(RegisterMap(spec), uart.usual_baud(spec.clock_hz)) if link is None else link
        registers = RegisterMap(spec, self.link.registers.capture_registers)
        if self.link.registers.identity != registers.identity:
            raise ValueError(f"link must have the registers {registers.identity}, not {self.link.registers.identity}")
        self.capture = Capture(registers.capture) if registers.capture else None
        super().__init__(
            {
                "clk": In(1),
                "rst": In(1),
                "oscillator": In(1),
                **dict.fromkeys((*ENCODER, *LOOPS), In(1)),
                **self.link.PINS,
                **dict.fromkeys(spec.drive.pins, Out(1)),
                "alive": Out(1),
                "outputs_enable": Out(1),
            }
        )

    @property
    def spec(self) -> AxisSpec:
        return self.axis.design.spec

    @property
    def registers(self) -> RegisterMap:
        return self.link.registers

    @property
    def drive_latency(self) -> int:
        """Clocks from the sample strobe to the changed drive that is let out."""
        return self.axis.latency

    @property
    def latency(self) -> int:
        """The most clocks from the sample strobe to pins that follow the changed drive."""
        return self.axis.latency + self.stage.latency

    @property
    def safe_latency(self) -> int:
        """Clocks from a cause that stands to the first clock with safe pins: of the supervisor, and of the stage."""
        return 1 + self.stage.design.safe_latency

    def elaborate(self, platform):
        m = Module()
        m.submodules.axis = axis = self.axis
        m.submodules.link = link = self.link
        running, stood, reset = board_clocks(m, self)
        m.d.comb += lead_out(axis, self, (*ENCODER, "external_fault", "emergency_stop"))
        m.d.comb += [axis.drive_enable.eq(self.drive_enable & running), self.outputs_enable.eq(running & ~reset)]
        m.d.comb += axis.slip.eq(stood)
        m.d.comb += lead_out(link, self, link.PINS)

        registers = self.registers
        has = ports(axis)
        if self.capture:
            m.submodules.capture = capture = self.capture
            m.d.comb += [
                *given(capture, ports(axis, (*CAPTURED, *(["acceleration"] if capture.design.acceleration else [])))),
                capture.count.eq(axis.sampled_count),
                capture.velocity.eq(axis.velocity >> len(axis.velocity) - len(capture.velocity)),
                capture.address.eq(link.capture_address),
                link.capture_data.eq(capture.data),
                link.capture_done.eq(capture.done),
            ]
            has |= {name: shown for name, shown in ports(capture).items() if name.startswith("capture_")}
        asked = ports(link, names_of((*registers.words, *registers.live, *registers.pulses)))
        m.d.comb += [has[name].eq(value) for name, value in asked.items()]
        parts = {
            f"counts_{k}": axis.counts.word_select(k, VALUE_BITS) for k in range(-(-len(axis.counts) // VALUE_BITS))
        }
        for shown in registers.status:
            # The link remembers the stamps of edges itself.
            if shown.name in EDGE_STAMPS:
                continue
            # A value that is wider than its register gives the upper bits.
            value = parts[shown.name] if shown.name in parts else has[shown.name]
            m.d.comb += port(link, shown.name).eq(value >> max(len(value) - shown.format.width, 0))
        armed = axis.state == ARMED
        refused = {"arm": ~axis.ready, "preload": armed, "origin_shift": armed}
        # At most two samples of the old count, or of the old words, are under way, so the drive of the third actuation
        # follows the new ones. An ARMED axis drives meanwhile anyway, so its commit does not wait for it.
        old = Signal(2)
        with m.If(axis.preload | axis.origin_shift | (axis.commit_pending & ~armed)):
            m.d.sync += old.eq(3)
        with m.Elif(axis.actuated):
            m.d.sync += old.eq(old - old.any())
        m.d.comb += [
            link.stepped.eq(axis.stepped),
            link.edge_kind.eq(axis.edge_kind),
            link.refuse.eq(Cat(refused.get(pulse.name, 0) for pulse in registers.pulses)),
            link.commit_pending.eq(axis.commit_pending | old.any()),
        ]

        self._drive(m, armed, running)
        m.d.comb += self.alive.eq(axis.alive & running)
        return m

    def _drive(self, m: Module, armed: Value, running: Signal) -> None:
        """Give the drive that is let out to the stage, and its pins to the outside."""
        axis, stage = self.axis, self.stage
        m.submodules.stage = stage
        # The strobe comes with the drive that the supervisor has let out, a clock after the axis's.
        actuated = Signal()
        taken = {
            "strobe": actuated,
            "magnitude": axis.magnitude,
            "negative": axis.negative ^ axis.drive_inverted,
            "armed": armed,
            "permitted": self.drive_enable & self.emergency_stop & running,
        }
        if "strobe" in stage.signature.members:
            m.d.sync += actuated.eq(axis.actuated)
        m.d.comb += given(stage, {name: value for name, value in taken.items() if name in stage.signature.members})
        m.d.comb += lead_out(stage, self, stage.design.pins)
