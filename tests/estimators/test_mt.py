"""The M/T method: RTL against model, fixed point against float64, and its bound; `test_kept_edges` has the rest."""

from dataclasses import replace

import cocotb
import numpy as np
import pytest
from mts import design, follows_model, starts_afresh

from hardwall.hdl.estimators.mt import Estimator
from hardwall.sim.estimates import accuracy, signals
from hardwall.sim.world.encoder import offsets
from hardwall.testing import CAMPAIGN, parameters, simulate
from stimuli.edges import (
    check_a_standing_axis_reads_zero_and_a_slowing_one_falls,
    check_rounding_is_the_only_difference,
    exact,
    velocities,
)
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


@pytest.mark.parametrize(("name", "half"), some_of([("mhz", None), ("narrow", 1), ("narrow", 5)], 0, 1))
def test_rtl(name, half):
    simulate(__file__, make, name=name, half=half)


@pytest.mark.parametrize("rate", [1_000, 100_000])
def test_fixed_point_is_the_algorithm_rounded(rate):
    check_rounding_is_the_only_difference(NAME, rate)


@pytest.mark.parametrize("displaced", [0.0, 0.1])
def test_the_error_is_within_the_guaranteed_bound(displaced):
    """On the paper's signal from where a window is short of a count in motion, with edges in place and out of place."""
    rate, signal = 10_000, replace(signals.paper(), seconds=0.2)
    axis = accuracy.axis_spec(NAME, rate, signal.acceleration_max_m_per_s2)
    d = axis.design.estimator
    late = offsets((displaced, -displaced, displaced, -displaced), 0.0)
    seen, flags = velocities(signal, axis, "float", late)
    true, unit = exact(signal, axis, len(seen)), axis.velocity_unit_m_per_s
    c = axis.acceleration_max_m_per_s2 / axis.count_m / rate**2
    fastest = np.abs(true).max() / unit
    # A stamp is late by less than a clock; the last edge is older than the sample by less than the time of an edge.
    stamps = fastest / (d.half * d.clocks)
    bound = c * (d.half + 1) + 2 * displaced / d.half + stamps + 2 * c
    error = np.abs(seen - true)[4 * d.half :] / unit
    assert flags == 0
    assert error.max() <= bound
    assert error.max() >= 0.3 * bound


def test_a_standing_axis_reads_zero_and_a_slowing_one_falls():
    check_a_standing_axis_reads_zero_and_a_slowing_one_falls(NAME)


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Estimator(3)
