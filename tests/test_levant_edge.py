"""stub"""
import cocotb
import numpy as np
import pytest
from estimator_bench import follow
from specs import spec
from bench import CAMPAIGN, SAMPLES, parameters, rng, simulate
from hardwall.hdl.levant_edge import Estimator
from hardwall.model.levant_edge import START

def design(name):
    return spec(name, "levant-edge").design.estimator

def make(name):
    return Estimator(design(name))

def stimulus(d, samples):
    random = rng()
    W = 1 << d.stamp_width
    half = 1 << (d.count_width - 1)
    reset = [w.reset for w in d.words]
    top = [w.format.max for w in d.words]
    now = W - 5 * d.clocks
    count, stamps, edge, down, run = half - 3, [0] * 4, 0, 0, 0
    speed, gains = 0, reset
    for k in range(samples):
        if k % 40 == 0:
            speed = int(random.integers(0, 8))
            gains = reset if random.random() < 0.7 else [int(random.integers(0, m + 1)) for m in top]
            pace = random.random() < 0.7
            up = random.random() < 0.5
        now += d.clocks if random.random() < 0.97 else int(random.integers(1, W))
        if speed == 7:
            yield (int(random.integers(-half, half)), now % W, *(int(x) for x in random.integers(0, W, 4)), int(random.integers(0, 4)), int(random.integers(0, 2)), int(random.integers(0, 5)), 0, *gains)
            continue
        n = int(random.random() < 4.0 ** (-speed)) if speed else int(random.integers(0, 30))
        at = now - int(random.integers(1, d.clocks))
        if n:
            if not pace and random.random() < 0.3:
                up = not up
            was = down
            down = int(not up)
            run = min(run + n, 4) if was == down else 1
            count = (count + (n if up else -n) + half) % (2 * half) - half
            edge = ((count + down) & 3) ^ (down << 1)
            stamps[edge] = at % W
        yield (count, now % W, *stamps, edge, down, run, int(random.random() < 0.001), *gains)

@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    name = parameters()["name"]
    d = design(name)
    expected = await follow(dut, make(name), stimulus(d, SAMPLES), START)
    assert 0 in expected["saturated"]
    print(np.unique(expected["saturated"], return_counts=True))
    assert np.bitwise_or.reduce(expected["saturated"]) == 0b11

@pytest.mark.parametrize("name", ["paper","mhz", "narrow"])
def test_rtl(name):
    simulate(__file__, make, name=name)
