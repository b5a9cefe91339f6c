"""The steps that every test of a velocity estimator shares: rows of inputs through the model, and through the RTL."""

from collections.abc import Iterable

import numpy as np

from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.model.estimators.estimate import estimate
from hardwall.model.quadrature import seen_count
from hardwall.testing import Bench, check


def names(design) -> tuple[str, ...]:
    """Return the names of a row's values, in order: the decoder's outputs, the restart, the run-time words."""
    return (*(f"seen__{name}" for name in design.inputs), "restart", *(word.name for word in design.words))


def reset_words(design) -> list[int]:
    """Return the run-time words after reset, in a row's order."""
    return [word.reset for word in design.words]


def model(design, rows: Iterable[tuple[int, ...]], start) -> dict[str, np.ndarray]:
    """Return velocity and flags for rows in the order of `names`, from the state `start`."""
    state, out, n_seen = start, [], len(design.inputs)
    params, held = None, None
    for row in rows:
        restart, words = row[n_seen], row[n_seen + 1 :]
        if words != held:
            params = design.params(dict(zip(names(design)[n_seen + 1 :], words, strict=True)))
            held = words
        seen = seen_count(0)._replace(**dict(zip(design.inputs, row, strict=False)))
        state, velocity, flags = estimate(params, state, seen, restart)
        out.append((velocity, flags))
    velocity, flags = zip(*out, strict=True)
    return {"velocity": np.array(velocity), "saturated": np.array(flags)}


async def follow(dut, component: EstimatorBlock, rows: Iterable[tuple[int, ...]], start) -> dict[str, np.ndarray]:
    """Put rows through the RTL, check it against the model exactly, and return the model's outputs."""
    design, bench = component.design, Bench(dut, component)
    await bench.reset()
    inputs, outputs = await bench.campaign("strobe", "valid", names(design), ("velocity", "saturated"), rows)
    expected = model(design, inputs.rows, start)
    check(inputs, outputs, expected, component.latency)
    return expected
