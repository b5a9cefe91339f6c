"""Test-bench parts for Amaranth components under cocotb on Verilator.

Two halves, one file, because a test file is read twice. Under pytest, `simulate` generates the Verilog of a component,
builds it once (cached by content) and runs the file's cocotb tests inside the simulator. There, `Bench` clocks and
resets the component, monitors record what its pins really carried, and `check` holds that against the model with `==`.
Reading a signal takes cocotb longer than a clock takes Verilator, so all pins are also in one word: `Observed`.

Seeds: every run uses `HARDWALL_SEED` (default 1), logged by cocotb; `HARDWALL_SAMPLES` scales the random campaigns.
"""

import json
import os
from collections.abc import Callable, Iterable
from pathlib import Path

import cocotb
import numpy as np
from amaranth.hdl import Cat, Module, Shape, Value
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Member, Out
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.sim.rtl import cocotb_runner

SEED = int(os.environ.get("HARDWALL_SEED", "1"))
SAMPLES = int(os.environ.get("HARDWALL_SAMPLES", "100000"))
PERIOD_NS = 10
CAMPAIGN = {"timeout_time": SAMPLES + 20_000, "timeout_unit": "us"}
"""For `cocotb.test` of a campaign: hardware that stops answering fails, instead of hanging, at 100 clocks a sample."""


def simulate(test_file: str, make: Callable, *, checks: str | None = None, **parameters) -> None:
    """Run the cocotb tests of `test_file` on the Verilog of `make(**parameters)`; fail if any fails or none runs.

    `parameters` must be JSON values: they reach the simulator's process in the environment, where `parameters()`
    returns them. `checks` is a regular expression of the names to run (default: all of the file).
    """
    file, component = Path(test_file), make(**parameters)
    name = type(component).__module__.rsplit(".", 1)[-1]
    environ = {"HARDWALL_PARAMETERS": json.dumps(parameters)}
    cocotb_runner.simulate(Observed(component), name, file.stem, file.parent, environ, SEED, checks)


def parameters() -> dict:
    """Return, inside the simulator, the parameters that `simulate` was called with."""
    return json.loads(os.environ["HARDWALL_PARAMETERS"])


def rng() -> np.random.Generator:
    """Return a generator seeded from `HARDWALL_SEED`."""
    return np.random.default_rng(SEED)


class Packing:
    """How signals lie side by side in one word, the first in its lowest bits; their shapes by name, as `shapes`."""

    def __init__(self, shapes: dict[str, Shape]):
        self.shapes = shapes
        self.width = sum(shape.width for shape in shapes.values())
        self._offsets = dict(zip(shapes, np.cumsum([0, *(shape.width for shape in shapes.values())]), strict=False))

    def pack(self, values: dict[str, int]) -> int:
        """Return the word of values by name; a negative one is taken modulo its width, those left out are 0."""
        return sum(
            (int(value) & ((1 << self.shapes[name].width) - 1)) << int(self._offsets[name])
            for name, value in values.items()
        )

    def column(self, name: str, words: list[int]) -> list[int]:
        """Return one signal of many words."""
        offset, shape = int(self._offsets[name]), self.shapes[name]
        mask, sign = (1 << shape.width) - 1, (1 << shape.width - 1) * shape.signed
        return [((word >> offset & mask) ^ sign) - sign for word in words]


class Observed(wiring.Component):
    """A component's ports, and one more that carries them all: `observed`, packed as `packing_of` says."""

    def __init__(self, component: wiring.Component):
        self.component = component
        ports = {name: member for name, (member, _) in ports_of(component).items()}
        super().__init__({**ports, "observed": Out(packing_of(component).width)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.component = self.component
        ports = ports_of(self.component)
        for name, (member, inside) in ports.items():
            outside = getattr(self, name)
            m.d.comb += inside.eq(outside) if member.flow == In else outside.eq(inside)
        m.d.comb += self.observed.eq(Cat(inside for _, inside in ports.values()))
        return m


def ports_of(component: wiring.Component) -> dict[str, tuple[Member, Value]]:
    """Return the ports of a component by their names in Verilog: member `b` of its member `a` is `a__b`."""
    return {"__".join(path): (member, port) for path, member, port in component.signature.flatten(component)}


def packing_of(component: wiring.Component) -> Packing:
    """Return how `Observed` packs the ports of a component."""
    return Packing({name: Shape.cast(member.shape) for name, (member, _) in ports_of(component).items()})


class Record:
    """What signals carried at some clocks.

    Attributes: `names` of the signals; `clocks`, the clock number of each record.
    """

    def __init__(self, names: tuple[str, ...], packing: Packing, words: list[int], clocks: list[int]):
        self.names, self.clocks = names, clocks
        self._packing, self._words = packing, words

    def add(self, clock: int, word: int) -> None:
        """Add what was seen at a clock edge, packed."""
        self.clocks.append(clock)
        self._words.append(word)

    @property
    def rows(self) -> list[tuple[int, ...]]:
        """The signals in the order of `names`, record by record."""
        return list(zip(*(self._packing.column(name, self._words) for name in self.names), strict=True))

    def column(self, name: str) -> np.ndarray:
        """Return one recorded signal as int64."""
        return np.array(self._packing.column(name, self._words), np.int64)


class Monitor(Record):
    """Records at every clock edge at which `strobe` is high, as the component itself sees its pins there."""

    def __init__(self, bench: "Bench", strobe: str, names: tuple[str, ...]):
        super().__init__(names, bench.packing, [], [])
        self._bench = bench
        self._strobe = getattr(bench.dut, strobe)
        cocotb.start_soon(self._record())

    async def _record(self):
        clock, observed = RisingEdge(self._bench.dut.clk), self._bench.dut.observed
        while True:
            if not int(self._strobe.value):
                await RisingEdge(self._strobe)
            await clock
            if int(self._strobe.value):
                self.add(self._bench.clock_number(), int(observed.value))


class Bench:
    """A clocked, reset component under test. Signedness, lost in Verilog, is taken from the component's members."""

    period_ns = PERIOD_NS

    def __init__(self, dut, component):
        self.dut, self.packing = dut, packing_of(component)
        ports = ports_of(component)
        self._signed = {name: shape.signed for name, shape in self.packing.shapes.items()}
        self._inputs = [name for name, (port, _) in ports.items() if port.flow == In and name not in ("clk", "rst")]

    async def reset(self):
        """Start the clock, zero every input and hold reset for two clocks."""
        if not hasattr(self, "_clock"):
            self._clock = Clock(self.dut.clk, PERIOD_NS, "ns")
            self._clock.start()
        self.drive(**dict.fromkeys(self._inputs, 0))
        self.dut.rst.value = 1
        await ClockCycles(self.dut.clk, 2)
        self.dut.rst.value = 0

    def clock_number(self) -> int:
        return round(get_sim_time("ns")) // PERIOD_NS

    def reader(self, name: str) -> Callable[[], int]:
        """Return a function that reads a signal as the integer it stands for."""
        handle = getattr(self.dut, name)
        signed = self._signed[name]

        def read() -> int:
            return handle.value.to_signed() if signed else int(handle.value)

        return read

    def drive(self, **values: int) -> None:
        """Set inputs. A negative value is taken modulo the width, as two's complement."""
        for name, value in values.items():
            handle = getattr(self.dut, name)
            handle.value = int(value) & ((1 << len(handle)) - 1)

    def monitor(self, strobe: str, *names: str) -> Monitor:
        return Monitor(self, strobe, names)

    async def transact(self, strobe: str, done: str, idle: bool = True, **values: int) -> None:
        """Drive `values` with a one-clock `strobe` and wait for `done`; with `idle`, until the clock after it."""
        self.drive(**values, **{strobe: 1})
        await RisingEdge(self.dut.clk)
        self.drive(**{strobe: 0})
        await RisingEdge(getattr(self.dut, done))
        if idle:
            await RisingEdge(self.dut.clk)

    async def campaign(
        self, strobe: str, done: str, inputs: tuple[str, ...], outputs: tuple[str, ...], rows: Iterable[tuple[int, ...]]
    ) -> tuple[Record, Record]:
        """Put `rows` of `inputs` through, the next strobe with the last one's end or a clock later, at random.

        Returns what the pins carried at each strobe and at each end. Fewer turns of cocotb than `transact` between two
        monitors: they are most of what a long campaign takes.
        """
        clock, end = RisingEdge(self.dut.clk), RisingEdge(getattr(self.dut, done))
        start, observed, coin = getattr(self.dut, strobe), self.dut.observed, rng()
        taken, given = Record(inputs, self.packing, [], []), Record(outputs, self.packing, [], [])
        held: tuple[int | None, ...] = (None,) * len(inputs)
        ends, waiting = 0, False

        async def count_ends():
            nonlocal ends
            while True:
                await end
                ends += 1

        async def look() -> tuple[int, int]:
            """Return the clock and what the component sees and shows at its next edge."""
            await clock
            return self.clock_number(), int(observed.value)

        counting = cocotb.start_soon(count_ends())
        for row in rows:
            # A port that keeps its value need not be written again: most run-time words change seldom.
            self.drive(**{name: new for name, new, old in zip(inputs, row, held, strict=True) if new != old})
            start.value, held = 1, row
            seen = await look()
            taken.add(*seen)
            (still,) = self.packing.column(done, [seen[1]])
            assert still == waiting, f"{done} is {still} at the strobe after {len(given.clocks)} ends"
            if waiting:
                given.add(*seen)
            start.value = 0
            await end
            waiting = coin.random() < 0.5
            if not waiting:
                given.add(*await look())
        if waiting:
            given.add(*await look())
        await self.rest()
        counting.cancel()
        assert ends == len(given.clocks), f"{len(given.clocks)} strobes but {ends} ends"
        return taken, given

    async def rest(self) -> None:
        """Let the monitors see what the last transaction brought."""
        await ClockCycles(self.dut.clk, 2)


def check(inputs: Record, outputs: Record, expected: dict[str, np.ndarray], latency: int | None = None) -> None:
    """Hold every recorded output against the model's, exactly; fail on a lost, an extra or no output at all.

    `expected` maps the names of `outputs` to what the model made of `inputs`. With `latency`, every output must also
    come that many clocks after its input.
    """
    assert len(outputs.clocks) > 0, "nothing was compared"
    assert len(inputs.clocks) == len(outputs.clocks), f"{len(inputs.clocks)} inputs but {len(outputs.clocks)} outputs"
    assert set(expected) == set(outputs.names), "the model and the monitor name different outputs"
    for name, values in expected.items():
        seen = outputs.column(name)
        wrong = np.flatnonzero(seen != np.asarray(values))
        if len(wrong):
            first = wrong[0]
            raise AssertionError(
                f"{name} differs at {len(wrong)} of {len(seen)} samples, first at {first}: RTL {seen[first]}, "
                f"model {np.asarray(values)[first]}, inputs {dict(zip(inputs.names, inputs.rows[first], strict=True))}"
            )
    if latency is not None:
        taken = np.array(outputs.clocks) - np.array(inputs.clocks)
        assert (taken == latency).all(), f"latency {sorted(set(taken.tolist()))} clocks, promised {latency}"
