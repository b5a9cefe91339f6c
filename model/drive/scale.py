"""From the drive to steps of a stage's output: a constant gain, rounded to the nearest step, and saturated.

With N the bits of the drive's magnitude, r the force LSB and s the force of a step of the output

    shift = N + 2
    gain  = round(r / s * 2**shift)
    steps = min(floor((magnitude * gain + 2**(shift - 1)) / 2**shift), most)

The gain is wrong by at most half of its LSB: 2**N / 2**(shift + 1) = 1/8 of a step at the largest magnitude. A half is
rounded up. So `steps` is within 5/8 of a step of the drive, in both directions alike.
"""

from typing import NamedTuple

from ..arithmetic.fixed import UQ
from ..checks import FieldError, check_int, check_number, check_range
from ..runtime.compiled import compiled

LATENCY = 2
"""Clocks from a drive to its steps: product, then rounding."""
GUARD_BITS = 2
"""Bits of the gain in addition to the magnitude's: the error is then an eighth of a step."""
GAIN_BITS_MAX = 34
"""The most bits of a gain: its product with the widest magnitude, of 24 bits, and the rounding fit 63 bits."""


class Params(NamedTuple):
    """The gain, the fraction bits of the product, and the most steps."""

    gain: int
    shift: int
    most: int


class State(NamedTuple):
    """The registers: the product and its sign, then the steps and theirs."""

    product: int = 0
    below: int = 0
    steps: int = 0
    negative: int = 0


START = State()


class Design:
    """Formats of the scaling of a drive.

    Args:
        bits: bits of the drive's magnitude.
        steps_per_lsb: steps of the output for a force LSB.
        most: the most steps.

    Attributes:
        magnitude, product, rounded, steps: formats.
        params: for `step`.

    Raises:
        TypeError: if an argument is of the wrong type.
        ValueError: if the gain would be 0, or too wide.
    """

    latency = LATENCY

    def __init__(self, bits: int, steps_per_lsb: float, most: int):
        check_int("bits", bits, 1, 24)
        check_int("most", most, 1, (1 << 32) - 1)
        check_number("steps_per_lsb", steps_per_lsb)
        shift = bits + GUARD_BITS
        check_range("steps_per_lsb", steps_per_lsb, 2.0**-shift, 2.0 ** (GAIN_BITS_MAX - shift - 1))
        gain = round(steps_per_lsb * (1 << shift))
        self.magnitude, self.steps = UQ(bits, 0), UQ(most.bit_length(), 0)
        self.product = UQ(bits + gain.bit_length(), 0)
        largest = self.magnitude.max * gain + (1 << shift - 1) >> shift
        self.rounded = UQ(max(largest.bit_length(), 1), 0)
        self.params = Params(gain, shift, most)


@compiled
def step(params, state, magnitude, negative):
    """Return the state after a clock edge, with the drive's magnitude and sign just before it.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        magnitude: force LSB.
        negative: 1 for a negative drive.
    """
    rounded = (state.product + (1 << (params.shift - 1))) >> params.shift
    return State(magnitude * params.gain, negative, min(rounded, params.most), state.below)


def for_stage(bits: int, lsb_n: float, step_n: float, most: int) -> Design:
    """Return the scaling of a drive for a stage.

    Raises:
        ValueError: if the steps are too coarse or too fine for the force LSB; the message names the full scale.
    """
    try:
        return Design(bits, lsb_n / step_n, most)
    except FieldError:
        low, high = (lsb_n / ratio for ratio in (2.0 ** (GAIN_BITS_MAX - bits - GUARD_BITS - 1), 2.0 ** -(bits + 2)))
        raise FieldError(
            "stage.full_scale",
            f"must make a step of the stage {low:.3g} to {high:.3g} N at this force_resolution_n, not {step_n:.3g} N",
        ) from None
