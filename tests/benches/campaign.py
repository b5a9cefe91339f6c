"""Campaigns: many rows put through a component, in batches that the harness's sequencer runs, and their answers."""

from collections import deque
from collections.abc import Iterable
from itertools import islice
from pathlib import Path
from typing import Any

import cocotb
from cocotb.triggers import FallingEdge, RisingEdge, ValueChange

from .harness import SPACING_BITS
from .packing import Packing, Rows
from .simulator import TRACED, TRACED_SAMPLES, rng
from .verdict import Wrong

BATCH = 4096
"""The most rows of a batch: few files of rows, and a fault is found soon."""


class Campaign:
    """A strobe, its answer and their pace, and the rows of the inputs taken and of the outputs given so far.

    Attributes:
        taken: the values of the ports at every strobe.
        given: the values of the ports at every answer.

    Raises:
        TypeError: if `latency` or `every` is no int.
        ValueError: if `latency` or `every` is out of its range.
    """

    def __init__(self, strobe: str, done: str, taken: Rows, given: Rows, latency: int, every: int):
        most = (1 << SPACING_BITS) - 2
        for name, value, least in (("latency", latency, 0), ("every", every, 1)):
            if isinstance(value, bool) or not isinstance(value, int):
                raise TypeError(f"{name} must be an int, the clocks from {strobe}, not {value!r}")
            if not least <= value <= most:
                raise ValueError(f"{name} must be {least} to {most} clocks, not {value!r}")
        self.strobe, self.done, self.taken, self.given = strobe, done, taken, given
        self.latency, self.every = latency, every
        self._waiting: deque[int] = deque()
        self._coin = rng()

    async def run(self, bench: Any, held: int, rows: Iterable[tuple[int, ...]]) -> dict[str, int]:
        """Put rows of inputs through, beside the word `held` of the others; fill `taken`, `given`; return the last row.

        Raises:
            AssertionError: if an answer is missing or late, or comes without a strobe.
        """
        dut, inputs, seen, scratch = bench.dut, bench.inputs, bench.packing, Path(str(cocotb.plusargs["scratch"]))
        watched = {self.strobe, self.done, *(monitor.strobe for monitor in bench.monitors)}
        # See sequencer.v: only the clocks of the bench take time, which a waveform needs.
        await (RisingEdge if TRACED else FallingEdge)(dut.clk)
        dut.bench_strobe.value = inputs.bit(self.strobe)
        dut.bench_watched.value = sum(map(seen.bit, watched))
        dut.bench_campaign.value = 1
        go, rows, last = int(dut.bench_go.value), islice(rows, TRACED_SAMPLES), {}
        while batch := list(islice(rows, BATCH)):
            last = dict(zip(self.taken.names, batch[-1], strict=True))
            words = inputs.pack_rows(self.taken.names, batch)
            text = "".join(
                f"{spacing << inputs.width | held | word:x}\n"
                for spacing, word in zip(self._spacings(len(batch)), words, strict=True)
            )
            (scratch / "rows").write_text(text, encoding="ascii")
            go ^= 1
            dut.bench_go.value, start = go, bench.clock_number() + 1
            await ValueChange(dut.bench_done)
            bench.ran(start + int(dut.bench_clocks.value) - 1)
            numbers = [int(word, 16) for word in (scratch / "events").read_text(encoding="ascii").split()]
            self._sort(seen, start, zip(numbers[::2], numbers[1::2], strict=True), bench.monitors)
        return last

    def _spacings(self, rows: int) -> list[int]:
        """Return the extra clocks after each row of a batch, so that a strobe comes with the answer or a clock later.

        The last row waits until its answer is overdue.
        """
        spacings = (self.every - 1 + (self._coin.random(rows) < 0.5)).tolist()
        spacings[-1] = max(spacings[-1], self.latency + 1)
        return spacings

    def _sort(self, seen: Packing, start: int, events: Iterable[tuple[int, int]], monitors: Iterable[Any]) -> None:
        """Sort the events of a batch into the rows of inputs taken, of outputs given, and of monitors."""
        is_strobe, is_done = seen.bit(self.strobe), seen.bit(self.done)
        watching = [(seen.bit(monitor.strobe), monitor) for monitor in monitors]
        for number, ports in events:
            clock = start + number
            if ports & is_strobe:
                self.taken.add(clock, ports)
                self._waiting.append(clock)
            if ports & is_done:
                if not self._waiting:
                    sample = len(self.given.clocks)
                    raise Wrong(sample, f"{self.done} without {self.strobe} before sample {sample}")
                self._waiting.popleft()
                self.given.add(clock, ports)
            self._check_patience(clock)
            for bit, monitor in watching:
                if ports & bit:
                    monitor.add(clock, ports)
        self._check_patience(None)

    def _check_patience(self, now: int | None) -> None:
        """Fail if the oldest sample's answer is overdue at clock `now`; None is the end of a batch."""
        if not self._waiting or (now is not None and now < self._waiting[0] + self.latency):
            return
        sample = len(self.given.clocks)
        row = dict(zip(self.taken.names, self.taken.rows[sample], strict=True))
        raise Wrong(
            sample,
            f"sample {sample} waits: no {self.done} within {self.latency} clocks of its {self.strobe}, "
            f"the latency promised; inputs {row}",
        )
