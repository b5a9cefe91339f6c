"""The watch over the times of cycles: RTL against model, and model against rationals, an event a silence."""

from collections.abc import Iterator
from fractions import Fraction
from typing import NamedTuple

import cocotb
import numpy as np
import pytest
from cocotb.triggers import ClockCycles, RisingEdge

from hardwall.hdl.estimators.bursts import Bursts
from hardwall.model.estimators.bursts import EVENTS, NOTHING, SILENCE_COUNTS, watch
from hardwall.model.estimators.cycle_times import Times
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, simulate
from stimuli.lengths import some_of
from stimuli.seeded import seeded

INPUTS = "news", "cycles", "cycle", "age"


class Params(NamedTuple):
    cycles_max: int
    doubt: int


def rows(stamp_width: int, cycles_max: int, samples: int) -> Iterator[tuple[int, int, int, int]]:
    """Yield times that no encoder has, and silences just at the limit, few or many samples apart."""
    random, most = seeded(), (1 << stamp_width) - 1
    for _ in range(samples // 4):
        cycles, silence = random.randrange(1, cycles_max + 1), 1 + int(2.0 ** random.uniform(0, stamp_width - 2))
        yield 0, 0, 0, silence
        at_limit = int(4 * cycles * silence / SILENCE_COUNTS) + random.randrange(-1, 2)
        yield 1, cycles, min(max(at_limit, 1), most), random.randrange(1, most)
        for _ in range(random.choice((0, 0, 1, 30))):
            yield 0, random.randrange(cycles_max + 1), random.randrange(most), random.randrange(1, 5)
        if random.random() < 0.1:
            yield 1, *(random.randrange(limit + 1) for limit in (cycles_max, most)), random.choice((0, 1, most))


def model(params: Params, inputs) -> dict[str, np.ndarray]:
    state, out = NOTHING, []
    for news, cycles, cycle, age in inputs:
        state, found = watch(params, state, Times(news, cycles, cycle, 0, age, 0))
        out.append(found)
    return {"bursts": np.array(out, np.int64)}


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component = Bursts(**parameters())
    bench, strobes = Bench(dut, component), list(rows(component.stamp_width, component.cycles_max, SAMPLES))
    await bench.reset()
    found = []
    for row in strobes:
        bench.drive(strobe=1, **dict(zip(INPUTS, row, strict=True)))
        await RisingEdge(dut.clk)
        bench.drive(strobe=0)
        # An output is read as it is before an edge.
        await ClockCycles(dut.clk, component.latency)
        found.append(bench.reader("found")())
    expected = model(Params(component.cycles_max, component.doubt), strobes)["bursts"]
    assert set(expected) == {0, 1}
    assert found == expected.tolist()


SIZES = {
    "wide": {"stamp_width": 26, "cycles_max": 13, "doubt": 1000},
    "narrow": {"stamp_width": 6, "cycles_max": 1, "doubt": 16},
}


@pytest.mark.parametrize("name", some_of(SIZES, 0))
def test_rtl(name):
    simulate(__file__, Bursts, **SIZES[name])


@pytest.mark.parametrize(("stamp_width", "cycles_max", "doubt"), [(26, 13, 20), (10, 2, 16)])
def test_an_event_is_a_silence_too_long_for_its_cycle(stamp_width, cycles_max, doubt):
    """Silences and events are kept as lists, from which the result is made anew in every sample."""
    strobes = list(rows(stamp_width, cycles_max, 4000))
    found = model(Params(cycles_max, doubt), strobes)["bursts"]
    silences, events, number = [], [], 0
    for k, (news, cycles, cycle, age) in enumerate(strobes):
        if age == 0:
            silences, events = [], []
        else:
            if news and k and strobes[k - 1][3]:
                silences.append(strobes[k - 1][3])
            if news and cycles and silences:
                longest = max(silences)
                if longest > cycle:
                    silences = []
                elif 4 * cycles * Fraction(longest, cycle) > Fraction(SILENCE_COUNTS):
                    silences = []
                    events.append(k)
        together = 1 if events else 0
        for later, sooner in zip(events[:0:-1], events[-2::-1], strict=True):
            if later - sooner >= doubt:
                break
            together += 1
        expected = int(together >= EVENTS and k - events[-1] < doubt)
        assert found[k] == expected, f"sample {k}"
        number += expected
    assert 0 < number < len(strobes)


@pytest.mark.parametrize(
    ("sizes", "error", "message"),
    [
        ((2.0, 1, 16), TypeError, r"^stamp_width must be an int, not 2.0$"),
        ((2, 1, 16), ValueError, r"^stamp_width must be 3 to 62, not 2$"),
        ((8, 0, 16), ValueError, r"^cycles_max must be 1 or more, not 0$"),
        ((8, 1, 1), ValueError, r"^doubt must be 2 or more, not 1$"),
    ],
)
def test_impossible_sizes_are_refused(sizes, error, message):
    with pytest.raises(error, match=message):
        Bursts(*sizes)
