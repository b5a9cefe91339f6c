"""The M/T method: RTL against model; `test_kept_edges` has what its words are, `test_stamped_estimators` its bound."""

import cocotb
import pytest
from mts import design, follows_model, starts_afresh, stays_until_the_next

from hardwall.hdl.estimators.mt import Estimator
from hardwall.testing import CAMPAIGN, parameters, simulate
from stimuli.lengths import some_of

NAME = "mt"


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


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
