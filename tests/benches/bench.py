"""A component under test, inside the simulator: clocked, reset, driven, watched and put through campaigns."""

from collections.abc import Callable, Iterable
from typing import Any

import cocotb
from amaranth.lib import wiring
from cocotb.clock import Clock
from cocotb.handle import HierarchyObject
from cocotb.simtime import get_sim_time
from cocotb.triggers import ClockCycles, First, RisingEdge, Timer

from .campaign import Campaign
from .harness import RESERVED, inputs_of, packing_of
from .packing import Rows

PERIOD_NS = 10
PATIENCE = 10_000
"""Clocks after which the bench stops waiting for an answer."""


class Monitor(Rows):
    """The values of the ports at every clock edge where `strobe` is high, as the component itself sees them there.

    During a campaign the sequencer sees those edges, and the campaign adds them.
    """

    def __init__(self, bench: "Bench", strobe: str, names: tuple[str, ...]):
        super().__init__(names, bench.packing, [], [])
        self.strobe = strobe
        self._bench = bench
        self._strobe = getattr(bench.dut, strobe)
        cocotb.start_soon(self._record())

    async def _record(self) -> None:
        clock, seen = RisingEdge(self._bench.dut.clk), self._bench.dut.bench_seen
        while True:
            if not int(self._strobe.value):
                await RisingEdge(self._strobe)
            await clock
            if int(self._strobe.value) and not self._bench.in_campaign:
                self.add(self._bench.clock_number(), int(seen.value))


class Bench:
    """A clocked, reset component under test. Signedness, lost in Verilog, is taken from the component's members.

    Attributes:
        dut: cocotb's handle of the harness around the component; what it has is known at run time only.
        packing: how the component's ports lie in one word.
        inputs: how its inputs lie in one word.
        monitors: the monitors so far.
        in_campaign: whether the sequencer drives the inputs.
        clock: what makes the component's clock, from the first reset on.
    """

    period_ns = PERIOD_NS

    def __init__(self, dut: HierarchyObject, component: wiring.Component):
        self.dut: Any = dut
        self.packing, self.inputs = packing_of(component), inputs_of(component)
        self.monitors: list[Monitor] = []
        self.in_campaign = False
        self._component = component
        self._held: dict[str, int] = {}
        self._ahead = 0

    async def reset(self) -> None:
        """Start the clock, zero every input and hold reset for two clocks."""
        if not hasattr(self, "clock"):
            self.clock = Clock(self.dut.clk, PERIOD_NS, "ns")
            self.clock.start()
        for name in ("campaign", "go", "strobe", "momentary", "watched"):
            getattr(self.dut, RESERVED + name).value = 0
        self.drive(**dict.fromkeys(self.inputs.shapes, 0))
        self.dut.rst.value = 1
        await ClockCycles(self.dut.clk, 2)
        self.dut.rst.value = 0

    def clock_number(self) -> int:
        """Return the number of the component's last clock edge."""
        return round(get_sim_time("ns")) // PERIOD_NS + self._ahead

    def ran(self, number: int) -> None:
        """Take the last edge's number from the sequencer: its clocks take no time."""
        self._ahead += number - self.clock_number()

    def reader(self, name: str) -> Callable[[], int]:
        """Return a function that reads a port as the integer that it represents."""
        handle, signed = getattr(self.dut, name), self.packing.shapes[name].signed

        def read() -> int:
            return handle.value.to_signed() if signed else int(handle.value)

        return read

    def drive(self, **values: int) -> None:
        """Set inputs; a negative value is taken modulo the width, as two's complement."""
        for name, value in values.items():
            handle = getattr(self.dut, name)
            handle.value = int(value) & ((1 << len(handle)) - 1)
        self._held |= values

    def monitor(self, strobe: str, *names: str) -> Monitor:
        """Return a monitor that records the ports `names` whenever `strobe` is high at a clock edge."""
        self.monitors.append(Monitor(self, strobe, names))
        return self.monitors[-1]

    async def transact(self, strobe: str, done: str, **values: int) -> None:
        """Drive `values` with a one-clock `strobe` and wait until the clock after `done` rises.

        Raises:
            AssertionError: if `done` does not rise; with a latency of 0 it never rises after the strobe.
        """
        self.drive(**values, **{strobe: 1})
        await RisingEdge(self.dut.clk)
        self.drive(**{strobe: 0})
        answer = RisingEdge(getattr(self.dut, done))
        came = await First(answer, Timer(PATIENCE * PERIOD_NS, "ns"))
        assert came is answer, f"no {done} within {PATIENCE} clocks of {strobe}; inputs {values}"
        await RisingEdge(self.dut.clk)

    async def campaign(
        self,
        strobe: str,
        done: str,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...],
        rows: Iterable[tuple[int, ...]],
        latency: int | None = None,
        every: int | None = None,
        momentary: Iterable[str] = (),
    ) -> tuple[Rows, Rows]:
        """Put `rows` of `inputs` through; every strobe comes with the previous answer or a clock later, at random.

        The other inputs stay as they were driven, and a row's until the next. This is much quicker than `transact`
        between two monitors, because Python runs only once in thousands of samples.

        Args:
            strobe: the input that is high for one clock with every row.
            done: the output that is high for one clock with every answer.
            inputs: the names of a row's values.
            outputs: the names of the ports that are recorded at every answer.
            rows: the rows of input values.
            latency: the most clocks from a strobe to its answer; default: `latency` of the component. With 0 the answer
                comes in the strobe's own clock.
            every: the fewest clocks between strobes, less than `latency` for a pipeline; default: `latency`, or 1.
            momentary: the inputs of a row that the component takes with the strobe; at all other clocks they are the
                complements of what they were.

        Returns:
            The values of the ports at every strobe, and at every answer.

        Raises:
            TypeError: if there is no latency, or it is no int.
            ValueError: if a number of clocks is out of its range.
            AssertionError: if an answer is missing or late, or comes without a strobe.
        """
        promised: Any = getattr(self._component, "latency", None) if latency is None else latency
        taken, given = (Rows(names, self.packing, [], []) for names in (inputs, outputs))
        campaign = Campaign(strobe, done, taken, given, promised, max(promised or 1, 1) if every is None else every)
        self.dut.bench_momentary.value = sum(map(self.inputs.mask, momentary))
        held = self.inputs.pack({**self._held, **dict.fromkeys((strobe, *inputs), 0)})
        self.in_campaign = True
        try:
            last = await campaign.run(self, held, rows)
        finally:
            self.in_campaign = False
            self.dut.bench_campaign.value = 0
        self.drive(**last)
        await self.rest()
        return taken, given

    async def rest(self) -> None:
        """Wait until the monitors have seen the last transaction."""
        await ClockCycles(self.dut.clk, 2)
