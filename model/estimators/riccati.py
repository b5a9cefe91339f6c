"""Steady-state gains of a Kalman filter of integrators driven by white noise, from its bandwidth alone."""

import math

import numpy as np

INDEX_MAX = 64.0
"""From this bandwidth a sample on, the gains are the limits for an infinite bandwidth."""


def steady_state(index: float, integrators: int = 3) -> tuple[float, float, float]:
    """Return K_x, K_v and K_a for a bandwidth of `index` a sample; K_a = 0 for two integrators.

    The discrete Riccati equation of the filter is solved by structure-preserving doubling. The noise is white with
    density 1, as the last state's derivative; time is in units of the bandwidth. Every iteration squares the number of
    samples seen. No cancellation occurs, however small the index is.
    """
    h = min(index, INDEX_MAX)
    n = integrators
    power = np.subtract.outer(-np.arange(n), -np.arange(n))
    factorial = np.array([1.0, 1.0, 2.0])
    a = np.where(power >= 0, h ** np.maximum(power, 0) / factorial[np.maximum(power, 0)], 0.0)
    down = n - 1 - np.arange(n)
    order = np.add.outer(down, down) + 1
    p = h**order / (order * np.multiply.outer(factorial[down], factorial[down]))
    noise = 1 / h
    f, g = a.T, np.zeros((n, n))
    g[0, 0] = 1 / noise
    change = math.inf
    while change > 1e-15:
        solved = np.linalg.solve(np.eye(n) + g @ p, np.concatenate([f, g], 1))
        more = f.T @ p @ solved[:, :n]
        change = np.abs(more).max() / np.abs(p).max()
        p, g, f = p + more, g + f @ solved[:, n:] @ f.T, f @ solved[:, :n]
    gains = p[:, 0] / (p[0, 0] + noise) * h ** np.arange(n)
    return (*gains.tolist(), 0.0)[:3]
