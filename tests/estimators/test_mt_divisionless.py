"""The M/T method without a divider: RTL against model, whose words are those of `mt`, in fewer clocks."""

import cocotb
import pytest
from mts import design, follows_model, starts_afresh, stays_until_the_next, stimulus

from hardwall.hdl.estimators.mt_divisionless import Estimator
from hardwall.testing import CAMPAIGN, parameters, simulate
from hardwall.testing.estimators import model
from stimuli.lengths import some_of

NAME = "mt-divisionless"


def make(name: str, half: int | None = None) -> Estimator:
    return Estimator(design(NAME, name, half))


@cocotb.test(**CAMPAIGN)
async def rtl_follows_model(dut):
    await follows_model(dut, make(**parameters()), parameters()["name"])


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
    rows = [*stimulus(ours, 3_000)]
    seen, expected = (model(d, rows, d.start()) for d in (ours, others))
    assert all((seen[output] == expected[output]).all() for output in ("velocity", "saturated"))
    assert ours.latency < 0.75 * others.latency


def test_the_design_of_mt_is_refused():
    with pytest.raises(TypeError, match=r"^design must be a mt_divisionless.Design, not <"):
        Estimator(design("mt", "mhz"))
