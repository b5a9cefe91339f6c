"""Campaigns: many rows put through a component, in batches that the harness's sequencer runs, and their answers."""

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice

from cocotb.triggers import FallingEdge, RisingEdge

from .harness import BATCH, SPACING_BITS, event_of, row_of
from .packing import Packing, Record
from .simulator import TRACED_SAMPLES, rng
from .verdict import Wrong


class Campaign:
    """A strobe, its answer and their pace, and the records of the inputs taken and the outputs given so far.

    Attributes:
        taken: the values of the ports at every strobe.
        given: the values of the ports at every answer.

    Raises:
        TypeError: if `latency` or `every` is no int.
        ValueError: if `latency` or `every` is out of its range.
    """

    def __init__(self, strobe: str, done: str, taken: Record, given: Record, latency: int, every: int):
        most = (1 << SPACING_BITS) - 2
        for name, value, least in (("latency", latency, 0), ("every", every, 1)):
            if isinstance(value, bool) or not isinstance(value, int):
                raise TypeError(f"{name} must be an int, the clocks from {strobe}, not {value!r}")
            if not least <= value <= most:
                raise ValueError(f"{name} must be {least} to {most} clocks, not {value!r}")
        self.strobe, self.done, self.taken, self.given = strobe, done, taken, given
        self.latency, self.every = latency, every
        self._waiting: deque[int] = deque()

    async def run(self, dut, inputs: Packing, seen: Packing, words: Iterable[int], clock_number) -> None:
        """Put words of inputs through, one word a strobe, and fill the records.

        Raises:
            AssertionError: if an answer is missing or late, or comes without a strobe.
        """
        dut.bench_strobe.value = inputs.bit(self.strobe)
        dut.bench_watched.value = seen.bit(self.strobe) | seen.bit(self.done)
        dut.bench_campaign.value = 1
        ended, batch = FallingEdge(dut.bench_busy), int(dut.bench_go.value)
        await RisingEdge(dut.clk)
        for rows, length in self._batches(inputs, words):
            batch ^= 1
            dut.bench_rows.value, dut.bench_length.value, dut.bench_go.value = rows, length, batch
            # The next edge takes the batch; the events' clocks are counted from the one after it.
            start = clock_number() + 2
            await ended
            self._sort(seen, start, int(dut.bench_events.value), int(dut.bench_records.value))

    def _batches(self, inputs: Packing, words: Iterable[int]) -> Iterator[tuple[int, int]]:
        """Yield batches of rows and their lengths: a strobe comes with the promised answer or a clock later, at random.

        The last row of a batch waits until its answer is overdue.
        """
        row, coin, words = row_of(inputs), rng(), islice(words, TRACED_SAMPLES)
        while batch := list(islice(words, BATCH)):
            spacings = (self.every - 1 + (coin.random(len(batch)) < 0.5)).tolist()
            spacings[-1] = max(spacings[-1], self.latency + 1)
            rows = 0
            for place, (word, spacing) in enumerate(zip(batch, spacings, strict=True)):
                rows |= row.pack({"inputs": word, "spacing": spacing}) << place * row.width
            yield rows, len(batch)

    def _sort(self, seen: Packing, start: int, events: int, records: int) -> None:
        """Sort the events of a batch into the records of inputs taken and outputs given."""
        event, kept = event_of(seen), min(events, 2 * BATCH)
        is_strobe, is_done, mask = seen.bit(self.strobe), seen.bit(self.done), (1 << event.width) - 1
        words = [records >> place * event.width & mask for place in range(kept)]
        for ports, clock in zip(event.column("seen", words), event.column("clock", words), strict=True):
            if ports & is_strobe:
                self.taken.add(start + clock, ports)
                self._waiting.append(start + clock)
            if ports & is_done:
                if not self._waiting:
                    sample = len(self.given.clocks)
                    raise Wrong(sample, f"{self.done} without {self.strobe} before sample {sample}")
                self._waiting.popleft()
                self.given.add(start + clock, ports)
            self._check_patience(start + clock)
        self._check_patience(None)
        if events > kept:
            raise Wrong(len(self.given.clocks), f"{events} clocks with {self.strobe} or {self.done} in {BATCH} samples")

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
