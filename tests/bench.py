"""Test-bench parts for Amaranth components under cocotb on Verilator.

Two halves, one file, because a test file is read twice. Under pytest, `simulate` generates the Verilog of a component,
builds it once (cached by content) and runs the file's cocotb tests inside the simulator. There, `Bench` clocks and
resets the component, monitors record what its pins really carried, and `check` holds that against the model with `==`.

Seeds: every run uses `HARDWALL_SEED` (default 1), logged by cocotb; `HARDWALL_SAMPLES` scales the random campaigns.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path

import cocotb
import numpy as np
from amaranth.hdl import Shape
from amaranth.lib.wiring import In
from cocotb.clock import Clock
from cocotb.simtime import get_sim_time
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.sim import cocotb_runner

SEED = int(os.environ.get("HARDWALL_SEED", "1"))
SAMPLES = int(os.environ.get("HARDWALL_SAMPLES", "20000"))
PERIOD_NS = 10
CAMPAIGN = {"timeout_time": SAMPLES + 20_000, "timeout_unit": "us"}
"""For `cocotb.test` of a campaign: hardware that stops answering fails, instead of hanging, at 100 clocks a sample."""


def simulate(test_file: str, make: Callable, *, checks: str | None = None, **parameters) -> None:
    """Run the cocotb tests of `test_file` on the Verilog of `make(**parameters)`; fail if any fails or none runs.

    `parameters` must be JSON values: they reach the simulator's process in the environment, where `parameters()`
    returns them. `checks` is a regular expression of the names to run (default: all of the file).
    """
    file = Path(test_file)
    cocotb_runner.simulate(
        make(**parameters), file.stem, file.parent, {"HARDWALL_PARAMETERS": json.dumps(parameters)}, SEED, checks
    )


def parameters() -> dict:
    """Return, inside the simulator, the parameters that `simulate` was called with."""
    return json.loads(os.environ["HARDWALL_PARAMETERS"])


def rng() -> np.random.Generator:
    """Return a generator seeded from `HARDWALL_SEED`."""
    return np.random.default_rng(SEED)


class Monitor:
    """Records `names` at every clock edge at which `strobe` is high, as the component itself sees them there.

    Attributes: `rows`, a list of tuples in the order of `names`; `clocks`, the clock number of each row.
    """

    def __init__(self, bench: "Bench", strobe: str, names: tuple[str, ...]):
        self.names = names
        self.rows: list[tuple[int, ...]] = []
        self.clocks: list[int] = []
        self._bench = bench
        self._strobe = getattr(bench.dut, strobe)
        self._read = [bench.reader(name) for name in names]
        cocotb.start_soon(self._record())

    async def _record(self):
        while True:
            if not int(self._strobe.value):
                await RisingEdge(self._strobe)
            await RisingEdge(self._bench.dut.clk)
            if int(self._strobe.value):
                self.clocks.append(self._bench.clock_number())
                self.rows.append(tuple(read() for read in self._read))

    def column(self, name: str) -> np.ndarray:
        """Return one recorded signal as int64."""
        index = self.names.index(name)
        return np.array([row[index] for row in self.rows], np.int64)


class Bench:
    """A clocked, reset component under test. Signedness, lost in Verilog, is taken from the component's members."""

    period_ns = PERIOD_NS

    def __init__(self, dut, component):
        self.dut = dut
        members = component.signature.members
        self._signed = {name: Shape.cast(members[name].shape).signed for name in members}
        self._inputs = [name for name in members if members[name].flow == In and name not in ("clk", "rst")]

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

    async def rest(self) -> None:
        """Let the monitors see what the last transaction brought."""
        await ClockCycles(self.dut.clk, 2)


def check(inputs: Monitor, outputs: Monitor, expected: dict[str, np.ndarray], latency: int | None = None) -> None:
    """Hold every recorded output against the model's, exactly; fail on a lost, an extra or no output at all.

    `expected` maps the names of `outputs` to what the model made of `inputs`. With `latency`, every output must also
    come that many clocks after its input.
    """
    assert len(outputs.rows) > 0, "nothing was compared"
    assert len(inputs.rows) == len(outputs.rows), f"{len(inputs.rows)} inputs but {len(outputs.rows)} outputs"
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
