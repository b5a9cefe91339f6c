"""The steps of `estimators` for an estimator that has an acceleration: it is compared at every sample, too."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from cocotb.handle import HierarchyObject

from hardwall.hdl.estimators.acceleration import AcceleratedBlock
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.acceleration import Accelerated, acceleration_of
from hardwall.model.estimators.estimate import estimate
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import Bench, check

from .estimators import momentary, names

OUTPUTS = "velocity", "acceleration", "saturated"


@compiled
def run(params: tuple, state: tuple, seen: Any, restart: np.ndarray, made: tuple) -> tuple:
    """Fill the arrays of `made`, as `OUTPUTS`, for records of what the decoder shows; return the last state."""
    velocity, acceleration, flags = made
    for k in range(len(restart)):
        sight = Seen(
            seen.count[k],
            seen.stamp[k],
            seen.stamp_a_rise[k],
            seen.stamp_b_rise[k],
            seen.stamp_a_fall[k],
            seen.stamp_b_fall[k],
            seen.edge[k],
            seen.down[k],
            seen.run[k],
        )
        state, velocity[k], flags[k] = estimate(params, state, sight, restart[k])
        acceleration[k] = acceleration_of(params, state)
    return state


def model(design: Accelerated, rows: Iterable[tuple[int, ...]], start: tuple) -> dict[str, np.ndarray]:
    """Return the outputs, as `OUTPUTS`, for rows in the order of `estimators.names`, from the state `start`."""
    columns = np.array(list(rows), np.int64).T.copy()
    taken, (restart, *words) = dict(zip(design.inputs, columns, strict=False)), columns[len(design.inputs) :]
    zero, *made = (np.zeros_like(restart) for _ in range(1 + len(OUTPUTS)))
    seen = [taken.get(name, zero) for name in Seen._fields]
    # The kernel runs as long as the run-time words stay.
    changes = np.flatnonzero(sum((word[1:] != word[:-1] for word in words), np.False_)) + 1
    for part in map(slice, [0, *changes], [*changes, len(restart)]):
        held = {word.name: int(values[part.start]) for word, values in zip(design.words, words, strict=True)}
        sight = Seen(*(column[part] for column in seen))
        start = run(design.params(held), start, sight, restart[part], tuple(each[part] for each in made))
    return dict(zip(OUTPUTS, made, strict=True))


async def follow(
    dut: HierarchyObject, component: AcceleratedBlock, rows: Iterable[tuple[int, ...]], start: tuple
) -> dict[str, np.ndarray]:
    """Put rows through the RTL, check it against the model exactly, and return the model's outputs.

    They are checked at the next strobe, too, until which they stay.
    """
    design, bench = component.design, Bench(dut, component)
    await bench.reset()
    later = bench.monitor("strobe", *OUTPUTS)
    inputs, outputs = await bench.campaign("strobe", "valid", names(design), OUTPUTS, rows, momentary=momentary(design))
    expected = model(design, inputs.rows, start)
    check(inputs, outputs, expected, component.latency)
    check(inputs, later, {name: np.append(0, values[:-1]) for name, values in expected.items()})
    return expected
