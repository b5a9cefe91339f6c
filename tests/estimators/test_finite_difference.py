"""The finite difference: RTL against model, and the model against plain integers."""

from itertools import pairwise

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.finite_difference import Estimator
from hardwall.model.estimators.finite_difference import START
from hardwall.testing import CAMPAIGN, SAMPLES, Bench, parameters, rng, simulate
from hardwall.testing.estimators import follow, model
from stimuli.lengths import some_of
from stimuli.specs import spec


def design(name: str):
    return spec(name, "fdm").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component, random = make(**parameters()), rng()
    half, fast = 1 << (component.design.count_width - 1), 2 * component.design.velocity.max
    ends = [-half, half - 1, 0, -1, 0, 1, 0, half - 1, -half, -half, half - 1, -half // 2, half // 2 - 1, half // 2]
    jumps = random.integers(-half, half, SAMPLES // 2)
    walk = np.cumsum(random.integers(-fast, fast, SAMPLES // 2))
    counts = np.concatenate([ends, jumps, walk]).tolist()
    restarts = (random.random(len(counts)) < 0.01).tolist()
    expected = await follow(dut, component, zip(counts, restarts, strict=True), START)
    assert expected["saturated"].any()


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    bench = Bench(dut, make(**parameters()))
    velocity = bench.reader("velocity")
    await bench.reset()
    for count in (0, 1):
        await bench.transact("strobe", "valid", seen__count=count)
    assert velocity() == 1
    await bench.reset()
    await bench.transact("strobe", "valid", seen__count=-1)
    assert velocity() == 0


@pytest.mark.parametrize("name", some_of(["paper", "narrow"], 0))
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_model_is_the_wrapped_difference():
    width = design("paper").count_width
    counts = rng().integers(-(1 << (width - 1)), 1 << (width - 1), 10_000).tolist()
    seen = model(design("paper"), [(count, 0) for count in counts], START)["velocity"]
    top = design("paper").velocity.max
    differences = [0] + [b - a for a, b in pairwise(counts)]
    wrapped = [(d + (1 << (width - 1))) % (1 << width) - (1 << (width - 1)) for d in differences]
    assert seen.tolist() == [min(max(d, -top - 1), top) for d in wrapped]


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
