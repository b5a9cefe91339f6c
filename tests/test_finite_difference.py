"""The finite difference: RTL against model, and the model against plain integers."""

from itertools import pairwise

import cocotb
import numpy as np
import pytest
from specs import spec

from bench import CAMPAIGN, SAMPLES, Bench, check, parameters, rng, simulate
from hardwall.hdl.finite_difference import Estimator
from hardwall.model.estimators import estimate
from hardwall.model.finite_difference import START


def design(name: str):
    return spec(name, "fdm").design.estimator


def make(name: str) -> Estimator:
    return Estimator(design(name))


def model(name: str, rows) -> dict[str, np.ndarray]:
    """Return velocity and flags for rows of (count, restart)."""
    params, state, out = design(name).params({}), START, []
    for count, restart in rows:
        state, velocity, flags = estimate(params, state, count, restart)
        out.append((velocity, flags))
    velocity, flags = zip(*out, strict=True)
    return {"velocity": np.array(velocity), "saturated": np.array(flags)}


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    component = make(name)
    bench = Bench(dut, component)
    await bench.reset()
    coin = rng()  # whether the next strobe comes with this one's end
    inputs = bench.monitor("strobe", "count", "restart")
    outputs = bench.monitor("valid", "velocity", "saturated")
    half = 1 << (component.design.count_width - 1)
    random = rng()
    ends = [-half, half - 1, 0, -1, 0, 1, 0, half - 1, -half, -half, half - 1, -half // 2, half // 2 - 1, half // 2]
    jumps = random.integers(-half, half, SAMPLES // 2)
    walk = np.cumsum(
        random.integers(-2 * component.design.velocity.max, 2 * component.design.velocity.max, SAMPLES // 2)
    )
    counts = np.concatenate([ends, jumps, walk])
    for count, restart in zip(counts.tolist(), (random.random(len(counts)) < 0.01).tolist(), strict=True):
        await bench.transact("strobe", "valid", idle=coin.random() < 0.5, count=count, restart=restart)
    await bench.rest()
    expected = model(name, inputs.rows)
    assert expected["saturated"].any()
    check(inputs, outputs, expected, component.latency)


@pytest.mark.parametrize("name", ["paper", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)


def test_model_is_the_wrapped_difference():
    width = design("paper").count_width
    counts = rng().integers(-(1 << (width - 1)), 1 << (width - 1), 10_000).tolist()
    seen = model("paper", [(count, 0) for count in counts])["velocity"]
    top = design("paper").velocity.max
    differences = [0] + [b - a for a, b in pairwise(counts)]
    wrapped = [(d + (1 << (width - 1))) % (1 << width) - (1 << (width - 1)) for d in differences]
    assert seen.tolist() == [min(max(d, -top - 1), top) for d in wrapped]


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
