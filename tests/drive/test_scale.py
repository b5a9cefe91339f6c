"""The scaling of a drive: RTL against model at every clock, and the model against exact rationals."""

from fractions import Fraction

import cocotb
import numpy as np
import pytest

from hardwall.hdl.drive.scale import Scale
from hardwall.model.drive import scale
from hardwall.model.drive.scale import START, Design
from hardwall.testing import SAMPLES, Recorded, check, parameters, play, rng, simulate
from stimuli.lengths import some_of

SIZES = [(16, 0.8192, 1 << 15), (16, 0.00520833, 235), (4, 3.1, 40), (24, 1.999, 33_000_000), (1, 2.5, 2)]
"""Bits of the magnitude, steps for an LSB, and the most steps."""


def make(bits: int, ratio: float, most: int) -> Recorded:
    return Recorded(Scale(Design(bits, ratio, most)))


@cocotb.test()
async def follows_model(dut):
    given = parameters()
    design, random = Design(**{"steps_per_lsb": given["ratio"], "bits": given["bits"], "most": given["most"]}), rng()
    count = SAMPLES // 4
    magnitude = random.integers(0, 1 << given["bits"], count) >> random.integers(0, given["bits"], count)
    magnitude[:4] = (1 << given["bits"]) - 1, 0, 1, 1 << given["bits"] - 1
    columns = {"magnitude": magnitude, "negative": random.integers(0, 2, count), "reset": random.random(count) < 0.01}
    inputs, outputs = await play(dut, make(**given), {k: np.asarray(v, np.int64) for k, v in columns.items()})
    state, rows = START, []
    for reset, size, negative in zip(*(inputs.column(k) for k in ("reset", "magnitude", "negative")), strict=True):
        state = START if reset else scale.step(design.params, state, size, negative)
        rows.append((state.steps, state.negative))
    steps, below = zip(*rows, strict=True)
    check(inputs, outputs, {"steps": steps, "below": below})
    assert len(set(steps)) > 1
    assert set(below) == {0, 1}


@pytest.mark.parametrize(("bits", "ratio", "most"), some_of(SIZES, 0))
def test_rtl(bits, ratio, most):
    simulate(__file__, make, bits=bits, ratio=ratio, most=most)


@pytest.mark.parametrize(("bits", "ratio", "most"), SIZES)
def test_steps_are_within_five_eighths_of_the_drive_and_never_too_many(bits, ratio, most):
    params, exact = Design(bits, ratio, most).params, Fraction(ratio)
    largest = (1 << bits) - 1
    ties = [int((k + Fraction(1, 2)) / exact) + more for k in range(40) for more in (0, 1)]
    sizes = {*range(min(largest, 300)), *range(max(largest - 300, 0), largest + 1), *ties}
    sizes |= set(rng().integers(0, largest + 1, 5000).tolist())
    for size in (each for each in sizes if each <= largest):
        state = scale.step(params, scale.step(params, START, size, 1), 0, 0)
        assert state.negative == 1
        wanted = min(size * exact, most)
        assert abs(state.steps - wanted) <= Fraction(5, 8)
        assert state.steps <= most
    full = scale.step(params, scale.step(params, START, largest, 0), 0, 0)
    assert (full.steps == most) == (largest * exact + Fraction(5, 8) >= most)


def test_a_half_is_rounded_up():
    params = Design(4, 0.5, 15).params
    assert [scale.step(params, scale.step(params, START, size, 0), 0, 0).steps for size in range(5)] == [0, 1, 1, 2, 2]


def test_wrong_sizes_are_refused():
    with pytest.raises(ValueError, match=r"^bits must be 1 to 24, not 25$"):
        Design(25, 1.0, 9)
    with pytest.raises(ValueError, match=r"^most must be 1 to 4294967295, not 0$"):
        Design(4, 1.0, 0)
    with pytest.raises(ValueError, match=r"^steps_per_lsb must be 0.015625 to 1.34218e\+08, not 0.01$"):
        Design(4, 0.01, 9)
    with pytest.raises(
        ValueError, match=r"^stage.full_scale must make a step of the stage .* to 0.064 N at .*not 0.1 N$"
    ):
        scale.for_stage(4, 1e-3, 0.1, 9)
    with pytest.raises(TypeError, match=r"not 3$"):
        Scale(3)
