"""Promises that several of Levant's differentiators share; every one has its own test for the rest."""

from itertools import product

import levants
import pytest
from filters import rms

from hardwall.hdl.estimators.registry import ESTIMATORS
from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import registry
from hardwall.model.estimators.estimate import estimate
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.papers_signal import BOUND, RATES, axis_at, swing
from stimuli.specs import spec

NAMES = ("levant", "levant-semi-implicit", "levant-implicit")
PROJECTING = NAMES[1:]


@pytest.mark.parametrize(
    ("rate", "bound"),
    product(RATES, [BOUND, 12.0]) if LONG else [*product(RATES[:-1], [BOUND, 12.0]), (RATES[-1], 12.0)],
)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("output", ["u", "u1"])
def test_word_length_costs_a_hundredth_at_every_rate(name, rate, bound, output):
    runs = 4 if LONG or rate < RATES[-1] else 1
    exact, fixed = levants.rms_errors(axis_at(name, rate, bound), 0.4, runs)[output]
    assert abs(fixed - exact) <= 0.01 * exact


@pytest.mark.parametrize("floating", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_u1_is_what_the_state_keeps_of_either_kernel(name, floating):
    axis_spec, (counts, _) = axis_at(name, 10_000), swing(10_000, 0.1, levants.TURN_S)
    params, state, kept = Axis(axis_spec, floating).params.estimator, axis_spec.design.start(floating).estimator, []
    for count in counts.tolist():
        state, _, _ = estimate(params, state, seen_count(count), 0)
        kept.append(state.u1)
    of_u, of_u1 = (levants.axis(axis_spec, output, floating).run(counts).velocity.tolist() for output in ("u", "u1"))
    assert of_u != of_u1 == kept


@pytest.mark.parametrize(("gains", "named"), levants.REFUSED)
@pytest.mark.parametrize("name", NAMES)
def test_gains_that_cannot_be_held_are_refused(name, gains, named):
    design = registry.design_of(name)
    with pytest.raises(ValueError, match=f"^{named}"):
        design(spec("paper", name), design.gains_class(**gains))


@pytest.mark.parametrize("name", NAMES)
def test_wrong_design_is_refused(name):
    with pytest.raises(TypeError, match=r"not 3$"):
        ESTIMATORS[name](3)


@pytest.mark.parametrize("name", PROJECTING)
def test_in_the_band_it_is_the_finite_difference(name):
    levants.check_finite_difference_in_the_band(name)


@pytest.mark.parametrize("rate", RATES[:4])
@pytest.mark.parametrize("name", PROJECTING)
def test_a_count_that_stands_is_zero(name, rate):
    levants.check_standstill(name, rate)


@pytest.mark.parametrize("name", PROJECTING)
def test_at_1_khz_the_chatter_is_gone(name):
    counts, truth = swing(1_000, 4.0, levants.TURN_S, rng().random())
    ours, explicit, difference = (
        rms(Axis(axis_at(each, 1_000), floating=True).run(counts).velocity_m_per_s - truth)
        for each in (name, "levant", "fdm")
    )
    assert ours <= difference < explicit / 4


@pytest.mark.parametrize("name", PROJECTING)
def test_wrap_restart_and_drift(name):
    levants.check_wrap_and_restart(axis_at(name, 10_000))
    levants.check_no_drift(axis_at(name, 1_000_000, 12.0))
