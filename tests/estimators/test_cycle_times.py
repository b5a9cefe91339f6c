"""Times of encoder cycles: RTL against model; the estimators' tests check the model itself against all edges."""

from itertools import chain
from typing import NamedTuple

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.cycle_times import CycleTimes
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.cycle_times import NOTHING, Times, observe
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, check, parameters, simulate
from stimuli.edges import anything, rows, turn
from stimuli.lengths import some_of
from stimuli.seeded import seeded

INPUTS = (*(f"seen__{name}" for name in Seen._fields), "restart")


class Widths(NamedTuple):
    count_width: int
    stamp_width: int
    clocks: int


def model(widths: Widths, cycles_max: int, inputs) -> dict[str, np.ndarray]:
    memory, out = NOTHING, []
    for row in inputs:
        memory, times = observe(widths, memory, Seen(*row[:-1]), row[-1])
        out.append(times._replace(cycles=min(times.cycles, cycles_max)))
    return dict(zip(Times._fields, np.array(out, np.int64).T, strict=True))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component, random = CycleTimes(**parameters()), seeded()
    # The longest sample that the stamps can measure.
    clocks = 1 << min(component.stamp_width - 2, 6)
    widths = Widths(component.count_width, component.stamp_width, clocks)
    bench = Bench(dut, component)
    await bench.reset()
    turns = [rows(widths, *turn(widths, random, SAMPLES // 3), invert) for invert in (False, True)]
    stimulus = chain(*turns, anything(widths, random, SAMPLES // 3))
    at_next_strobe = bench.monitor("strobe", *Times._fields)
    inputs, outputs = await bench.campaign("strobe", "valid", INPUTS, Times._fields, stimulus, momentary=INPUTS)
    expected = model(widths, component.cycles_max, inputs.rows)
    assert set(expected["cycles"]) == set(range(component.cycles_max + 1))
    for name in ("news", "gap", "age", "cycle_age"):
        assert {False, True} == set(expected[name] > 0), name
    check(inputs, outputs, expected, component.latency)
    assert at_next_strobe.rows[1:] == outputs.rows[:-1], "the outputs must stay until the next strobe"


@cocotb.test()
async def a_reset_forgets_every_stamp(dut):
    component, random = CycleTimes(**parameters()), seeded()
    widths = Widths(component.count_width, component.stamp_width, 1 << min(component.stamp_width - 2, 6))
    bench = Bench(dut, component)
    for _ in range(40):
        await bench.reset()
        few = anything(widths, random, 4)
        inputs, outputs = await bench.campaign("strobe", "valid", INPUTS, Times._fields, few)
        check(inputs, outputs, model(widths, component.cycles_max, inputs.rows), component.latency)


SIZES = {
    "wide": {"count_width": 16, "stamp_width": 26, "cycles_max": 13},
    "narrow": {"count_width": 8, "stamp_width": 10, "cycles_max": 2},
    "one cycle": {"count_width": 7, "stamp_width": 6, "cycles_max": 1},
}


@pytest.mark.parametrize("name", some_of(SIZES, 0, 2))
def test_rtl(name):
    simulate(__file__, CycleTimes, **SIZES[name])


@pytest.mark.parametrize(
    ("sizes", "error", "message"),
    [
        ((2.0, 8, 1), TypeError, r"^count_width must be an int, not 2.0$"),
        ((1, 8, 1), ValueError, r"^count_width must be 2 to 62, not 1$"),
        ((2, 2, 1), ValueError, r"^stamp_width must be 3 to 62, not 2$"),
        ((2, 8, 0), ValueError, r"^cycles_max must be 1 or more, not 0$"),
        ((2, 8, True), TypeError, r"^cycles_max must be an int, not True$"),
    ],
)
def test_impossible_sizes_are_refused(sizes, error, message):
    with pytest.raises(error, match=message):
        CycleTimes(*sizes)
