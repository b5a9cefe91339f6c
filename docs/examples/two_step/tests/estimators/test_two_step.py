"""The mean of two differences: RTL against model, and the model against plain integers."""

import cocotb
import numpy as np
import pytest

from hardwall.hdl.estimators.two_step import Estimator
from hardwall.model.estimators.two_step import START
from hardwall.testing import CAMPAIGN, SAMPLES, parameters, rng, simulate
from hardwall.testing.estimators import follow, model
from stimuli.specs import spec


def design(name: str):
    return spec(name, "two-step").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    component, random = make(**parameters()), rng()
    half, fast = 1 << (component.design.count_width - 1), component.design.velocity.max
    ends = [-half, half - 1, 0, -1, 0, 1, 0, half - 1, -half, -half, half - 1, -half // 2, half // 2 - 1, half // 2]
    jumps = random.integers(-half, half, SAMPLES // 2)
    walk = np.cumsum(random.integers(-fast, fast, SAMPLES // 2))
    counts = np.concatenate([ends, jumps, walk]).tolist()
    restarts = (random.random(len(counts)) < 0.01).tolist()
    expected = await follow(dut, component, zip(counts, restarts, strict=True), START)
    assert expected["saturated"].any()


@pytest.mark.parametrize("name", ["paper", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_model_is_the_sum_of_two_wrapped_differences():
    width, top = design("paper").count_width, design("paper").velocity.max
    counts = rng().integers(-(1 << (width - 1)), 1 << (width - 1), 10_000).tolist()
    seen = model(design("paper"), [(count, 0) for count in counts], START)["velocity"]
    half = 1 << (width - 1)
    moved = (np.diff(counts) + half) % (2 * half) - half
    sums = [0, *(moved + np.append(0, moved[:-1])).tolist()]
    assert seen.tolist() == [min(max(each, -top - 1), top) for each in sums]


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
