"""An axis for real packages: few pins, a serial port for parameters and telemetry, and a drive that a filter can take.

The serial port has a `Frame` for each direction: `Board.commands` to the axis, `Board.telemetry` from it.
"""

from amaranth.hdl import Cat, ClockDomain, Const, Module, Mux, Shape, Signal, Value
from amaranth.lib import wiring
from amaranth.lib.cdc import FFSynchronizer
from amaranth.lib.wiring import In, Out

from hardwall.model.spec import AxisSpec

from .axis import Axis
from .frame import BYTE, Frame

PULSES = ("commit", "clear_flags", "preload", "index_arm")
"""The pulses that a frame can give to the axis: the first bits of the frame."""
TELEMETRY = (
    "drive",
    "count",
    "velocity",
    "wall_force",
    "flags",
    "illegal_count",
    "index_count",
    "index_armed",
    "index_latched",
    "stamp",
    "stamp_a_rise",
    "stamp_b_rise",
    "stamp_a_fall",
    "stamp_b_fall",
)


class Board(wiring.Component):
    """One axis behind a dozen pins.

    Serial port: an SPI device, mode 0, most significant bit first. One frame of `frame_bits`, a whole number of bytes,
    goes in each direction. While `scan_select_n` is high the shift register follows the telemetry; its fall freezes
    the telemetry, and every rise of `scan_clock` then shifts one bit out and one bit in. When `scan_select_n` rises
    after exactly one frame whose last bit is 0, the pulses whose bits are set in the frame go to the axis, all at one
    clock, with the words of the same frame: a `commit` makes the axis take every parameter at its next sample. After
    any other frame, or any other number of bits, nothing happens: a frame of zeros, an incomplete frame and a line
    stuck high only read telemetry.

    While a commit waits for its sample the register holds the words and ignores the port: a frame begun then is not
    taken, its answer is not telemetry, and it has no effect. So a host leaves a sample period between frames.

    Every level of `scan_clock` and `scan_select_n` must last 3 clocks, and `scan_in` must be stable from 1 clock before
    the rise of `scan_clock` to 2 clocks after it; `scan_out` follows that rise by 2 to 4 clocks. So the serial clock
    may run at up to a sixth of the clock's rate.

    Drive: first-order sigma-delta modulation of the drive word, as sign and magnitude. With N = `drive_bits`, per clock

        sum <- sum mod 2**N + |drive|        drive_pdm = (sum >= 2**N)

    so the density of ones is exactly |drive| / 2**N: 2**N clocks of a steady drive have |drive| ones.

    Latency: `latency` clocks from the sample strobe to the first pulse that the changed drive makes. `drive_enable` low
    makes `drive_pdm` low at once, through a gate that needs no clock, and the drive zero `enable_latency` clocks later.

    Rounding and overflow: none; the remainder that no pulse has carried yet, less than one pulse, stays in the sum,
    also when the sign changes. The axis limits the drive to less than 2**N.

    Reset: `rst` resets everything but the synchronisers, 2 to 3 clocks later; power-up does the same.

    Parameters
    ----------
    spec : hardwall.model.spec.AxisSpec
        The axis.

    Members
    -------
    clk : In(1)
        Clock of `spec.clock_hz`.
    rst : In(1)
        Asynchronous pin; resets while high.
    encoder_a, encoder_b, encoder_z : In(1)
        Asynchronous pins.
    drive_enable : In(1)
        Asynchronous pin; low turns the drive off. It must read low when nothing is connected.
    scan_select_n, scan_clock, scan_in : In(1)
        Asynchronous pins of the serial port.
    scan_out : Out(1)
        The serial port's answer.
    drive_pdm : Out(1)
        Pulses of density |drive| / 2**N.
    drive_sign : Out(1)
        1: the drive is negative.

    Raises
    ------
    TypeError
        If `spec` is not an AxisSpec.
    """

    def __init__(self, spec: AxisSpec):
        self._axis = Axis(spec)
        self._spec = spec
        members = self._axis.signature.members
        names = (*PULSES, "preload_count", *(word.name for word in spec.design.words)), TELEMETRY
        fields = [{name: Shape.cast(members[name].shape) for name in way} for way in names]
        longest = max(sum(shape.width for shape in way.values()) for way in fields)
        bits = -(-(longest + 1) // BYTE) * BYTE
        self._commands, self._telemetry = (Frame(way, bits) for way in fields)
        super().__init__(
            {
                "clk": In(1),
                "rst": In(1),
                "encoder_a": In(1),
                "encoder_b": In(1),
                "encoder_z": In(1),
                "drive_enable": In(1),
                "scan_select_n": In(1),
                "scan_clock": In(1),
                "scan_in": In(1),
                "scan_out": Out(1),
                "drive_pdm": Out(1),
                "drive_sign": Out(1),
            }
        )

    @property
    def spec(self) -> AxisSpec:
        return self._spec

    @property
    def latency(self) -> int:
        """Clocks from the sample strobe to the first pulse that the changed drive makes."""
        return self._axis.latency + 2

    @property
    def enable_latency(self) -> int:
        """Clock edges from the first that sees `drive_enable` low to the one that zeroes the drive, both included."""
        return 3

    @property
    def drive_bits(self) -> int:
        """Bits of the drive's magnitude (N above), which are the bits of its largest limit."""
        return self._spec.force.width - 2

    @property
    def commands(self) -> Frame:
        """The frame to the axis."""
        return self._commands

    @property
    def telemetry(self) -> Frame:
        """The frame from the axis."""
        return self._telemetry

    @property
    def frame_bits(self) -> int:
        """Bits of a frame in either direction: whole bytes, whose last bit is unused."""
        return self._commands.bits

    def elaborate(self, platform):
        m = Module()
        m.submodules.axis = axis = self._axis
        m.domains.sync = domain = ClockDomain()
        m.d.comb += domain.clk.eq(self.clk)

        def synchronised(pin: Value, name: str, init: int = 0) -> Signal:
            seen = Signal(name=f"{name}_seen", init=init)
            m.submodules[f"{name}_synchroniser"] = FFSynchronizer(pin, seen, init=init)
            return seen

        m.d.comb += domain.rst.eq(synchronised(self.rst, "rst", init=1))
        enable = synchronised(self.drive_enable, "drive_enable")
        select_n = synchronised(self.scan_select_n, "scan_select_n", init=1)
        clock = synchronised(self.scan_clock, "scan_clock")
        bit = synchronised(self.scan_in, "scan_in")
        m.d.comb += [
            axis.encoder_a.eq(self.encoder_a),
            axis.encoder_b.eq(self.encoder_b),
            axis.encoder_z.eq(self.encoder_z),
            axis.drive_enable.eq(enable),
        ]

        # The first field of a frame is at the top of the register, where bits leave it.
        frame = Signal(self.frame_bits)
        taken = Signal(range(self.frame_bits + 2))
        select_n_before, clock_before = Signal(init=1), Signal()
        given = Signal()
        m.d.sync += [
            select_n_before.eq(select_n),
            clock_before.eq(clock),
            given.eq(select_n & ~select_n_before & (taken == self.frame_bits) & ~frame[0]),
        ]
        with m.If(given):
            # A frame acts only once: the number of bits is now one that no frame has.
            m.d.sync += taken.eq(self.frame_bits + 1)
        with m.Elif(~axis.commit_pending):
            with m.If(select_n & select_n_before):
                m.d.sync += [frame.eq(_packed([getattr(axis, name) for name in TELEMETRY], len(frame))), taken.eq(0)]
            with m.Elif(~select_n & clock & ~clock_before):
                # Beyond a frame the number of bits stays at a frame's plus one.
                m.d.sync += [frame.eq(Cat(bit, frame)), taken.eq(Mux(taken > self.frame_bits, taken, taken + 1))]
        m.d.comb += self.scan_out.eq(frame[-1])

        for name, low, shape in self.commands:
            field = frame[low : low + shape.width]
            m.d.comb += getattr(axis, name).eq(field & given if name in PULSES else field)

        # The axis limits the drive, so its magnitude needs only the bits of the limit.
        total = Signal(self.drive_bits + 1)
        magnitude = Signal(self.drive_bits)
        negative = Signal()
        m.d.sync += [
            magnitude.eq(Mux(axis.drive < 0, -axis.drive, axis.drive)),
            negative.eq(axis.drive < 0),
            total.eq(total[:-1] + magnitude),
            self.drive_sign.eq(negative),
        ]
        m.d.comb += self.drive_pdm.eq(total[-1] & self.drive_enable)
        return m


def _packed(fields: list[Value], bits: int) -> Value:
    """Return the fields in one word of `bits` bits, the first field at the top and zeros below the last."""
    used = sum(map(len, fields))
    return Cat(Const(0, bits - used), *reversed(fields))
