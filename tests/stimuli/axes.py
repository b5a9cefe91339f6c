"""Axes that sample as fast as they can, and words for them."""

import dataclasses
from contextlib import suppress
from itertools import count

import numpy as np

from hardwall.model.axes.axis import AxesSpec
from hardwall.model.axis.design import Design
from hardwall.model.checks import FieldError
from hardwall.model.estimators import levant, window
from hardwall.model.spec import AxisSpec

from .specs import ADJUSTED, MHZ, spec

SLACK = 12
"""Clocks of every sample after the drive has changed."""


HASTY = levant.Gains(4 * ADJUSTED.lambda_sqrt_m_per_s, 2_000.0)
"""Gains that drive a differentiator to its limits within a few samples."""


def busy(estimator: str, **parts: bool | float) -> AxisSpec:
    """Return an axis that samples nearly as fast as its latency allows, and is moved faster than it is made for.

    Args:
        estimator: name of its estimator.
        parts: what it has beyond the usual parts, by the field of the axis.
    """
    latency = dataclasses.replace(spec("mhz", estimator), **parts).design.latency_to_drive
    gains = ADJUSTED if estimator == "levant" else None
    rates = {"clock_hz": 100_000 * (latency + SLACK), "sample_hz": 100_000, "actuation_hz": 50_000}
    moved = {"speed_max_m_per_s": 0.05, "travel_m": 1e-3}
    return AxisSpec(**{**MHZ, **rates, **moved}, estimator=estimator, gains=gains, **parts)


def with_clocks(axis: AxisSpec, clocks: int) -> AxisSpec:
    """Return an axis at the same rates, with so many clocks a sample."""
    return dataclasses.replace(axis, clock_hz=clocks * axis.sample_hz)


def fastest(axis: AxisSpec) -> AxisSpec:
    """Return an axis at the same rates, with the fewest clocks a sample that it takes."""
    for clocks in count(1):
        with suppress(FieldError):
            return with_clocks(axis, clocks)
    raise AssertionError("there is no such axis")


def random_words(design: Design, random: np.random.Generator) -> dict[str, int]:
    """Return words for a wall that is often hit, and words of every size for the estimator and the limits."""
    words = {word.name: word.reset for word in design.words}
    kind = random.random()
    if kind < 0.2:
        # The estimator follows nothing, and falls behind as far as it can.
        words |= dict.fromkeys((word.name for word in design.estimator.words), 0)
    elif kind < 0.6:
        for word in design.estimator.words:
            some = int(random.integers(0, int(word.format.max * 2.0 ** -random.integers(0, 8)) + 1))
            words[word.name] = min(max(some, word.low), word.high)
    of_all_sizes = "wall_stiffness", "wall_damping", "passivity_damping", "output_force_limit", "output_slew_limit"
    for name, top in ((word.name, word.format.max) for word in design.words if word.name in of_all_sizes):
        words[name] = int(random.integers(0, int(top * 2.0 ** -random.integers(0, 16)) + 1))
    for word in design.mass.words if design.mass else ():
        # Beyond the bound, too.
        words[word.name] = int(random.integers(word.format.min, word.format.max + 1)) >> int(random.integers(0, 12))
    words["wall_position"] = int(random.integers(-30, 30))
    words["wall_left"], words["wall_forbid_pull"] = random.integers(0, 2, 2).tolist()
    if design.wall.coupling:
        least, most, width = design.wall.surface.min, design.wall.surface.max, design.wall.surface.width
        words["wall_velocity"] = int(random.integers(least, most + 1)) >> int(random.integers(0, width))
        words["wall_two_sided"] = int(random.random() < 0.5)
    words["encoder_glitch_clocks"] = int(random.choice([0, 1, 2, 5, 15]))
    words["encoder_invert"] = int(random.random() < 0.2)
    outputs, selector = design.estimator.outputs, design.estimator.output_word()
    if len(outputs) > 1:
        words[selector] = int(random.integers(0, len(outputs)))
    return words


def rota(axes: int, estimator: str, spare: int = 0, window_s: float = 1e-4) -> AxesSpec:
    """Return axes in a rota with that many clocks to spare, each like the axis of `busy`."""
    gains = {"levant": HASTY, "window": window.Gains(window_s)}.get(estimator)
    fields = {**MHZ, "sample_hz": 100_000, "actuation_hz": 50_000, "speed_max_m_per_s": 0.01, "travel_m": 1e-3}
    made = {**fields, "axes": axes, "estimator": estimator, "gains": gains}
    # The clock alone changes no format of the pipeline, and so not the slots either.
    slots = AxesSpec(**{**made, "clock_hz": 100_000_000}).slots
    return AxesSpec(**{**made, "clock_hz": 100_000 * (slots + spare)})
