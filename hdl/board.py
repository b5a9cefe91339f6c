"""An axis for real packages: the pins of an encoder, three loops, a link, and a drive that a filter can take."""

from amaranth.hdl import Cat, ClockDomain, DomainRenamer, Module, Signal
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from hardwall.model import clock_monitor
from hardwall.model.link import uart
from hardwall.model.register import VALUE_BITS
from hardwall.model.registers import EDGE_STAMPS, RegisterMap
from hardwall.model.spec import AxisSpec
from hardwall.model.supervisor import ARMED

from .capture import Capture
from .clock_monitor import ClockMonitor
from .lead_out import lead_out
from .link.axi_link import AxiLink
from .link.link import Link
from .supervised import COMPLEMENTS, LOOPS, SupervisedAxis

ENCODER = ("encoder_a", "encoder_b", "encoder_z", *COMPLEMENTS)
"""Pins of the encoder."""
CAPTURED = ("sampled", "wall_force", "driven", "state", "live", "flags", "stamp")
"""What the capture memory takes as the axis shows it."""


class Board(wiring.Component):
    """A supervised axis behind a dozen pins: `SupervisedAxis`, its link and its capture memory, which say what they do.

    A host reads and writes the registers of `registers`; what it asks for in one frame happens at one clock. It is
    refused an `arm` unless the axis is `ready`, and a `preload` while ARMED.

    Drive: first-order sigma-delta modulation of `driven`, as sign and magnitude. With N = `drive_bits`, per clock

        sum <- sum mod 2**N + |driven|        drive_pdm = (sum >= 2**N)

    so the density of ones is exactly |driven| / 2**N: 2**N clocks of a steady drive have |driven| ones. The word
    `drive_invert` reverses the sign; it is taken in every state but ARMED.

    Safe is `drive_pdm` and `alive` low, which they are from power-up on. A clock that stops would keep them as they
    were: the oscillator, a second clock, finds that out, at most `clock_monitor.Design.stop_latency_s` later, makes
    them low, and acts as the loop of `drive_enable` does, so that the axis is DISARMED when the clock comes back. Until
    both clocks run and the reset has ended, `outputs_enable` is low: the outputs may be left to their pull-downs.

    Latency: `latency` clocks from the sample strobe to the first pulse that the changed drive makes. `drive_enable` or
    `emergency_stop` low makes `drive_pdm` low at once, through a gate that needs no clock; any cause makes it low
    `safe_latency` clocks after it stands.

    Rounding and overflow: none; the remainder that no pulse has carried yet, less than one pulse, stays in the sum,
    also when the sign changes. The axis limits the drive to less than 2**N.

    Reset: `rst` resets everything but the synchronisers and the clock's monitor, 2 to 3 clocks later; power-up does the
    same.

    Parameters
    ----------
    spec : hardwall.model.spec.AxisSpec
        The axis.
    link : Link or AxiLink, optional
        What the host talks to, with the registers of this axis, and so with a capture memory of as many registers as
        these say, or none; a serial line of 921 600 baud if it is not given, or what the clock allows of that, with the
        registers that `RegisterMap` gives the axis.

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
    drive_pdm : Out(1)
        Pulses of density |driven| / 2**N.
    drive_sign : Out(1)
        1: the drive is negative, or positive if it is inverted.
    alive : Out(1)
        A square wave while ARMED, for the charge pump of an amplifier's enable.
    outputs_enable : Out(1)
        Enable of the output buffers of the three above: the clock runs, and the reset has ended.

    Raises
    ------
    TypeError
        If `spec` is not an AxisSpec.
    ValueError
        If the clock is too slow for a serial line, or the link has the registers of another axis.
    """

    def __init__(self, spec: AxisSpec, link: Link | AxiLink | None = None):
        self.axis = SupervisedAxis(spec)
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
                "drive_pdm": Out(1),
                "drive_sign": Out(1),
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
        """Clocks from the sample strobe to the first pulse that the changed drive makes."""
        return self.axis.latency + 1

    @property
    def safe_latency(self) -> int:
        """Clocks from a cause that stands to the first clock without a pulse: of the supervisor, and of the pulses."""
        return 1 + 1

    @property
    def drive_bits(self) -> int:
        """Bits of the drive's magnitude (N above), which are the bits of its largest limit."""
        return self.spec.force.width - 2

    def elaborate(self, platform):
        m = Module()
        m.submodules.axis = axis = self.axis
        m.submodules.link = link = self.link
        m.domains.sync = domain = ClockDomain()
        m.d.comb += domain.clk.eq(self.clk)
        reset = Signal(init=1)
        m.submodules.rst_synchroniser = FFSynchronizer(self.rst, reset, init=1)
        m.d.comb += domain.rst.eq(reset)

        running = self._watch_clock(m)
        m.d.comb += lead_out(axis, self, (*ENCODER, "external_fault", "emergency_stop"))
        m.d.comb += [axis.drive_enable.eq(self.drive_enable & running), self.outputs_enable.eq(running & ~reset)]
        m.d.comb += lead_out(link, self, link.PINS)

        registers = self.registers
        has = {name: getattr(axis, name) for name in axis.signature.members}
        if self.capture:
            m.submodules.capture = capture = self.capture
            m.d.comb += [
                *(getattr(capture, name).eq(has[name]) for name in CAPTURED),
                capture.count.eq(axis.sampled_count),
                capture.velocity.eq(axis.velocity >> len(axis.velocity) - len(capture.velocity)),
                capture.address.eq(link.capture_address),
                link.capture_data.eq(capture.data),
                link.capture_done.eq(capture.done),
            ]
            has |= {name: getattr(capture, name) for name in capture.signature.members if name.startswith("capture_")}
        for asked in (*registers.words, *registers.live, *registers.pulses):
            m.d.comb += has[asked.name].eq(getattr(link, asked.name))
        parts = {
            f"counts_{k}": axis.counts.word_select(k, VALUE_BITS) for k in range(-(-len(axis.counts) // VALUE_BITS))
        }
        for shown in registers.status:
            # The link remembers the stamps of edges itself.
            if shown.name in EDGE_STAMPS:
                continue
            # A value that is wider than its register gives the upper bits.
            value = parts[shown.name] if shown.name in parts else has[shown.name]
            m.d.comb += getattr(link, shown.name).eq(value >> max(len(value) - shown.format.width, 0))
        armed = axis.state == ARMED
        refused = {"arm": ~axis.ready, "preload": armed}
        m.d.comb += [
            link.stepped.eq(axis.stepped),
            link.edge_kind.eq(axis.edge_kind),
            link.refuse.eq(Cat(refused.get(pulse.name, 0) for pulse in registers.pulses)),
            link.commit_pending.eq(axis.commit_pending),
        ]

        total = Signal(self.drive_bits + 1)
        m.d.sync += [
            total.eq(total[:-1] + axis.magnitude),
            self.drive_sign.eq(axis.negative ^ axis.drive_inverted),
        ]
        m.d.comb += [
            self.drive_pdm.eq(total[-1] & self.drive_enable & self.emergency_stop & running),
            self.alive.eq(axis.alive & running),
        ]
        return m

    def _watch_clock(self, m: Module) -> Signal:
        """Return whether the clock runs, as the oscillator has found."""
        design = clock_monitor.Design(self.spec.clock_hz)
        m.domains.oscillator = domain = ClockDomain(reset_less=True)
        m.d.comb += domain.clk.eq(self.oscillator)
        monitor = ClockMonitor(design)
        m.submodules.clock_monitor = DomainRenamer("oscillator")(monitor)
        # The clock runs while a reset lasts, too.
        beat = Signal(design.beat_clocks.bit_length(), reset_less=True)
        m.d.sync += beat.eq(beat + 1)
        m.d.comb += monitor.beat.eq(beat[-1])
        return monitor.running
