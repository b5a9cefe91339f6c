"""Fractional powers of a magnitude: RTL against model, and the model against exact powers of rationals."""

from fractions import Fraction

import cocotb
import pytest
from terms import follow, magnitudes, widths_are_needed

from hardwall.hdl.arithmetic.powers import Powers
from hardwall.model.arithmetic.powers import MANTISSA_BITS, STEPS, Design, Term, term
from hardwall.testing import CAMPAIGN, parameters, simulate
from stimuli.lengths import some_of

DESIGNS = {
    "cube": Design(30, 18, 3, (Term(2, 3e-4, 20), Term(1, 7e-8, 32)), (-4, 4)),
    "fourth": Design(38, 22, 4, (Term(3, 1.3, 12), Term(2, 5e-3, 24), Term(1, 1e-6, 36)), (-4, 0)),
    "fifth": Design(23, 9, 5, tuple(Term(n, 2.0 ** (n - 9), 20 - n) for n in (4, 3, 2, 1)), (-4, 4)),
    "coarse": Design(5, 0, 3, (Term(2, 0.9, 0), Term(1, 1.7, 3)), (-2, 1)),
    "fine": Design(12, 12, 3, (Term(1, 900.0, 0),), (-4, -1)),
}
every = pytest.mark.parametrize("name", DESIGNS)


@every
def test_no_term_is_further_from_the_exact_power_than_derived(name):
    """In exact integers: the g-th powers of both sides are compared, so that no root is taken."""
    design = DESIGNS[name]
    g, tried = design.degree, 0
    for number, each in enumerate(design.terms):
        n, constant = each.power, Fraction(each.constant)
        # The entry for all mantissas of a step: half of the step's ratio, and the rounding of the entry's word.
        ratio = Fraction((1 + 1 / STEPS) ** (n / g))
        error = (ratio - 1) / (ratio + 1) + Fraction(1, 2 ** (MANTISSA_BITS + 1)) + Fraction(1, 10**9)
        for k in range(design.octaves[0], design.octaves[1] + 1):
            for size in magnitudes(design, 100):
                word = term(design.params, number, size, k)
                exact = constant**g * Fraction(size, 2**design.fraction) ** n * Fraction(2) ** (k * (g - n))
                exact *= Fraction(2) ** (g * each.fraction)
                assert word**g <= exact * (1 + error) ** g
                assert (word + 1) ** g > exact * (1 - error) ** g or size == word == 0
                assert word.bit_length() <= design.widths[number]
                tried += word > 0
    assert tried > 500


@every
def test_widths_are_needed(name):
    widths_are_needed(DESIGNS[name], term)


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    await follow(dut, Powers(DESIGNS[parameters()["name"]]), term, momentary=("size",))


@pytest.mark.parametrize("name", some_of([*DESIGNS], 2))
def test_rtl(name):
    simulate(__file__, lambda name: Powers(DESIGNS[name]), name=name)


def test_a_width_beyond_62_is_refused():
    with pytest.raises(ValueError, match=r"^width must be 1 to 62, not 63$"):
        Design(63, 20, 3, (Term(2, 1.0, 20),), (-4, 4))


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Powers(3)
