"""The scene of the faults: an axis at 12 MHz, and a hand that pushes a handle into a wall."""

import dataclasses

from hardwall.model.axis.registers import RegisterMap
from hardwall.model.axis.supervised import Design
from hardwall.model.spec import AxisSpec
from stimuli.specs import spec

CLOCK_HZ, BAUD = 12_000_000, 3_000_000
SPEC: AxisSpec = dataclasses.replace(
    spec("paper"), clock_hz=CLOCK_HZ, sample_hz=200_000, actuation_hz=100_000, glitch_clocks=None
)
DESIGN, REGISTERS = Design(SPEC), RegisterMap(SPEC)
WORDS = {word.name: word for word in DESIGN.words}
STEP_CLOCKS = SPEC.clocks_per_sample * SPEC.samples_per_actuation
"""The plant's step, over which the pulses of the drive act as their mean."""
CLOCKS_PER_MS = CLOCK_HZ // 1000
PUMP_CLOCKS = CLOCKS_PER_MS // 5
"""The time, 200 us, after which a charge pump without an edge of `alive` has run down: 2.5 of its periods."""

MASS_KG, VISCOUS_N_S_PER_M = 0.35, 1.0
PUSH_N, STIFFNESS_N_PER_M, DAMPING_N_S_PER_M = 11.7, 5e3, 20.0
START, MARK, REST = -5, 0, 100
"""Counts: the handle starts at the first, its index is at the second, and the hand holds it at the third."""
TREMOR_N = 0.5
"""How far the force of a contact that no fault disturbs is from the hand's push, at most."""


def depth(stiffness_n_per_m: float) -> int:
    """Return the counts in a wall at which its spring holds the hand."""
    return round(PUSH_N / stiffness_n_per_m / SPEC.count_m)


DEPTH = depth(STIFFNESS_N_PER_M)
AXES, WRONG = 3, 1
"""The number of axes on the board of several, and the one that something is wrong with."""
SOFTER_N_PER_M = 500.0
"""How much softer the wall of an axis is than that of the one before it."""
TURN = 4000
GLITCH = SPEC.glitch_clocks_at_reset

CLOCK_NS, OSCILLATOR_NS = 10, 22
"""Periods in the simulation, whose time is not that of the scene."""
OSCILLATOR_HZ = CLOCK_HZ * CLOCK_NS / OSCILLATOR_NS

LOOP = 3
"""Clock edges from a pin of a loop, or a synchronised level, to the drive at zero."""
COUNTED = GLITCH + 4
"""Clock edges from a pin of the encoder to the count."""


def words(**values: float) -> dict[str, int]:
    """Return words by name for values in SI units."""
    return {name: WORDS[name].from_si(value) for name, value in values.items()}
