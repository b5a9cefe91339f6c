"""A board of several axes, a host on its line, and what its pins must be at every clock, by the model of the stage."""

from typing import NamedTuple

from amaranth.hdl import Cat, Module, Shape, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import Out
from cocotb.triggers import RisingEdge

from hardwall.hdl.axes.board import AxesBoard
from hardwall.hdl.axis.supervised import LOOPS
from hardwall.hdl.board.lead_out import lead_out
from hardwall.model.axes import register_file as banked_file
from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axes.capture import SAMPLED
from hardwall.model.axes.registers import BANK
from hardwall.model.axis.capture import RECORD_REGISTERS, TAKEN_AT
from hardwall.model.axis.registers import EDGE_STAMPS
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.drive import pdm
from hardwall.model.link.line import Verdict, framed
from hardwall.testing import Bench
from hardwall.testing.packing import Packing
from stimuli import frames
from stimuli.specs import NARROW

from .banked_server import BankedServer
from .on_a_line import BAUD, CLOCK_HZ, OnALine

QUARTERS = (0, 0), (1, 0), (1, 1), (0, 1)
"""The channels of an encoder at every fourth count."""
STEP = 30
"""Clocks for which a handle that turns stays at a count: longer than the largest filter, and than a rota."""

PATIENCE = 20_000
"""Clocks after which an answer is overdue."""
SHOWN = "magnitude", "negative", "drive_inverted", "alive"
"""What the axes inside give to stages and pins."""
PINS = "drive_pdm", "drive_sign", "alive", "outputs_enable"
"""What comes of it."""
SAMPLES = (
    "record_valid", "record_axis", "record_count", "record_velocity", "record_wall_force", "record_flags",
    "turn_valid", "turn_axis", "turn_state", "live",
)  # fmt: skip
"""What the axes inside show of samples and turns, of which the capture memory takes those of one axis."""
RECORDS = 16
"""Records of the capture memory."""


class Watched(wiring.Component):
    """A board with its pins, and in one word what its axes let out and what comes of it.

    Attributes:
        board: the board.
        shown: how `SHOWN`, and `PINS` behind `pin_`, lie in `showing`.
        sampled: how `SAMPLES` lie in `sampling`.
    """

    def __init__(self, axes: int):
        fields = {**NARROW, "clock_hz": CLOCK_HZ}
        spec = AxesSpec(**fields, axes=axes, estimator="fdm")
        self.board = board = AxesBoard(spec, BAUD, RECORD_REGISTERS * RECORDS)
        self._ports = {name: Value.cast(getattr(board.axes, name)) for name in SHOWN}
        self._ports |= {f"pin_{name}": getattr(board, name) for name in PINS}
        self.shown = Packing({name: Shape(len(port)) for name, port in self._ports.items()})
        self._samples = [getattr(board.axes, name) for name in SAMPLES]
        shapes = (Shape.cast(port.shape()) for port in self._samples)
        self.sampled = Packing(dict(zip(SAMPLES, shapes, strict=True)))
        inside = {"showing": Out(self.shown.width), "sampling": Out(self.sampled.width)}
        super().__init__({**self.board.signature.members, **inside})

    def elaborate(self, platform):
        m = Module()
        m.submodules.board = self.board
        m.d.comb += lead_out(self.board, self, self.board.signature.members)
        m.d.comb += [self.showing.eq(Cat(self._ports.values())), self.sampling.eq(Cat(self._samples))]
        return m


class Sample(NamedTuple):
    """A sample of an axis: the values of its record, those of its turn, and the number of the record's clock."""

    number: int
    count: int  # type: ignore[assignment]  # a tuple has a method of this name
    velocity: int
    wall_force: int
    flags: int
    driven: int = 0
    state: int = 0
    live: int = 0

    def registers(self) -> list[int]:
        """Return what the capture memory makes of it."""
        flags = self.state | (self.wall_force != 0) << 2 | self.live << 3 | self.flags << 4
        stamp = self.number + SAMPLED + TAKEN_AT["flags"] & 0xFFFF
        values = (self.count, self.velocity, self.driven)
        return [*(word >> shift & 0xFFFF for word in values for shift in (16, 0)), flags, stamp]


class Host(OnALine):
    """A host on the line, handles that it turns, and the pins of every axis, compared at every clock.

    Attributes:
        pulses: for every axis the clocks with a pulse so far.
        compared: the clocks at which pins were compared.
        server: the twin of the link.
        places: the counts of the handles.
        begun: the clock edge behind which the board has the number 0.
        turned: for every axis the clock edges behind which its last edges came to the pins, by the names of their
            stamps.
        samples: the samples of every axis since it was set to empty lists.
    """

    def __init__(self, dut, axes: int):
        self.places = [0] * axes
        self.turned: list[dict[str, int]] = [{} for _ in range(axes)]
        self._channels = [QUARTERS[0]] * axes
        self.component = Watched(axes)
        super().__init__(Bench(dut, self.component), PATIENCE)
        self.board = self.component.board
        self.registers = self.board.registers
        self.server = BankedServer(banked_file.Design(self.registers))
        self.samples: list[list[Sample]] | None = None
        self.loops, self.compared, self.pulses = dict.fromkeys(LOOPS, 1), 0, [0] * axes
        self._stage, self._states = pdm.Design(self.board.spec, pdm.USUAL), [pdm.START] * axes

    async def reset(self) -> None:
        await self._start(self.loops)
        self.begun = self.bench.clock_number()

    async def _follow(self) -> None:
        """Compare the pins at every clock edge with what the stages make of what the axes let out."""
        edge, width = RisingEdge(self.dut.clk), self._stage.magnitude.width
        mask, params, last, still = (1 << width) - 1, self._stage.params, -1, 0
        while True:
            await edge
            word = int(self.dut.showing.value)
            if self.samples is not None:
                self._sample(self.component.sampled.unpack(int(self.dut.sampling.value)), word)
            # Stages without a drive do nothing more once their last pulse is out.
            still = still + 1 if word == last else 0
            last = word
            if still > 2 and not word & self.component.shown.mask("magnitude"):
                self.compared += 1
                continue
            shown = self.component.shown.unpack(word)
            permitted = self.loops["drive_enable"] & self.loops["emergency_stop"]
            pins = [pdm.pins(self._stage, state, permitted) for state in self._states]
            wanted = {name: sum(pin[name] << axis for axis, pin in enumerate(pins)) for name in self._stage.pins}
            wanted |= {"alive": shown["alive"], "outputs_enable": 1}
            assert {name: shown[f"pin_{name}"] for name in PINS} == wanted, f"clock {self.compared}"
            signs = shown["negative"] ^ shown["drive_inverted"]
            for axis, state in enumerate(self._states):
                inputs = pdm.Inputs(shown["magnitude"] >> width * axis & mask, signs >> axis & 1)
                self._states[axis] = pdm.step(params, state, inputs)
                self.pulses[axis] += shown["pin_drive_pdm"] >> axis & 1
            self.compared += 1

    def _sample(self, shown: dict[str, int], word: int) -> None:
        """Take the record of a sample, or complete that of an axis by its turn."""
        if shown["record_valid"]:
            # What is seen at an edge is of the clock before it.
            number = self.bench.clock_number() - self.begun - 1
            words = {name: shown[f"record_{name}"] for name in ("count", "velocity", "wall_force", "flags")}
            self.samples[shown["record_axis"]].append(Sample(number, **words))
        of_axis = self.samples[shown["turn_axis"]]
        if shown["turn_valid"] and of_axis:
            doors, width = self.component.shown.unpack(word), self._stage.magnitude.width
            magnitude = doors["magnitude"] >> width * shown["turn_axis"] & (1 << width) - 1
            driven = -magnitude if doors["negative"] >> shown["turn_axis"] & 1 else magnitude
            of_axis[-1] = of_axis[-1]._replace(driven=driven, state=shown["turn_state"], live=shown["live"])

    def change(self, **loops: int) -> None:
        """Open or close loops."""
        self.loops |= loops
        self.bench.drive(**loops)

    async def turn(self, *places: int, index: int = 0) -> None:
        """Turn the handles to counts; there, the axes with a bit in `index` see their index.

        Upwards Z rises there; downwards it falls. Such an axis goes a count further, which finds the index, and back.
        """
        ways = [(to > at) - (to < at) for at, to in zip(self.places, places, strict=True)]
        downwards = sum((way < 0) << axis for axis, way in enumerate(ways)) & index
        while self.places != [*places]:
            self.places = [at + (to > at) - (to < at) for at, to in zip(self.places, places, strict=True)]
            await self._show(downwards)
        if index:
            await self._show(index)
            self.places = [
                at + way * (index >> axis & 1) for axis, (at, way) in enumerate(zip(places, ways, strict=True))
            ]
            await self._show(index & ~downwards)
            await self._show(0)
            self.places = [*places]
        await self._show(0)

    async def _show(self, index: int, jumping: int = 0) -> None:
        """Show for a while where the handles are, the axes with a bit in `jumping` half a cycle further."""
        quarters = [QUARTERS[(at + 2 * (jumping >> axis & 1)) % 4] for axis, at in enumerate(self.places)]
        channels = [sum(quarter[k] << axis for axis, quarter in enumerate(quarters)) for k in (0, 1)]
        for turned, before, now in zip(self.turned, self._channels, quarters, strict=True):
            # Edges of both channels at once are illegal, and have no stamps.
            if (before[0] != now[0]) != (before[1] != now[1]):
                rises, of_b = now > before, before[1] != now[1]
                turned[EDGE_STAMPS[of_b + 2 * (not rises)]] = self.bench.clock_number()
        self._channels = quarters
        self.bench.drive(encoder_a=channels[0], encoder_b=channels[1], encoder_z=index)
        await self.edges(STEP)

    async def jump(self, *pairs: int) -> None:
        """Let both channels of encoders change at once, twice, so many times for each."""
        for k in range(max(pairs)):
            await self._show(0, sum((k < pair) << axis for axis, pair in enumerate(pairs)))
            await self._show(0)

    async def pulsing(self, clocks: int) -> list[bool]:
        """Return for every axis whether there are pulses in the next clocks."""
        before = list(self.pulses)
        await self.edges(clocks)
        return [now > then for now, then in zip(self.pulses, before, strict=True)]

    async def request(self, pdu: bytes, shows: bool = False) -> bytes:
        """Return the answer without unit and CRC; it must be the twin's, unless it `shows` status."""
        frame = await self._send(pdu)
        answer = await self._answer(frame)
        expected = framed(self.server.take(Verdict.REQUEST, frame))
        assert len(answer) == len(expected) if shows else answer == expected
        return answer[1:-2]

    async def look(self, axis: int, first: str = "drive", last: str = "driven") -> dict[str, int]:
        """Return the status of an axis, from one register to another, and let the twin refuse what the board does."""
        begin, end = self.registers[first].address, self.registers[last].address + 2
        data = (await self.request(frames.read(BANK * axis + begin, end - begin), shows=True))[2:]
        cells = [int.from_bytes(data[k : k + 2], "big") for k in range(0, len(data), 2)]
        read = [r for r in self.registers.status if begin <= r.address < end]
        status = {r.name: r.from_registers(tuple(cells[r.address - begin : r.address - begin + 2])) for r in read}
        if {"ready", "state"} <= set(status):
            refused = dict.fromkeys(("preload", "origin_shift"), status["state"] == ARMED)
            refused |= {"arm": not status["ready"]}
            self.server.file.refused_of[axis] = frozenset(name for name, is_so in refused.items() if is_so)
        return status

    async def write(self, axis: int, **values: int) -> bytes:
        """Write words of an axis that lie side by side, or `commit` and the first words, in one frame."""
        chosen = sorted((r for r in self.registers.registers if r.name in values), key=lambda r: r.address)
        cells = [half for register in chosen for half in register.to_registers(values[register.name])]
        assert chosen[-1].address + chosen[-1].size - chosen[0].address == len(cells), "not side by side"
        return await self.request(frames.write(BANK * axis + chosen[0].address, cells))
