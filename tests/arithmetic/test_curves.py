"""Curves of a magnitude: RTL against model, and the model against exact rationals."""

from fractions import Fraction

import cocotb
import pytest
from terms import follow, magnitudes, widths_are_needed

from hardwall.hdl.arithmetic.curves import Curves
from hardwall.model.arithmetic.curves import ALIKE, MANTISSA_BITS, STEPS, Curve, Design, term
from hardwall.testing import CAMPAIGN, parameters, simulate
from stimuli.lengths import some_of


def flat(a):
    """Return a up to 1, and 1 above: its power is 0."""
    return a if a < 1 else a / a


def bent(a):
    """Return 3/2 a up to 1, and above it a line of half the slope: its power is 1."""
    return 3 * a / 2 if a < 1 else 3 * (a + 1) / 4


def pair(degree: int, fraction: int, more: int) -> tuple[Curve, ...]:
    return Curve(flat, 2, 0, fraction + more), Curve(bent, 3, degree, fraction + 1)


DESIGNS = {
    "both": Design(30, 18, 3, pair(3, 18, 5), 0, (-4, 4)),
    "fine": Design(38, 22, 4, pair(4, 22, 30), 0, (-4, 0)),
    "coarse": Design(9, 4, 3, pair(3, 4, -3), 0, (-2, 1)),
    "never-near": Design(12, 0, 2, (Curve(bent, 0, 2, 3),), -20, (-4, -1)),
    "always-near": Design(6, 9, 3, pair(3, 9, 0), 0, (-1, 1)),
}
every = pytest.mark.parametrize("name", DESIGNS)


@every
def test_no_term_is_further_from_the_exact_curve_than_derived(name):
    design, near, far = DESIGNS[name], 0, 0
    # The values of a step differ by its own ratio, and by that of the octaves that share a row.
    ratio = (1 + Fraction(1, STEPS)) * (1 + Fraction(ALIKE))
    error = (ratio - 1) / (ratio + 1) + Fraction(1, 2 ** (MANTISSA_BITS + 1)) + Fraction(1, 10**9)
    for number, each in enumerate(design.curves):
        for k in range(design.octaves[0], design.octaves[1] + 1):
            for size in magnitudes(design, 100):
                word = term(design.params, number, size, k)
                argument = Fraction(size, 2**design.fraction) / Fraction(2) ** k
                exact = each.function(argument) * Fraction(2) ** (k + each.fraction) if size else Fraction(0)
                assert word.bit_length() <= design.widths[number]
                if argument < 1 and design.near:
                    assert word == exact.__floor__()
                    near += word > 0
                    continue
                assert exact * (1 - error) - 1 < word <= exact * (1 + error)
                far += word > 0
    assert near > 100 or name == "never-near"
    assert far > 100 or name == "always-near"


@every
def test_widths_are_needed(name):
    widths_are_needed(DESIGNS[name], term)


def test_rows_end_where_the_curves_are_alike():
    design = DESIGNS["both"]
    rows = design.params.rows.tolist()
    kept = max(rows) + 1
    assert rows[:kept] == [*range(kept)]
    assert rows[kept:] == [kept - 3 + (each % 3) for each in range(len(rows) - kept)]
    # (a + 1) / a is within ALIKE of 1 from 2^5 on, and not before.
    assert kept == 5 + 3


@cocotb.test(**CAMPAIGN)
async def follows_model(dut):
    await follow(dut, Curves(DESIGNS[parameters()["name"]]), term)


@pytest.mark.parametrize("name", some_of([*DESIGNS], 0))
def test_rtl(name):
    simulate(__file__, lambda name: Curves(DESIGNS[name]), name=name)


def test_a_width_beyond_62_is_refused():
    with pytest.raises(ValueError, match=r"^width must be 1 to 62, not 63$"):
        Design(63, 20, 3, pair(3, 20, 0), 0, (-4, 4))


def test_wrong_design_is_refused():
    with pytest.raises(TypeError, match=r"not 3$"):
        Curves(3)
