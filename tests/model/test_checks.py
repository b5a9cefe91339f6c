"""Inputs that the model refuses, and its messages: the name, the accepted range and the value, in one sentence."""

import math

import numpy as np
import pytest

from hardwall.model import stamped
from hardwall.model.arithmetic.fixed import SQ
from hardwall.model.axis.axis import Axis
from hardwall.model.estimators import foaw, levant, period_count, registry
from hardwall.model.spec import AxisSpec
from stimuli.specs import PAPER, SPECS, spec

AXIS = Axis(spec("mhz", "fdm"))
HALF = 1 << (AXIS.spec.count_width - 1)


@pytest.mark.parametrize(
    ("counts", "error", "message"),
    [
        ([0.5], TypeError, "counts must be integers, not float64"),
        ([0, math.nan], TypeError, "counts must be integers, not float64"),
        (["1", "2"], TypeError, "counts must be integers, not <U1"),
        ([True, False], TypeError, "counts must be integers, not bool"),
        ([1, None], TypeError, "counts must be integers, not object"),
        (np.array([1, 2], "timedelta64[s]"), TypeError, "counts must be integers, not timedelta64[s]"),
        (np.ma.array([1, 2], mask=[0, 1]), TypeError, "counts must be integers, and none of them masked"),
        ([[0], [1 << 62]], ValueError, f"counts must be -{2**62} to {2**62 - 1}, not {2**62} at element 1, 0"),
        ([[1], [1, 2]], TypeError, "counts must be an array of integers, not [[1], [1, 2]]"),
        (3, ValueError, "counts must have 1 or 2 dimensions, not 0"),
        ([0, 1 << 62], ValueError, f"counts must be -{2**62} to {2**62 - 1}, not {2**62} at element 1"),
        (
            np.array([2**64 - 1], np.uint64),
            ValueError,
            f"counts must be -{2**62} to {2**62 - 1}, not {2**64 - 1} at element 0",
        ),
        (
            [0, 3, HALF + 60],
            ValueError,
            f"counts must change by less than {HALF}, half of their range, from sample to sample, "
            f"not by {HALF + 57} at sample 2",
        ),
        (
            [[0, 1], [0, -HALF]],
            ValueError,
            f"counts must change by less than {HALF}, half of their range, from sample to sample, "
            f"not by {-HALF} at sample 1 of lane 1",
        ),
    ],
)
def test_counts(counts, error, message):
    with pytest.raises(error) as refused:
        AXIS.run(counts)
    assert str(refused.value) == message


def test_counts_that_are_counts():
    wrapped = AXIS.run([HALF - 2, HALF - 1, -HALF, 1 - HALF]).velocity
    assert wrapped.tolist() == AXIS.run([HALF - 2, HALF - 1, HALF, HALF + 1]).velocity.tolist() == [0, 1, 1, 1]
    assert AXIS.run(np.array([1, 2], np.uint8)).velocity.tolist() == [0, 1]
    assert AXIS.run([]).velocity.shape == (0,)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"axis": 3}, TypeError, "axis must be an Axis, not a value of type int"),
        ({"edge_clocks": [1.5, 2.0]}, TypeError, "edge_clocks must be integers, not float64"),
        ({"edge_clocks": [1, math.nan]}, TypeError, "edge_clocks must be integers, not float64"),
        ({"edge_levels": ["a", "b"]}, TypeError, "edge_levels must be integers, not <U1"),
        ({"edge_clocks": [-1, 2]}, ValueError, f"edge_clocks must be 0 to {2**62 - 1}, not -1 at element 0"),
        ({"edge_clocks": [3, 2]}, ValueError, "edge_clocks must never decrease, not from 3 to 2 at element 1"),
        ({"edge_levels": [1, 4]}, ValueError, "edge_levels must be 0 to 3, not 4 at element 1"),
        (
            {"edge_levels": [1]},
            ValueError,
            "edge_clocks and edge_levels must have one shape (edges,), not ((2,), (1,))",
        ),
        ({"samples": 0}, ValueError, "samples must be 1 to 1000000000, not 0"),
        ({"samples": 10**15}, ValueError, f"samples must be 1 to 1000000000, not {10**15}"),
        ({"samples": 5.0}, TypeError, "samples must be an int, not 5.0"),
        ({"level": 4}, ValueError, "level must be 0 to 3, not 4"),
        ({"level": "1"}, TypeError, "level must be an int, not '1'"),
    ],
)
def test_records_of_edges(arguments, error, message):
    good = {"axis": AXIS, "edge_clocks": [1, 2], "edge_levels": [1, 3], "samples": 5}
    with pytest.raises(error) as refused:
        stamped.run(**(good | arguments))
    assert str(refused.value) == message


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"spec": 3}, TypeError, r"^spec must be an AxisSpec, not 3$"),
        ({"stiffness": 1.0}, ValueError, r"^parameter must be one of .*wall_stiffness.*, not 'stiffness'$"),
        ({"wall_stiffness": "1e3"}, TypeError, r"^wall_stiffness must be a number, not '1e3'$"),
        ({"wall_stiffness": 1e6}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not 1000000.0$"),
        ({"wall_stiffness": 255997}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not 255997$"),
        ({"wall_stiffness": -1.9}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not -1.9$"),
        ({"wall_stiffness": -1e-9}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not -1e-09$"),
        ({"wall_stiffness": math.inf}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not inf$"),
        ({"wall_stiffness": 10**400}, ValueError, r"^wall_stiffness must be 0 to 255996 N/m, not 10{56}\.\.\.$"),
        ({"wall_damping": math.nan}, ValueError, r"^wall_damping must be 0 to .* N s/m, not nan$"),
        ({"wall_left": 2}, ValueError, r"^wall_left must be 0 to 1, not 2$"),
        ({"wall_left": 0.5}, ValueError, r"^wall_left must be a whole number of 0 to 1, not 0.5$"),
        ({"wall_stiffness": True}, TypeError, r"^wall_stiffness must be a number, not True$"),
    ],
)
@pytest.mark.parametrize("floating", [False, True])
def test_parameters_of_an_axis(arguments, error, message, floating):
    with pytest.raises(error, match=message):
        Axis(**({"spec": AXIS.spec, "floating": floating} | arguments))


def test_gains_beyond_the_last_word_by_less_than_half_an_lsb_are_that_word_in_float_too():
    known = spec("narrow", "period-count").design.estimator
    beyond = known.switch.si_max + 0.4 * known.switch.to_si(1)
    gains = period_count.Gains((1 << known.window_bits) / SPECS["narrow"]["sample_hz"], beyond)
    design = AxisSpec(**SPECS["narrow"] | {"gains": gains}, estimator="period-count").design.estimator
    assert design.float_params(gains, "u", {}).switch == design.switch.reset == known.switch.format.max


EVERY_DESIGN = [(name, estimator) for name in SPECS for estimator in registry.ESTIMATORS]


@pytest.mark.parametrize(("name", "estimator"), EVERY_DESIGN)
def test_the_si_value_of_every_word_is_accepted(name, estimator):
    for word in spec(name, estimator).design.words:
        fmt, low, high = word.format, word.low, word.high
        for number in {low, max(low // 2, low), low + 1, max(high // 3, low), high - 1, high}:
            assert word.from_si(word.to_si(number)) == word.from_si(number * word.to_si(1)) == number
            # In this order the last digits may differ.
            assert word.from_si(number / (1 / fmt.lsb / word.si_per_unit)) == number


@pytest.mark.parametrize(("name", "estimator"), EVERY_DESIGN)
def test_the_bounds_in_the_message_are_accepted_and_nothing_beyond(name, estimator):
    for word in spec(name, estimator).design.words:
        for bound, last, way, farther in ((word.si_min, word.low, -1, min), (word.si_max, word.high, 1, max)):
            shown = float(f"{bound:g}")
            assert word.from_si(shown) == pytest.approx(last, rel=5e-6)
            with pytest.raises(ValueError, match=f"^{word.name} must be "):
                word.from_si(farther(bound, shown) + way * 1e-9 * max(word.to_si(1), abs(bound)))


@pytest.mark.parametrize(
    ("fields", "error", "message"),
    [
        ({"clock_hz": 12e6}, TypeError, r"^clock_hz must be an int, not 12000000.0$"),
        ({"clock_hz": True}, TypeError, r"^clock_hz must be an int, not True$"),
        ({"clock_hz": 10**30}, ValueError, r"^clock_hz must be 1 to 281474976710656, not 1000"),
        ({"travel_m": "1"}, TypeError, r"^travel_m must be a number, not '1'$"),
        ({"travel_m": math.nan}, ValueError, r"^travel_m must be 1e-30 to 1e\+30, not nan$"),
        ({"estimator": 3}, TypeError, r"^estimator must be a str, not 3$"),
        ({"estimator": "fd"}, ValueError, r"^estimator must be one of fdm, .*, not 'fd'$"),
        ({"gains": {"alpha": 1.0}}, TypeError, r"^gains of levant must be levant.Gains or None, not \{'alpha': 1.0\}$"),
        (
            {"estimator": "fdm", "gains": levant.Gains(1.0, 1.0)},
            TypeError,
            r"^gains of fdm must be finite_difference.Gains or None, not Gains\(",
        ),
    ],
)
def test_fields_of_a_spec(fields, error, message):
    with pytest.raises(error, match=message):
        AxisSpec(**(PAPER | fields))


def test_names_numbers_and_outputs():
    with pytest.raises(ValueError, match=r"^estimator must be one of fdm, levant, .*, not 'fd'$"):
        registry.design_of("fd")
    with pytest.raises(ValueError, match=r"^output of foaw must be one of end-fit, best-fit, not 'u'$"):
        foaw.Design.choose("u")
    with pytest.raises(TypeError, match=r"^value for SQ\(3, 2\) must be a number, not 'a'$"):
        SQ(3, 2).from_real("a")
