"""Several axes for real packages: the pins of their encoders, one set of loops, a link, and drives for amplifiers."""

from amaranth.hdl import Module
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.registers import OF_CAPTURE, AxesMap
from hardwall.model.link import uart

from ..axis.supervised import LOOPS
from ..board.clocks import board_clocks
from ..board.lead_out import lead_out
from ..drive.registry import block_of
from ..link.link import Link
from ..wires import given, ports
from .capture import AxesCapture
from .supervised import SupervisedAxes

ENCODER = "encoder_a", "encoder_b", "encoder_z"
"""Pins of every encoder."""


class AxesBoard(wiring.Component):
    """Supervised axes behind their pins: `SupervisedAxes`, their link, a capture memory and a stage of pulses for each.

    A host reads and writes the registers of `registers`, a bank for each axis; what it asks of an axis in one frame
    happens at one clock. An `arm` is refused if the axis is not `ready`, and a `preload` or an `origin_shift` if it is
    ARMED.

    One set of loops serves all axes: `drive_enable`, `emergency_stop` and `external_fault`, which an axis takes part in
    as its `supervisor_causes` says. Encoders have no complements here: each is taken to be unlike its channel, so
    encoder_loss finds nothing, enabled or not. An axis has an `alive` of its own.

    Drive: pulses whose density is the magnitude, and a sign, as in `hardwall.hdl.drive.pdm` without an amplifier. The
    word `drive_invert` of an axis reverses its sign; it is taken in every state but ARMED.

    Safe are the pins of a drive low, and `alive` low; they are so from power-up on, and when the clock stops: see
    `Board`. Until both clocks run and the reset has ended, `outputs_enable` is low.

    Latency: at most `latency` clocks from an axis's strobe to pulses that follow the changed drive. `drive_enable` or
    `emergency_stop` low makes every pulse low at once, through a gate that needs no clock. An open loop of
    `external_fault` makes them low `safe_latency` clock edges later. Any other cause does so after the axis's turn: see
    `SupervisedAxes`.

    Rounding and overflow: as of the stage.

    Reset: as of `Board`.

    Parameters
    ----------
    spec : hardwall.model.axes.axis.AxesSpec
        The axes.
    baud : int, optional
        Rate of the serial line; 921 600 baud if it is not given, or what the clock allows of that.
    capture_registers : int, optional
        Registers of the capture memory, as of `AxesMap`.

    Members
    -------
    clk, rst, oscillator : In(1)
        As of `Board`.
    encoder_a, encoder_b, encoder_z : In(axes) Asynchronous pins; bit i belongs to axis i.
    drive_enable, external_fault, emergency_stop : In(1)
        Loops of all axes: high is closed; asynchronous pins, which must read low when nothing is connected.
    uart_rx, uart_tx : In(1) and Out(1)
        The serial line: `uart_rx` is an asynchronous pin that must read high when nothing is connected.
    drive_pdm, drive_sign : Out(axes)
        Pulses and signs.
    alive : Out(axes)
        A square wave while the axis is ARMED, for the charge pump of its amplifier's enable.
    outputs_enable : Out(1)
        Enable of the output buffers of the drives' pins and `alive`: the clock runs, and the reset has ended.

    Raises
    ------
    TypeError
        If `spec` is not an AxesSpec, or `baud` is not an int.
    ValueError
        If the clock is too slow for a serial line, or there can be no such capture memory.
    """

    def __init__(self, spec: AxesSpec, baud: int | None = None, capture_registers: int | None = None):
        self.axes = SupervisedAxes(spec)
        rate = uart.usual_baud(spec.clock_hz) if baud is None else baud
        registers = AxesMap(spec, capture_registers)
        self.link = Link(registers, rate)
        self.capture = AxesCapture(registers.capture) if registers.capture else None
        self.stages = [block_of(spec.drive) for _ in range(spec.axes)]
        super().__init__(
            {
                "clk": In(1),
                "rst": In(1),
                "oscillator": In(1),
                **dict.fromkeys(ENCODER, In(spec.axes)),
                **dict.fromkeys(LOOPS, In(1)),
                **self.link.PINS,
                **dict.fromkeys((*spec.drive.pins, "alive"), Out(spec.axes)),
                "outputs_enable": Out(1),
            }
        )

    @property
    def spec(self) -> AxesSpec:
        return self.axes.design.spec

    @property
    def registers(self) -> AxesMap:
        return self.link.registers

    @property
    def drive_latency(self) -> int:
        """Clocks from the sample strobe of an axis to the changed drive that is let out."""
        return self.axes.latency

    @property
    def latency(self) -> int:
        """The most clocks from the sample strobe of an axis to pulses that follow the changed drive."""
        return self.axes.latency + self.stages[0].design.latency

    @property
    def safe_latency(self) -> int:
        """Clock edges from the first that sees the fault loop open until the pulses are low."""
        return self.axes.loop_latency + self.stages[0].design.safe_latency

    def elaborate(self, platform):
        m = Module()
        m.submodules.axes, m.submodules.link = axes, link = self.axes, self.link
        running, stood, reset = board_clocks(m, self)

        loops = ports(self, LOOPS) | {"drive_enable": self.drive_enable & running}
        m.d.comb += lead_out(axes, self, ENCODER)
        m.d.comb += axes.slip.eq(stood.replicate(self.spec.axes))
        m.d.comb += lead_out(link, self, link.PINS)
        # A channel without a complement differs from its stand-in, whatever the clock edge sees.
        m.d.comb += [axes.encoder_a_n.eq(~axes.encoder_a), axes.encoder_b_n.eq(~axes.encoder_b)]
        m.d.comb += given(axes, {name: loop.replicate(self.spec.axes) for name, loop in loops.items()})
        parts = {False: ports(axes)}
        if self.capture:
            m.submodules.capture = capture = self.capture
            parts[True] = ports(capture)
            shown = (name for name in capture.signature.members if not name.startswith(OF_CAPTURE))
            m.d.comb += given(capture, ports(axes, shown))
        for name, ours in ports(link).items():
            if name in link.PINS:
                continue
            theirs = parts[name.startswith(OF_CAPTURE)][name]
            m.d.comb += theirs.eq(ours) if link.signature.members[name].flow == Out else ours.eq(theirs)
        permitted = self.drive_enable & self.emergency_stop & running
        for number, stage in enumerate(self.stages):
            m.submodules[f"stage_{number}"] = stage
            m.d.comb += [
                stage.magnitude.eq(axes.magnitude[number]),
                stage.negative.eq(axes.negative[number] ^ axes.drive_inverted[number]),
                stage.permitted.eq(permitted),
                self.drive_pdm[number].eq(stage.drive_pdm),
                self.drive_sign[number].eq(stage.drive_sign),
            ]
        m.d.comb += [
            self.alive.eq(axes.alive & running.replicate(self.spec.axes)),
            self.outputs_enable.eq(running & ~reset),
        ]
        return m
