"""The tables of `edge_kalman`: limits by the error of an edge and the time, gains by the time and the memory.

`edge_kalman` defines the symbols T, M, r, v, a and D. q is a count, s the error of an edge (counts), J and C are the
bounds on jerk and acceleration.

The rule. A memory M averages over the M / T edges in it, so the place of the axis is known to about s sqrt(T / M).
Within M the motion may change unforeseen: by J M**3 through its jerk, and at an impact by C M**2 through a jump of its
acceleration. At each of the two memories, this change is a constant share of the place's error:

    J M_quiet**3 = QUIET s q sqrt(T / M_quiet)            C M_agile**2 = AGILE s q sqrt(T / M_agile)

and M_agile is at most M_quiet. Neither is below T / 2. The shares, ALARM, GROWTH and what decides on the error were
chosen by measurement, with the impact's C and the jerk of the paper's swing. They are the same for every axis.

T is known by its top two bits, that is to half an octave: a row stands for the times from 2 to 3, or from 3
to 4, times a power of two. It is computed for the geometric middle, sqrt(3/2) / 2 * 2**(row / 2) units. A memory is
counted in the same half octaves, with MEMORY_BITS fraction bits; the nearest whole one gives the gains.

`limits`, by the number of halvings of the edge's error and the row of T:

- `blend` UQ(0, 16): the share of r in the mean z. It is T's share of an agile memory.
- `alarm`, 18 bits: the bound on |z|. In the steady state r has the variance s**2 / (1 - K_x), and is white.
- `usual`, 18 bits: the mean of |r|, sqrt(2 / pi) s / sqrt(1 - K_x). Both take the K_x of the quiet memory.
- `quiet` and `agile` UQ(6, 4): the memories.

`gains`, by T / M to half an octave, and by the parity of the memory's half octaves:

- `grow` UQ(1, 16): the growth of the memory over T, in half octaves.
- `kx` UQ(0, 18). The gains belong to the steady state at constant T (`riccati`), for a bandwidth of T / M a sample.
- `kv` and `ka` UQ(1, 11): K_v M / K_x and K_a M / K_v, which are almost constant. Each is shifted by the whole octaves
  of M into a word of GAIN_BITS bits, a rate. So v is corrected by a share of the place's correction, and a by a share
  of v's.

K_v T and K_a T**2 are too large by up to 1.22 and 1.5 at a row's longest T. The filter tolerates this for T up to 2.6
M, and diverges from 2.8 M on. For ever rarer edges the gains of a white jerk go to K_v T = 1.73 and K_a T**2 = 1.49.
The last three edges give 1.5 and 1. With M at least T / INDEX_MAX they end at 1.46 and 1.08.
"""

import math
from functools import cache
from typing import NamedTuple

import numpy as np

from ..arithmetic.fixed import UQ, bits_for
from .riccati import steady_state

QUIET = 1.6
"""The largest change of place by the jerk within the quiet memory, in errors of the place."""
AGILE = 28.0
"""The largest change of place by the acceleration within the agile memory, in errors of the place."""
ALARM = 4.0
"""The mean of r that raises an alarm, in its own standard deviations."""
GROWTH = 0.125
"""The growth of the memory per time, below 1: the memory never reaches back beyond the alarm."""
INDEX_MAX = 2.0
"""The largest T / M of the gains: at this one the filter is stable, with some room, over all times of a row."""
HALVINGS = 7
"""The most halvings of an edge's error, where it is learned."""
LEARN_BITS = 7
"""An edge has 2**-LEARN_BITS of the share of the edges with an innovation larger than usual."""
SHARE_BITS = 12
"""Fraction bits of this share."""
USUAL_SHARE, WORSE, BETTER = 1792, 2560, 640
"""The share that a change begins with, and those above and below which the error is doubled and halved."""
MEMORY_BITS = 16
"""Fraction bits of a memory, which is counted in half octaves."""
BLEND, ALARM_AT, USUAL, QUIET_AT, AGILE_AT = range(5)
"""The columns of `limits`."""
LIMIT_WIDTHS = 16, 18, 18, 10, 10
"""Bits of their words."""
LENGTH = UQ(6, 4)
"""The format of a memory in the table."""
GROW, KX, KV, KA = range(4)
"""The columns of `gains`."""
GAIN_FORMATS = UQ(1, 16), UQ(0, 18), UQ(1, 11), UQ(1, 11)
GAIN_ROWS = 64
"""The values of T / M: from INDEX_MAX down, by half octaves."""
GAIN_BITS = 24
"""Bits of a rate, which `kv` and `ka` are shifted to."""


class Times(NamedTuple):
    """The times of an axis: a unit, s; the bits of a stamp, in units; the units in a sample."""

    unit_s: float
    bits: int
    per_sample: float


def middles(rows: np.ndarray | int) -> np.ndarray:
    """Return the geometric middle of the times of a row, units: from 2 to 3, or from 3 to 4, times a power of two."""
    return math.sqrt(1.5) / 2 * 2.0 ** (np.asarray(rows) / 2)


def memories(
    errors_counts: np.ndarray, jerk_counts_per_s3: float, acceleration_counts_per_s2: float, times: Times
) -> tuple[np.ndarray, np.ndarray]:
    """Return the quiet and the agile memory for errors of the shape (any, rows), s."""
    times_s = middles(np.arange(errors_counts.shape[-1])) * times.unit_s
    error = errors_counts * np.sqrt(times_s)
    quiet = (QUIET * error / jerk_counts_per_s3) ** (2 / 7)
    agile = (AGILE * error / acceleration_counts_per_s2) ** (2 / 5)
    least = np.maximum(times.unit_s, times_s / INDEX_MAX)
    quiet = np.clip(quiet, least, times.unit_s * 2.0 ** (times.bits - 1))
    return quiet, np.clip(agile, least, quiet)


def limits(
    errors_counts: np.ndarray, jerk_counts_per_s3: float, acceleration_counts_per_s2: float, times: Times
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the quiet and the agile memory, s, and the table `limits`, unrounded.

    Args:
        errors_counts: the RMS errors of an edge, shape (halvings, rows).
        jerk_counts_per_s3, acceleration_counts_per_s2: the bounds on the motion.
        times: the times of the axis.
    """
    quiet_s, agile_s = memories(errors_counts, jerk_counts_per_s3, acceleration_counts_per_s2, times)
    times_s = middles(np.arange(errors_counts.shape[-1])) * times.unit_s
    blend = -np.expm1(-times_s / agile_s)
    kx = [steady_state(index)[0] for index in (times_s / quiet_s).ravel().tolist()]
    free = np.maximum(1 - np.reshape(kx, errors_counts.shape), np.finfo(float).eps)
    deviation = errors_counts / np.sqrt(free) * times.per_sample
    alarm = ALARM * deviation * np.sqrt(blend / (2 - blend))
    lengths = [2 * np.log2(memory / times.unit_s / middles(0)) for memory in (quiet_s, agile_s)]
    columns = blend, alarm, math.sqrt(2 / math.pi) * deviation, *lengths
    return quiet_s, agile_s, np.stack([column.ravel() for column in columns], 1)


def limit_formats(rates: np.ndarray, times: Times) -> tuple[UQ, ...]:
    """Return the formats of the columns of `limits`: times in use have a bit less than a stamp."""
    used = rates.reshape(-1, 1 << bits_for(2 * times.bits), rates.shape[1])[:, : 2 * times.bits]
    integer = {BLEND: 0, QUIET_AT: LENGTH.i, AGILE_AT: LENGTH.i}
    for column in (ALARM_AT, USUAL):
        top, least = float(used[..., column].max()), float(used[..., column].min())
        # The least is resolved to an eighth. A bound beyond the format is held at its end.
        integer[column] = min(bits_for(top), LIMIT_WIDTHS[column] - 3 + bits_for(least))
    return tuple(UQ(integer[n], width - integer[n]) for n, width in enumerate(LIMIT_WIDTHS))


@cache
def gain_rates() -> np.ndarray:
    """Return the table `gains`, unrounded; a row's number is INDEX_MAX M / T in half octaves, then M's parity."""
    index = INDEX_MAX * 2.0 ** (-np.arange(GAIN_ROWS) / 2)
    gain = np.array([steady_state(each) for each in index.tolist()])
    grow = 2 * GROWTH / math.log(2) * index
    rates = gain[:, 1:] / gain[:, :-1] / index[:, None]
    # The words of M's parity: 1 / M is 2**(-parity / 2) / middles(0), but for whole octaves.
    parity = 2.0 ** (-np.arange(2) / 2) / middles(0)
    columns = [np.repeat(column, 2) for column in (grow, gain[:, 0])]
    return np.stack([*columns, *(np.outer(column, parity).ravel() for column in rates.T)], 1)


@cache
def gain_words() -> np.ndarray:
    """Return the words of `gains`."""
    table = words(gain_rates(), GAIN_FORMATS)
    # A memory that grows at all comes to its end.
    table[:, GROW] = np.maximum(table[:, GROW], 1)
    return table


def words(rates: np.ndarray, formats: tuple[UQ, ...]) -> np.ndarray:
    """Return the words of a table's columns, rounded half up, and held within their formats."""
    columns = [np.clip(np.floor(rates[:, n] * 2.0**fmt.f + 0.5), 0, fmt.max) for n, fmt in enumerate(formats)]
    return np.stack(columns, 1).astype(np.int64)


def whole_octaves(length: int) -> int:
    """Return the whole octaves of a memory of the table, to the nearest half octave."""
    return (length + (1 << (LENGTH.f - 1)) >> LENGTH.f) // 2
