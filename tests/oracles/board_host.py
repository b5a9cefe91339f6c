"""A host that talks to the board under test, a turning encoder and loops, and the twin, compared at every edge."""

from collections import deque
from operator import itemgetter

from cocotb.triggers import RisingEdge

from hardwall.hdl.axis.board import ENCODER
from hardwall.hdl.axis.register_file import RegisterFile
from hardwall.hdl.axis.supervised import LOOPS
from hardwall.model.axis import register_file
from hardwall.model.axis.capture import DONE
from hardwall.model.link import server
from hardwall.model.link.line import Verdict, framed
from hardwall.model.register import Kind
from hardwall.testing import Bench, rng
from stimuli import frames

from .board import AT_PIN, IDLE, Twin, make
from .on_a_line import OnALine

COUNT_CLOCKS = 20
"""Clocks from one edge of a turning encoder to the next."""
PATIENCE = 60_000
"""Clocks after which an answer is overdue."""


def unlike(found: dict[str, int], wanted: dict[str, int]) -> str:
    """Return where the board and the twin differ, in words."""
    different = [name for name, value in found.items() if value != wanted[name]]
    return ", ".join(f"{name} of the board is {found[name]}, of the twin {wanted[name]}" for name in different)


class Host(OnALine):
    """The world around the board: a host on the line, a turning encoder, loops, and the twin, compared at every edge.

    Attributes:
        rate, illegal_rate: probabilities, a clock, of an edge and of an illegal one.
        open_rate: the probability, a clock, that a loop opens.
        pulses: the levels of the drive's pins at every edge.
        history: what the twin showed at the last edges, by stamp.
        refused: exceptions that were answered.
        shifted: what the link asked for at every pulse that words belong to.
        pulsed: the pulses that the link gave since the last request.
    """

    def __init__(self, dut, name: str, estimator: str, stage: str = "pdm"):
        self.component = make(name, estimator, stage)
        super().__init__(Bench(dut, self.component), PATIENCE)
        self.board, self.random = self.component.board, rng()
        self.registers, self.twin = self.board.registers, Twin(self.board)
        self.pins = {name: int(name in IDLE) for name in (*ENCODER, *LOOPS)}
        self.phase, self.rate, self.illegal_rate, self.open_rate = 0, 0.0, 0.0, 0.0
        self.pulses: list[tuple[int, ...]] = []
        self.history: deque[tuple[int, tuple]] = deque(maxlen=PATIENCE)
        self.server = server.Server(register_file.Design(self.registers))
        self.place = {register.name: register.address for register in self.registers.registers}
        self.refused: list[int] = []
        self.taken_clocks = RegisterFile(self.server.file.design).taken_clocks
        self.shifted: list[dict[str, int]] = []
        self.pulsed: list[str] = []

    async def reset(self) -> None:
        await self._start(self.pins)

    def _turn(self) -> None:
        """Move the encoder at random by one edge, seldom by two at once, and open or close a loop."""
        random, moved = self.random, {}
        chance = random.random(2)
        if chance[0] < self.rate:
            # The handle wanders about its origin, for an axis of a few counts is nowhere else within its range.
            self.phase += 1 if random.random() < (0.3 if self.phase > 0 else 0.7) else -1
            self.phase += int(random.random() < self.illegal_rate)
            moved = {**self._channels(), "encoder_z": self.pins["encoder_z"] ^ int(random.random() < 0.1)}
        if chance[1] < self.open_rate:
            name = LOOPS[int(random.integers(0, len(LOOPS)))]
            moved[name] = self.pins[name] ^ 1
        self.change(**moved)

    def _channels(self) -> dict[str, int]:
        """Return the levels of the encoder's channels where the handle is."""
        a, b = ((0, 0), (1, 0), (1, 1), (0, 1))[self.phase % 4]
        return {"encoder_a": a, "encoder_b": b, "encoder_a_n": 1 - a, "encoder_b_n": 1 - b}

    async def turn(self, counts: int) -> None:
        """Turn the handle by counts, as slowly as a decoder follows whose filter is as it is after a reset."""
        for _ in range(abs(counts)):
            self.phase += 1 if counts > 0 else -1
            self.change(**self._channels())
            await self.edges(COUNT_CLOCKS)

    def change(self, **pins: int) -> None:
        """Set pins, on the board and on the twin."""
        if pins:
            self.pins |= pins
            self.bench.drive(**pins)

    async def _follow(self) -> None:
        """Let the twin see every clock edge, and compare it with the board."""
        edge, asking, showing = RisingEdge(self.dut.clk), self.dut.asking, self.dut.showing
        drive = itemgetter(*(AT_PIN + name for name in self.board.spec.drive.pins))
        component, twin, last, asked = self.component, self.twin, -1, {}
        pulses = [pulse.name for pulse in self.registers.pulses]
        while True:
            await edge
            word = int(asking.value)
            if word != last:
                asked, last = component.asked.unpack(word), word
            found = component.shown.unpack(int(showing.value))
            gate = self.pins["drive_enable"] & self.pins["emergency_stop"]
            wanted = twin.outputs() | twin.follower.wanted() | twin.pins(gate)
            # The difference is made only to be told: most clocks have none.
            assert found.items() <= wanted.items(), f"edge {twin.clocks}: {unlike(found, wanted)}"
            self.pulses.append(drive(found))
            self.history.append((twin.decoder.stamp, twin.shown()))
            self.pulsed += [name for name in pulses if asked[name]]
            if any(asked[name] for name in register_file.WITH_WORDS):
                self.shifted.append(asked)
            twin.edge(self.pins, asked, found)
            self._turn()

    def shown(self) -> dict[str, int]:
        """Return what the axis inside shows now."""
        return self.component.shown.unpack(int(self.dut.showing.value))

    @property
    def settling(self) -> int:
        """The most clocks until a commit or an arm has taken effect on the pulses, with the steepest ramp."""
        axis = self.twin.spec
        return (axis.samples_per_actuation + 2) * axis.clocks_per_sample + self.board.latency + 4

    async def request(self, pdu: bytes) -> bytes:
        """Return the answer to a request without unit and CRC; it must be the twin's, and the words of the link too."""
        frame, begun = await self._send(pdu), len(self.pulses)
        answer = await self._answer(frame)
        await self.edges(1)
        shown = [each for _, each in list(self.history)[begun - len(self.pulses) :]]
        states = [each[2] for each in shown]
        expected = []
        # What is refused depends on the state while the frame is checked, which may change on the way.
        for ready, armed in sorted({(state["ready"], state["state"] == 1) for state in states}):
            expected.append(frozenset(("arm",) * (not ready) + ("preload", "origin_shift") * armed))
        self.server.file.refusing = self._refusing(answer, expected)
        # A capture may be done on the way, and is then until a host starts the next.
        done = {state[3].capture_state == DONE for state in shown}
        self.server.file.capture = self.twin.window() if max(done) and (min(done) or answer[1] == 3) else None
        self.server.file.status = self._snapshot(pdu, answer)
        self.server.file.pulses = ()
        assert answer == framed(self.server.take(Verdict.REQUEST, frame))
        if answer[1] & 0x80:
            self.refused.append(answer[2])
        file, found = self.server.file, self.component.asked.unpack(int(self.dut.asking.value))
        assert {word.name: found[word.name] for word in self.registers.live}.items() <= file.active.items()
        assert sorted(self.pulsed) == sorted(file.pulses)
        self.pulsed.clear()
        shifted = {*register_file.WITH_WORDS} & set(file.pulses)
        assert [{name: each[name] for name in file.active} for each in self.shifted] == [file.active] * bool(shifted)
        self.shifted.clear()
        return answer[1:-2]

    @staticmethod
    def _refusing(answer: bytes, possible: list[frozenset[str]]) -> frozenset[str]:
        """Return what the board refused, if its state changed meanwhile: more, if it answered that it refused."""
        return max(possible, key=len) if answer[1:3] == bytes([0x90, server.FAILURE]) else min(possible, key=len)

    def _snapshot(self, pdu: bytes, answer: bytes) -> dict[str, int]:
        """Return the status that the board must have shown when it took each, from when it took its own stamp."""
        first, size = self.place["stamp"] - int.from_bytes(pdu[1:3], "big"), 4
        if pdu[0] != 3 or answer[1] != 3 or not 0 <= first <= answer[2] // 2 - 2:
            return {status.name: 0 for status in self.registers.status}
        stamp = int.from_bytes(answer[3 + 2 * first : 3 + 2 * first + size], "big")
        (at,) = [at for at, (known, _) in enumerate(self.history) if known == stamp]
        shown = {clock: self.twin.status(self.history[at + clock - self.taken_clocks["stamp"]][1])
                 for clock in set(self.taken_clocks.values())}  # fmt: skip
        return {name: shown[clock][name] for name, clock in self.taken_clocks.items()}

    async def look(self, first: str = "drive", last: str = "driven") -> dict[str, int]:
        """Return the status from one register to another, as read from the board in one frame."""
        begin, end = self.place[first], self.place[last] + 2
        data = (await self.request(frames.read(begin, end - begin)))[2:]
        cells = [int.from_bytes(data[k : k + 2], "big") for k in range(0, len(data), 2)]
        read = [r for r in self.registers.status if begin <= r.address < end]
        return {r.name: r.from_registers(tuple(cells[r.address - begin : r.address - begin + 2])) for r in read}

    async def write(self, **values: int) -> bytes:
        """Write words that lie side by side, or pulses up to `commit` and the words behind it, in one frame."""
        chosen = sorted((r for r in self.registers.registers if r.name in values), key=lambda r: r.address)
        assert len(chosen) == len(values)
        first, last = chosen[0], chosen[-1]
        cells = []
        for register in self.registers.registers:
            if first.address <= register.address <= last.address:
                given = values.get(register.name)
                if given is None:
                    given = 0 if register.kind is Kind.PULSE else self.server.file.active[register.name]
                cells += register.to_registers(given)
        return await self.request(frames.write(first.address, cells))

    async def arm(self) -> None:
        """Beat, acknowledge what is latched, and arm."""
        await self.write(heartbeat=self.server.file.active["heartbeat"] + 1 & 0xFFFF)
        if latched := self.shown()["latched"]:
            await self.write(acknowledged=latched)
            await self.write(acknowledge=1, clear_flags=1)
        await self.write(arm=1)
