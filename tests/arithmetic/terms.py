"""Helpers that the tests of powers and curves share: magnitudes, and a campaign over them with every octave."""

from collections.abc import Callable

import numpy as np
from cocotb.handle import HierarchyObject

from hardwall.hdl.arithmetic.powers import Powers
from hardwall.model.arithmetic.powers import STEPS, Design
from hardwall.testing import SAMPLES, Bench, check, rng


def magnitudes(design: Design, samples: int) -> list[int]:
    """Return magnitudes at and beside every power of two, every end of a step, and of every length."""
    top = (1 << design.width) - 1
    edges = {each for n in range(design.width + 1) for each in ((1 << n) - 1, 1 << n, (1 << n) + 1)}
    steps = {(STEPS + m << n) + each for n in range(design.width - 4) for m in range(STEPS) for each in (-1, 0)}
    drawn = (rng().integers(0, 1 << 62, samples) >> rng().integers(62 - design.width, 62, samples)).tolist()
    return [each for each in sorted(edges | steps) if 0 <= each <= top] + drawn


def widths_are_needed(design: Design, term: Callable[..., int]) -> None:
    """Check that the largest magnitude has a term as wide as its word, for each term."""
    top, octaves = (1 << design.width) - 1, range(design.octaves[0], design.octaves[1] + 1)
    for number, width in enumerate(design.widths):
        assert max(term(design.params, number, top, k) for k in octaves).bit_length() == width


async def follow(
    dut: HierarchyObject, component: Powers, term: Callable[..., int], momentary: tuple[str, ...] = ()
) -> None:
    """Put magnitudes with every octave through the RTL, and hold its terms to the model's."""
    design, bench = component.design, Bench(dut, component)
    await bench.reset()
    sizes = magnitudes(design, SAMPLES // 20)
    rows = [(size, k) for k in range(design.octaves[0], design.octaves[1] + 1) for size in sizes]
    names = [f"term_{number}" for number in range(len(design.widths))]
    starts, terms = await bench.campaign("start", "done", ("size", "octaves"), names, rows, momentary=momentary)
    expected = {
        name: np.array([term(design.params, number, size, k) for size, k in starts.rows])
        for number, name in enumerate(names)
    }
    check(starts, terms, expected, component.latency)
