"""The board as its models say it is, clock for clock, and a host that talks to the board under test."""

from cocotb.triggers import RisingEdge

from hardwall.hdl.board import TELEMETRY, Board
from hardwall.hdl.frame import BYTE
from hardwall.model import output, quadrature, wall
from hardwall.model.estimators.estimate import estimate
from hardwall.testing import Bench, rng
from stimuli.specs import spec

HALF = 3
"""The fewest clocks allowed for a level on the serial port."""
SYNCHRONISER = 2
"""Clock edges from a change of a pin to the last edge that does not act on it."""


def make(name: str) -> Board:
    return Board(spec(name))


class Twin:
    """The state of the board's axis and its pulses, clock for clock, from the models alone.

    The blocks have their own benches; the twin adds the clock edge at which their results can be seen.
    """

    def __init__(self, name: str):
        self.spec = spec(name)
        self.design = self.spec.design
        self.period, self.drive_bits = self.spec.clocks_per_sample, self.spec.force.width - 2
        self.clocks = 0
        self.words = {word.name: word.reset for word in self.design.words}
        self.restart, self.waiting = 0, None
        self.decoder_params = self.spec.design.decoder
        self.decoder, self.estimator, self.output = quadrature.START, self.design.start().estimator, output.START
        self.velocity = self.wall_force = self.drive = self.sticky = 0
        self.loaded, self.raised = {}, {}
        self.sum = self.magnitude = self.negative = self.pulse = self.sign = 0

    def telemetry(self) -> dict[str, int]:
        """Return the telemetry that a capture at the next edge takes."""
        own = {
            "drive": self.drive,
            "velocity": self.velocity,
            "wall_force": self.wall_force,
            "flags": self.sticky | self._raised(),
        }
        return {name: own[name] if name in own else getattr(self.decoder, name) for name in TELEMETRY}

    @property
    def strobe(self) -> bool:
        """Return whether the next edge takes a sample."""
        return self.clocks % self.period == self.period - 1

    def _raised(self) -> int:
        """Return the flags that rise with the next edge; the pin already shows them."""
        encoder = self.decoder.illegal | self.decoder.overspeed << 1 if self.strobe else 0
        return self.raised.get(self.clocks, 0) | encoder

    def _sample(self) -> None:
        d, decoder, now = self.design, self.decoder, self.clocks
        params = d.params(self.words)
        seen = quadrature.seen(decoder)
        self.estimator, velocity, raised = estimate(params.estimator, self.estimator, seen, self.restart)
        force = wall.render(params.wall, decoder.count, velocity)
        fault = decoder.illegal | decoder.overspeed
        self.output, limited = output.step(params.output, self.output, force, not fault)
        # A result is seen `latency` edges after the strobe, so its register is loaded at the edge before.
        self.loaded[now + d.estimator.latency - 1] = "velocity", velocity
        self.loaded[now + d.estimator.latency + d.wall.latency - 1] = "wall_force", force
        self.loaded[now + d.latency_to_drive - 1] = "drive", self.output.drive
        self.raised[now + d.estimator.latency] = raised << params.estimator_bit
        self.raised[now + d.latency_to_drive] = limited << params.output_bit

    def edge(self, a: int, b: int, z: int, given: dict[str, int]) -> None:
        """Advance by one clock edge, with the values that a frame gives to the axis at this edge, if any."""
        self.sum = self.sum % 2**self.drive_bits + self.magnitude
        self.pulse, self.sign = self.sum >> self.drive_bits, self.negative
        self.magnitude, self.negative = abs(self.drive), int(self.drive < 0)

        self.sticky = (0 if given.get("clear_flags") else self.sticky) | self._raised()
        inputs = quadrature.Inputs(a, b, z, self.words["encoder_glitch_clocks"], self.words["encoder_invert"])
        if self.strobe:
            if self.waiting:
                self.words, self.waiting = self.waiting, None
            self._sample()
            self.restart = 0
        strobes = quadrature.NO_STROBES
        if given:
            pulses = [given.get(name, 0) for name in ("preload", "preload_count", "index_arm", "clear_flags")]
            strobes = quadrature.Strobes(*pulses)
        self.decoder = quadrature.step(self.decoder_params, self.decoder, inputs, strobes)
        if self.clocks in self.loaded:
            setattr(self, *self.loaded.pop(self.clocks))
        if given.get("preload"):
            self.restart = 1
        if given.get("commit"):
            self.waiting = {name: given[name] for name in self.words}
        self.clocks += 1


class Host:
    """The world around the board: a serial host, a turning encoder, and the twin, compared at every edge."""

    def __init__(self, dut, name: str):
        self.dut, self.board, self.random = dut, make(name), rng()
        self.bench = Bench(dut, self.board)
        self.pulse, self.sign = self.bench.reader("drive_pdm"), self.bench.reader("drive_sign")
        self.twin = Twin(name)
        self.given = {}
        self.captured = {}
        self.phase, self.pins = 0, (0, 0, 0)
        self.rate = self.illegal_rate = 0.0
        self.pulses = []
        self.checked = True

    async def reset(self):
        await self.bench.reset()
        self.bench.drive(scan_select_n=1, drive_enable=1)
        # The reset is seen inside for as long as this; the first edge without it is the twin's first.
        for _ in range(SYNCHRONISER):
            await RisingEdge(self.dut.clk)

    def _turn(self) -> None:
        """Move the encoder at random by one edge, seldom by two at once."""
        if self.random.random() >= self.rate:
            return
        z = self.pins[2] ^ int(self.random.random() < 0.1)
        self.phase += 1 if self.random.random() < 0.6 else -1
        self.phase += int(self.random.random() < self.illegal_rate)
        a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[self.phase % 4]
        self.pins = a, b, z
        self.bench.drive(encoder_a=a, encoder_b=b, encoder_z=z)

    async def edges(self, count: int):
        """Let `count` clock edges pass on the board and on the twin."""
        edge = RisingEdge(self.dut.clk)
        for _ in range(count):
            await edge
            seen = self.pulse(), self.sign()
            assert not self.checked or seen == (self.twin.pulse, self.twin.sign), f"edge {self.twin.clocks}"
            self.pulses.append(seen)
            if self.twin.clocks in self.captured:
                self.captured[self.twin.clocks] = self.twin.telemetry()
            self.twin.edge(*self.pins, self.given.pop(self.twin.clocks, {}))
            self._turn()

    async def exchange(self, values: dict[str, int], bits: int | None = None, heard: bool = True, stuck: int = 0):
        """Send a frame, or its first `bits`, or zeros before it; return the answer and the expected telemetry.

        Bits set in `stuck` are sent as ones. The axis must get nothing unless `heard`, or if the frame is not whole.
        """
        frame = int.from_bytes(self.board.commands.encode(values), "big") | stuck
        length = self.board.frame_bits
        bits = length if bits is None else bits
        # The twin has seen `clocks` edges, so the next edge has that number. The first edge to act on a change is
        # number `clocks` + SYNCHRONISER; the register followed the telemetry up to the edge before.
        frozen = self.twin.clocks + SYNCHRONISER - 1
        self.captured[frozen] = None
        self.bench.drive(scan_select_n=0)
        await self.edges(HALF)
        answer = 0
        for bit in range(bits):
            self.bench.drive(scan_clock=0, scan_in=frame >> (max(length, bits) - 1 - bit) & 1)
            await self.edges(HALF)
            answer = answer << 1 | int(self.dut.scan_out.value)
            self.bench.drive(scan_clock=1)
            await self.edges(HALF)
        self.bench.drive(scan_clock=0)
        await self.edges(HALF)
        if heard and bits == length:
            # One edge sees the rise, and the pulses are there at the next.
            self.given[self.twin.clocks + SYNCHRONISER + 1] = values
        self.bench.drive(scan_select_n=1)
        await self.edges(HALF)
        expected = self.captured.pop(frozen)
        telemetry = self.board.telemetry.decode(answer.to_bytes(length // BYTE, "big")) if bits == length else None
        return telemetry, expected

    async def commit(self, **values: int):
        """Send words, with the others as after reset, and wait until they hold and have reached the pulses."""
        reset = {word.name: word.reset for word in self.twin.design.words}
        answer = await self.exchange({"commit": 1, "clear_flags": 1, **reset, **values})
        await self.edges(self.settling)
        return answer

    @property
    def settling(self) -> int:
        """Return the most clocks until a commit has taken effect on the pulses, including the wait for its sample."""
        axis = self.twin.spec
        return (axis.samples_per_actuation + 1) * axis.clocks_per_sample + self.board.latency + 4
