"""Helpers that the tests of the linear filters share: whole records through a kernel, impulse responses."""

import numpy as np

from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators.estimate import estimate
from hardwall.model.runtime.compiled import compiled
from hardwall.testing import Bench
from hardwall.testing.estimators import model, outputs

SECONDS = {1_000: 5.0, 10_000: 5.0, 100_000: 2.0, 1_000_000: 1.25, 10_000_000: 0.5}
"""The length of the paper's signal that is run at each rate, s; the first fifth is not judged."""

BLOCK = 4096
"""The samples of an impulse response that are summed at once: few enough for the processor's cache."""


@compiled
def _run(params, state, counts, velocity, flags):
    for k in range(len(counts)):
        state, velocity[k], flags[k] = estimate(params, state, seen_count(counts[k]), 0)
    return state


def run(params, state, counts: np.ndarray):
    """Run a record through a kernel from `state`, and return (state, velocity, flags); counts wrap."""
    width = params.count_width
    half = 1 << (width - 1)
    wrapped = ((np.asarray(counts, np.int64) + half) & (2 * half - 1)) - half
    velocity = np.zeros(len(wrapped), np.float64 if isinstance(params[0], float) else np.int64)
    flags = np.zeros(len(wrapped), np.int64)
    return _run(params, state, wrapped, velocity, flags), velocity, flags


async def starts_afresh(dut, component, words: dict[str, int]) -> None:
    """Reset an estimator amid a motion; from then on it must know nothing of it."""
    bench = Bench(dut, component)
    await bench.reset()
    for count in (0, 1, 2):
        await bench.transact("strobe", "valid", seen__count=count, **words)
    assert bench.reader("velocity")() != 0
    await bench.reset()
    for _ in range(3):
        await bench.transact("strobe", "valid", seen__count=-1, **words)
        assert bench.reader("velocity")() == 0


def equals(oracle, d, rows, start) -> None:
    """Hold the model to an oracle, which yields all outputs of a sample; counts of the rows wrap."""
    half = 1 << (d.count_width - 1)
    rows = [((count + half) % (2 * half) - half, *rest) for count, *rest in rows]
    seen = model(d, rows, start)
    for k, given in enumerate(oracle(d, rows)):
        assert given == tuple(seen[name][k] for name in outputs(d)), f"sample {k}: {rows[k]}"


def impulse(a: np.ndarray, b, samples: int) -> np.ndarray:
    """Return the states b, a b, a^2 b, ... of a linear system as columns, at least `samples` of them."""
    states, power = np.array(b, float).reshape(-1, 1), np.array(a, float)
    while states.shape[1] < samples:
        states, power = np.concatenate([states, power @ states], 1), power @ power
    return states


def norms(a: np.ndarray, b, samples: int) -> np.ndarray:
    """Return the sum of absolute values of every state's impulse response, over at least `samples` samples."""
    states, power, total = impulse(a, b, BLOCK), np.linalg.matrix_power(a, BLOCK), 0.0
    for _ in range(0, samples, BLOCK):
        total = total + np.abs(states).sum(1)
        states = power @ states
    return total


def rms(error: np.ndarray) -> float:
    return float(np.sqrt(np.mean(error**2)))
