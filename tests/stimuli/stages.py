"""Axes with each of the drive stages, of several sizes, for tests."""

import random as plain
from dataclasses import replace

import numpy as np

from hardwall.model.drive import dac, pdm, pwm
from hardwall.model.drive.stage import Amplifier, Stage
from hardwall.model.spec import AxisSpec
from hardwall.testing import SEED

from .specs import spec

STAGES: dict[str, tuple[str, Stage]] = {
    "pdm": ("mhz", pdm.Stage()),
    "pdm narrow": ("narrow", pdm.Stage()),
    "pdm scaled": ("mhz", pdm.Stage(amplifier=Amplifier(unit="V", newtons_per_unit=6.4, full_scale=10.0))),
    # 48 N at a supply of 24 V, and 250 clocks a period, of which 5 are dead.
    "pwm": (
        "mhz",
        pwm.Stage(
            amplifier=Amplifier(unit="V", newtons_per_unit=2.0, full_scale=24.0), pwm_hz=200_000, dead_time_s=100e-9
        ),
    ),
    # The shortest dead time, and about as few steps as there may be.
    "pwm narrow": (
        "narrow",
        pwm.Stage(
            amplifier=Amplifier(unit="A", newtons_per_unit=1.0, full_scale=1.3, inverted=True),
            pwm_hz=50_000_000 // 16,
            dead_time_s=1e-9,
        ),
    ),
    # So short a period that a counterexample of a proof need not be long.
    "pwm brief": (
        "narrow",
        pwm.Stage(
            amplifier=Amplifier(unit="V", newtons_per_unit=1.0, full_scale=2.5), pwm_hz=5_000_000, dead_time_s=40e-9
        ),
    ),
    # As an AD5761: 8 bits of command, 16 of code, taken at the falling edge of a clock that rests low.
    "dac": (
        "mhz",
        dac.Stage(
            amplifier=Amplifier(unit="V", newtons_per_unit=4.0, full_scale=10.0),
            bits=16,
            serial_hz=25_000_000,
            header_bits=8,
            header=3,
            mode=1,
            setup=(0x0F0000, 0x040268),
        ),
    ),
    # As an AD5542A, and with an offset: 16 bits, taken at the rising edge.
    "dac bare": (
        "paper",
        dac.Stage(
            amplifier=Amplifier(unit="A", newtons_per_unit=9.0, full_scale=5.0, offset=-0.3),
            bits=16,
            serial_hz=3_000_000,
        ),
    ),
    "dac narrow": (
        "narrow",
        dac.Stage(
            amplifier=Amplifier(unit="V", newtons_per_unit=1.0, full_scale=1.05, offset=0.04),
            bits=6,
            serial_hz=10_000_000,
            coding="twos-complement",
            header_bits=2,
            header=1,
            trailing_bits=3,
            mode=2,
        ),
    ),
    "dac high": (
        "narrow",
        dac.Stage(
            amplifier=Amplifier(unit="V", newtons_per_unit=1.0, full_scale=1.0),
            bits=4,
            serial_hz=25_000_000,
            trailing_bits=1,
            mode=3,
            setup=(31,),
        ),
    ),
}
"""Stages by a name, with the axis that each is of."""


def axis(name: str) -> AxisSpec:
    """Return the axis with a stage."""
    of, stage = STAGES[name]
    return replace(spec(of), stage=stage)


def drives(bits: int, most: int, clocks: int, mean_clocks: int) -> dict[str, np.ndarray]:
    """Return magnitude, sign, state and permission at every clock: extremes and random ones, for long and short.

    Args:
        bits: bits of the magnitude.
        most: the largest drive of the axis.
        clocks: how many.
        mean_clocks: about how long a drive lasts.
    """
    random = plain.Random(SEED)
    largest = (1 << bits) - 1
    rows: dict[str, list[int]] = {name: [] for name in ("magnitude", "negative", "armed", "permitted", "reset")}
    armed = permitted = 1
    while len(rows["magnitude"]) < clocks:
        held = random.choice((1, 2, random.randint(1, 2 * mean_clocks), random.randint(1, 4 * mean_clocks)))
        magnitude = random.choice(
            (
                0,
                1,
                most,
                largest,
                random.randint(0, most),
                random.randint(0, largest),
                random.getrandbits(bits) >> bits // 2,
            )
        )
        armed = int(random.random() < (0.9 if armed else 0.6))
        permitted = int(random.random() < (0.95 if permitted else 0.5))
        reset = int(random.random() < 0.01)
        drawn = (magnitude, random.getrandbits(1), armed, permitted, reset)
        for name, value in zip(rows, drawn, strict=True):
            rows[name] += [value] * (min(held, 3) if reset else held)
    return {name: np.array(values[:clocks]) for name, values in rows.items()}
