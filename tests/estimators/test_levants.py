"""Promises that several of Levant's differentiators share; every one has its own test for the rest."""

import levants
import pytest

from hardwall.hdl.estimators.registry import ESTIMATORS
from hardwall.model.estimators import registry
from stimuli.papers_signal import BOUND, RATES, axis_at
from stimuli.specs import spec

FIXED_GAINS = ("levant", "levant-semi-implicit", "levant-implicit")
PROJECTING = FIXED_GAINS[1:]
ADAPTIVE = "levant-adaptive"


@pytest.mark.parametrize("output", ["u", "u1"])
@pytest.mark.parametrize("bound", [BOUND, 12.0])
@pytest.mark.parametrize("rate", RATES)
@pytest.mark.parametrize("name", FIXED_GAINS)
def test_word_length_costs_a_hundredth_at_every_rate(name, rate, bound, output):
    exact, fixed = levants.rms_errors(axis_at(name, rate, bound), output, 0.4, runs=4)
    assert abs(fixed - exact) <= 0.01 * exact


@pytest.mark.parametrize(("gains", "named"), levants.REFUSED)
@pytest.mark.parametrize("name", [*FIXED_GAINS, ADAPTIVE])
def test_gains_that_cannot_be_held_are_refused(name, gains, named):
    design = registry.design_of(name)
    with pytest.raises(ValueError, match=f"^{named}"):
        design(spec("paper", name), design.gains_class(**gains))


@pytest.mark.parametrize("name", [*FIXED_GAINS, ADAPTIVE])
def test_wrong_design_is_refused(name):
    with pytest.raises(TypeError, match=r"not 3$"):
        ESTIMATORS[name](3)


@pytest.mark.parametrize("name", PROJECTING)
def test_in_the_band_it_is_the_finite_difference(name):
    levants.check_finite_difference_in_the_band(name)


@pytest.mark.parametrize("rate", RATES[:4])
@pytest.mark.parametrize("name", [*PROJECTING, ADAPTIVE])
def test_a_count_that_stands_is_zero(name, rate):
    levants.check_standstill(name, rate)


@pytest.mark.parametrize("name", PROJECTING)
def test_at_1_khz_the_chatter_is_gone(name):
    ours, _ = levants.rms_errors(axis_at(name, 1_000), "u", 4.0)
    explicit, _ = levants.rms_errors(axis_at("levant", 1_000), "u", 4.0)
    difference, _ = levants.rms_errors(axis_at("fdm", 1_000), "u", 4.0)
    assert ours <= difference < explicit / 4


@pytest.mark.parametrize("name", [*PROJECTING, ADAPTIVE])
def test_wrap_restart_and_drift(name):
    levants.check_wrap_and_restart(axis_at(name, 10_000))
    levants.check_no_drift(axis_at(name, 1_000_000, 12.0))
