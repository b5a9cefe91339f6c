"""The board top: pins, frames and pulses against the models of decoder and axis, clock for clock."""

import math

import cocotb
import pytest
from cocotb.triggers import RisingEdge, Timer

from hardwall.hdl.board import PULSES, TELEMETRY, Board
from hardwall.hdl.frame import BYTE
from hardwall.model import output, quadrature, wall
from hardwall.model.estimators.estimate import estimate
from hardwall.testing import SAMPLES, Bench, parameters, rng, simulate
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
        return self.clocks % self.spec.clocks_per_sample == self.spec.clocks_per_sample - 1

    def _raised(self) -> int:
        """Return the flags that rise with the next edge; the pin already shows them."""
        encoder = self.decoder.illegal | self.decoder.overspeed << 1
        return self.raised.get(self.clocks, 0) | (encoder if self.strobe else 0)

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
        bits = self.spec.force.width - 2
        self.sum = self.sum % 2**bits + self.magnitude
        self.pulse, self.sign = self.sum >> bits, self.negative
        self.magnitude, self.negative = abs(self.drive), int(self.drive < 0)

        self.sticky = (0 if given.get("clear_flags") else self.sticky) | self._raised()
        inputs = quadrature.Inputs(a, b, z, self.words["encoder_glitch_clocks"], self.words["encoder_invert"])
        if self.strobe:
            if self.waiting:
                self.words, self.waiting = self.waiting, None
            self._sample()
            self.restart = 0
        pulses = [given.get(name, 0) for name in ("preload", "preload_count", "index_arm", "clear_flags")]
        self.decoder = quadrature.step(self.decoder_params, self.decoder, inputs, quadrature.Strobes(*pulses))
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
        for _ in range(count):
            await RisingEdge(self.dut.clk)
            seen = int(self.dut.drive_pdm.value), int(self.dut.drive_sign.value)
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


def random_frame(host: Host) -> dict[str, int]:
    """Return a frame that mostly commits, with words of every size and a wall near the handle."""
    random, axis = host.random, host.twin.spec
    half = 1 << (axis.count_width - 1)

    def near(count):
        return int((count + random.integers(-half, half) * 2.0 ** -random.integers(0, 20) + half) % (2 * half)) - half

    count = host.twin.decoder.count
    frame = {name: int(random.random() < p) for name, p in zip(PULSES, (0.9, 0.7, 0.2, 0.5), strict=True)}
    frame["preload_count"] = near(half if random.random() < 0.5 else 0)
    for word in axis.design.words:
        frame[word.name] = int((word.format.max + 1) * random.random() * 2.0 ** -random.integers(0, word.format.width))
    frame["encoder_glitch_clocks"] = int(random.choice((0, 1, 2, 15)))
    frame["wall_position"] = near(frame["preload_count"] if frame["preload"] else count)
    frame["output_force_limit"] |= 1 << (axis.force.width - 3)
    return frame


@cocotb.test()
async def random_frames_reach_the_axis_and_telemetry_comes_back(dut):
    host = Host(dut, **parameters())
    await host.reset()
    read = []
    # Fewer frames do not reach every case.
    while host.twin.clocks < max(2 * SAMPLES, 200_000):
        host.rate = float(host.random.choice((0.0, 0.02, 0.3, 1.0), p=(0.1, 0.4, 0.4, 0.1)))
        host.illegal_rate = float(host.random.choice((0.0, 0.01)))
        answer, expected = await host.exchange(random_frame(host))
        assert answer == expected, {n: (v, expected[n]) for n, v in answer.items() if v != expected[n]}
        read.append(answer)
        # The shortest pause, exact to the edge: the register is free again when the words have been taken.
        await host.edges(host.twin.spec.clocks_per_sample + SYNCHRONISER + 1)
        if host.random.random() < 0.5:
            await host.edges(host.settling)
    # The campaign must reach every case.
    assert len({row["drive"] for row in read}) > 3
    assert {bool(row["illegal_count"]) for row in read} == {False, True}
    assert {row["index_latched"] for row in read} == {0, 1}
    assert any(row["drive"] > 0 for row in read)
    assert any(row["drive"] < 0 for row in read)
    assert not all(row["flags"] & 3 for row in read)


@cocotb.test()
async def anything_but_a_whole_frame_only_reads(dut):
    host = Host(dut, **parameters())
    await host.reset()
    host.rate = 0.02
    length = host.board.frame_bits
    wraps = 1 << (length + 1).bit_length()
    for bits in (0, 1, length - 1, length + 1, 2 * length, wraps + length, length):
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, bits=bits)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected, f"after {bits} bits"
    # The last bit reveals a line that is stuck high.
    for stuck in (1, (1 << length) - 1):
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, heard=False, stuck=stuck)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected


@cocotb.test()
async def while_a_commit_waits_the_port_is_deaf(dut):
    host = Host(dut, **parameters())
    await host.reset()
    host.rate = 0.3
    for bits in (None, 0, None, 1, None):
        await host.edges(int(host.random.integers(0, host.twin.spec.clocks_per_sample)))
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1})
        await host.exchange(random_frame(host) | {"commit": 1, "preload": 1}, bits=bits, heard=False)
        await host.edges(host.settling)
        answer, expected = await host.exchange({})
        assert answer == expected


@cocotb.test()
async def the_density_of_pulses_is_the_drive(dut):
    host = Host(dut, **parameters())
    await host.reset()
    axis = host.twin.spec
    top, full = axis.force_limit_word, 2**host.board.drive_bits
    fields = host.board.commands.fields
    half = 1 << (fields["wall_position"].width - 1)
    stiffest = 2 ** fields["wall_stiffness"].width - 1
    # The force limit sets the magnitude, because the wall pushes with its largest force.
    drives = range(-top, top + 1) if top < 100 else (-top, full // math.pi // 1)
    for drive in map(int, drives):
        await host.commit(
            wall_stiffness=stiffest, wall_position=(half - 1) * (1 if drive > 0 else -1), wall_left=int(drive > 0),
            output_force_limit=abs(drive),
        )  # fmt: skip
        answer, _ = await host.exchange({})
        assert answer["drive"] == drive
        host.pulses.clear()
        await host.edges(full)
        assert sum(pulse for pulse, _ in host.pulses) == abs(drive)
        assert {sign for _, sign in host.pulses} == {int(drive < 0)}


@cocotb.test()
async def enable_low_is_no_drive(dut):
    host = Host(dut, **parameters())
    await host.reset()
    fields, top = host.board.commands.fields, host.twin.spec.force_limit_word
    largest = {
        "wall_stiffness": (1 << fields["wall_stiffness"].width) - 1,
        "wall_position": 1 - (1 << (fields["wall_position"].width - 1)),
        "output_force_limit": top,
    }
    await host.commit(**largest)
    host.checked = False
    for late in range(4):
        answer, _ = await host.exchange({})
        assert answer["drive"] == -top
        await host.edges(host.settling)
        while not int(dut.drive_pdm.value):
            await host.edges(1)
        # The pin falls between two edges, and the pulse with it.
        host.bench.drive(drive_enable=0)
        await Timer(1, "ns")
        assert int(dut.drive_pdm.value) == 0
        host.pulses.clear()
        await host.edges(late)
        answer, _ = await host.exchange({})
        # The telemetry is captured this many edges after the fall of the pin.
        assert (answer["drive"] == 0) == (late + SYNCHRONISER > host.board.enable_latency)
        assert (1, 0) not in host.pulses
        assert (1, 1) not in host.pulses
        host.bench.drive(drive_enable=1)
        await host.edges(host.settling)


@pytest.mark.parametrize("name", ["paper", "mhz", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_frames_are_lists_of_whole_fields():
    board = make("mhz")
    assert board.frame_bits % BYTE == 0
    assert list(board.commands.fields) == [
        *PULSES,
        "preload_count",
        *(word.name for word in board.spec.design.words),
    ]
    frame = board.commands.encode({"commit": 1, "preload_count": -1})
    width = board.commands.fields["preload_count"].width
    assert int.from_bytes(frame, "big") >> (board.frame_bits - 4 - width) == 0b1000 << width | (1 << width) - 1
    width = board.telemetry.fields["drive"].width
    answer = (1 << width) - 5 << (board.frame_bits - width)
    assert board.telemetry.decode(answer.to_bytes(board.frame_bits // BYTE, "big")) == {
        name: -5 if name == "drive" else 0 for name in TELEMETRY
    }


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"comit": 1}, r"^name must be one of commit, .*, not 'comit'$"),
        ({"commit": 2}, r"^commit must be 0 to 1, not 2$"),
        ({"wall_position": 1 << 20}, r"^wall_position must be -1048576 to 1048575, not 1048576$"),
        ({"wall_damping": -1}, r"^wall_damping must be 0 to 65535, not -1$"),
    ],
)
def test_frames_that_cannot_be_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        make("mhz").commands.encode(values)


def test_an_answer_of_the_wrong_length_is_refused():
    board = make("mhz")
    with pytest.raises(ValueError, match=rf"^frame must have {board.frame_bits // BYTE} bytes, not 3$"):
        board.telemetry.decode(b"abc")


def test_wrong_spec_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Board(3)
