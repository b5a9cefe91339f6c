"""The M/T method without a divider: RTL against model, whose words are those of `mt`, in fewer clocks."""

from itertools import product

import cocotb
import pytest
from mts import design, follows_model, starts_afresh, stays_until_the_next, stimulus

from hardwall.hdl.estimators.mt_divisionless import Estimator
from hardwall.model.estimators.kept_edges import KeptDesign
from hardwall.testing import CAMPAIGN, parameters, simulate
from hardwall.testing.estimators import follow, model
from stimuli.edges import Edge, Strobe, rows
from stimuli.lengths import some_of

NAME = "mt-divisionless"


def make(name: str, half: int | None = None) -> Estimator:
    return Estimator(design(NAME, name, half))


@cocotb.test(**CAMPAIGN)
async def rtl_follows_model(dut):
    await follows_model(dut, make(**parameters()), parameters()["name"])


def about_the_bound(d: KeptDesign):
    """Yield rows of few edges, slow and fast, and of ages at which their silence just begins to tell, or does not."""
    strobes, edges, now = [], [], 0
    for moved, quarters, more in product(range(1, 5), (1, 2, 3, 5), range(4)):
        time = moved * d.clocks * quarters // 4 + more
        for age in range(3 * time // (2 * moved) - 1, 3 * time // (2 * moved) + 3):
            begun, number = now + 1, edges[-1].number + 1 if edges else 1
            strobes.append(Strobe(now, 1, len(edges)))
            edges.append(Edge(begun, number, 0))
            strobes.append(Strobe(begun + 1, 0, len(edges)))
            edges += [Edge(begun + -(-time * k // moved), number + k, 0) for k in range(1, moved + 1)]
            now = edges[-1].at + age
            strobes.append(Strobe(now, 0, len(edges)))
            now += d.clocks
    yield from rows(d, strobes, edges)


@cocotb.test()
async def silence_tells_from_its_very_clock_on(dut):
    component = make(**parameters())
    await follow(dut, component, about_the_bound(component.design), component.design.start())


@cocotb.test()
async def reset_mid_stream_starts_afresh(dut):
    await starts_afresh(dut, make(**parameters()))


@cocotb.test()
async def outputs_stay_until_the_next(dut):
    await stays_until_the_next(dut, make(**parameters()))


@pytest.mark.parametrize(("name", "half"), some_of([("mhz", None), ("narrow", 1), ("narrow", 5)], 0, 1))
def test_rtl(name, half):
    simulate(__file__, make, name=name, half=half)


@pytest.mark.parametrize("name", ["mhz", "paper"])
def test_every_word_is_that_of_mt_and_sooner(name):
    ours, others = design(NAME, name, 3), design("mt", name, 3)
    every = [*stimulus(ours, 3_000)]
    seen, expected = (model(d, every, d.start()) for d in (ours, others))
    assert all((seen[output] == expected[output]).all() for output in ("velocity", "saturated"))
    assert ours.latency < 0.75 * others.latency


def test_the_design_of_mt_is_refused():
    with pytest.raises(TypeError, match=r"^design must be a mt_divisionless.Design, not <"):
        Estimator(design("mt", "mhz"))
