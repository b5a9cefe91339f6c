"""The steps that every test of a velocity estimator shares: rows of inputs through the model, and through the RTL."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from cocotb.handle import HierarchyObject

from hardwall.hdl.estimators.estimate import EstimatorBlock
from hardwall.model.encoder.quadrature import Seen
from hardwall.model.estimators.acceleration import Accelerated, Motions, Velocities, keep
from hardwall.model.estimators.estimate import EstimatorDesign, estimate
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import Bench, check


def momentary(design: EstimatorDesign) -> tuple[str, ...]:
    """Return the names of the inputs that are taken with the strobe: the decoder's outputs, and the restart."""
    return (*(f"seen__{name}" for name in design.inputs), "restart")


def names(design: EstimatorDesign) -> tuple[str, ...]:
    """Return the names of a row's values, in order: what is taken with the strobe, then the run-time words."""
    return (*momentary(design), *(word.name for word in design.words))


def reset_words(design: EstimatorDesign) -> list[int]:
    """Return the run-time words after reset, in a row's order."""
    return [word.reset for word in design.words]


def outputs(design: EstimatorDesign) -> tuple[str, ...]:
    """Return the names of an estimator's outputs, which are all compared."""
    return (*_kind(design)._fields, "saturated")


def _kind(design: EstimatorDesign) -> type[Velocities | Motions]:
    return Motions if isinstance(design, Accelerated) else Velocities


@compiled
def run(params: tuple, state: tuple, seen: Any, restart: np.ndarray, made: tuple, flags: np.ndarray) -> tuple:
    """Fill `made`, `Velocities` or `Motions`, and `flags` for records of what the decoder shows; return the state."""
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
        state, velocity, flags[k] = estimate(params, state, sight, restart[k])
        keep(made, k, velocity, params, state)
    return state


def model(design: EstimatorDesign, rows: Iterable[tuple[int, ...]], start: tuple) -> dict[str, np.ndarray]:
    """Return the outputs, as `outputs` names them, for rows in the order of `names`, from the state `start`."""
    columns = np.array(list(rows), np.int64).T.copy()
    taken, (restart, *words) = dict(zip(design.inputs, columns, strict=False)), columns[len(design.inputs) :]
    kind = _kind(design)
    zero, flags, *made = (np.zeros_like(restart) for _ in range(2 + len(kind._fields)))
    seen = [taken.get(name, zero) for name in Seen._fields]
    # The kernel runs as long as the run-time words stay.
    changes = np.flatnonzero(sum((word[1:] != word[:-1] for word in words), np.False_)) + 1
    for part in map(slice, [0, *changes], [*changes, len(restart)]):
        held = {word.name: int(values[part.start]) for word, values in zip(design.words, words, strict=True)}
        sight = Seen(*(column[part] for column in seen))
        room = kind(*(each[part] for each in made))
        start = run(design.params(held), start, sight, restart[part], room, flags[part])
    return dict(zip(outputs(design), (*made, flags), strict=True))


async def follow(
    dut: HierarchyObject, component: EstimatorBlock, rows: Iterable[tuple[int, ...]], start: tuple
) -> dict[str, np.ndarray]:
    """Put rows through the RTL, check it against the model exactly, and return the model's outputs.

    They are checked at the next strobe, too, until which they stay.
    """
    design, bench = component.design, Bench(dut, component)
    await bench.reset()
    wanted = outputs(design)
    later = bench.monitor("strobe", *wanted)
    inputs, seen = await bench.campaign("strobe", "valid", names(design), wanted, rows, momentary=momentary(design))
    expected = model(design, inputs.rows, start)
    check(inputs, seen, expected, component.latency)
    check(inputs, later, {name: np.append(0, values[:-1]) for name, values in expected.items()})
    return expected
