"""Curves of a magnitude that are powers in the end, from its leading bits: no multiplication and no division.

For a magnitude a = size 2**-fraction, the term of a curve F is

    2^k F(a 2^-k)

with a whole number k, the octaves, by which a host scales magnitudes and terms at run time. A curve rises, but no
faster than its argument. It has three parts:

- Below 2^first it is a multiple of its argument. The term is this multiple, exactly, rounded down to its word.
- Above, it is read from a table, whose row is an octave of a 2^-k. A row has an entry for each eighth of its octave.
- Far above, where it is nearly a power n / g, a row serves every g-th octave: g octaves more multiply a term by 2^n.

Rounding. An entry stands for all values of its eighth, in all octaves of its row: it is the one with the least relative
error. The values of an eighth differ by 9/8 at most, which makes an error of 1/17 at most. Rows begin to serve several
octaves where this adds to the ratio of the values `ALIKE` at most. The word of an entry has `MANTISSA_BITS` behind its
leading one, so rounding it adds 2**-(MANTISSA_BITS + 1). A shift to the right rounds down. A magnitude of 0 has terms
of 0.

Source: as for `powers`, whose case of pure powers needs no rows.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..checks import check_int
from ..runtime.compiled import compiled
from .fixed import SQ, bits_for, length_of, shift_floor
from .powers import LATENCY, MANTISSA_BITS, STEP_BITS, STEPS

ALIKE = 2.0**-5
"""How much the values of octaves may differ, relatively and scaled by their power, that share a row."""


class Params(NamedTuple):
    """What the kernel needs: see `Design`."""

    fraction: int
    offset: int
    rows: np.ndarray
    """The row of each octave, from 2^first."""
    tables: np.ndarray
    """Line i has the entries of the i-th curve, in the order row, eighth."""
    shifts: np.ndarray
    """Line i has the shifts to the left of the i-th curve's entries by octave, at k = 0."""
    doubles: np.ndarray
    places: np.ndarray
    """The fraction bits of each term."""


class Curve(NamedTuple):
    """One curve: F, twice its multiple below 2^first, its power n far above, and the fraction bits of its term."""

    function: Callable[[float], float]
    double: int
    power: int
    fraction: int


class Design:
    """Tables, shifts and widths.

    Args:
        width: bits of the magnitude.
        fraction: its fraction bits.
        degree: g.
        curves: the curves.
        first: the octave at which the tables begin.
        octaves: the least and the largest k.

    Attributes:
        params: for the kernel.
        octave_format: the format of k.
        lowest, depth: the least number of an octave, and one more than the largest; those below 0 have no row.
        near: bits of the magnitudes that have no row, for some k; 0 if there are none.
        entry_bits: bits of the entries of each curve's table.
        least, most: the least and the largest shift to the left of each curve's entries, with every k.
        widths: bits of each term.
    """

    latency = LATENCY

    def __init__(
        self, width: int, fraction: int, degree: int, curves: tuple[Curve, ...], first: int, octaves: tuple[int, int]
    ):
        check_int("width", width, 1, 62)
        self.width, self.fraction, self.degree, self.curves, self.octaves = width, fraction, degree, curves, octaves
        least, largest = octaves
        self.octave_format = SQ(1 + bits_for(max(-least, largest + 1)), 0)
        # Where no magnitude is as small, the tables begin with the least one.
        base = max(first, -fraction - largest)
        self.lowest = -fraction - largest - base
        self.depth = max(width - fraction - least - base, 1)
        self.near = max(-self.lowest, 0)
        values = [self._values(curve, base) for curve in curves]
        rows = self._rows(values)
        tables, shifts = zip(*(self._table(*each, rows) for each in zip(curves, values, strict=True)), strict=True)
        self.params = Params(
            fraction=fraction,
            offset=-fraction - base,
            rows=np.array(rows, np.int64),
            tables=np.array(tables, np.int64),
            shifts=np.array(shifts, np.int64),
            doubles=np.array([each.double for each in curves], np.int64),
            places=np.array([each.fraction for each in curves], np.int64),
        )
        self.entry_bits = tuple(max(table).bit_length() for table in tables)
        numbers = range(len(curves))
        reached = [(octave, k) for octave in range(self.depth) for k in range(least, largest + 1)]
        self.least = tuple(min(shifts[n][octave] + k for octave, k in reached) for n in numbers)
        self.most = tuple(max(shifts[n][octave] + k for octave, k in reached) for n in numbers)
        # A term rises with the magnitude, so the largest one has the largest terms, at one of the octaves.
        top = (1 << width) - 1
        self.widths = tuple(
            max(int(term(self.params, n, top, k)).bit_length() for k in range(least, largest + 1)) or 1 for n in numbers
        )

    def _values(self, curve: Curve, base: int) -> np.ndarray:
        """Return the curve's values at the ends of every eighth of every octave."""
        ends = [[2.0 ** (base + octave) * (1 + m / STEPS) for m in range(STEPS + 1)] for octave in range(self.depth)]
        return np.array([[curve.function(each) for each in row] for row in ends])

    def _rows(self, values: list[np.ndarray]) -> list[int]:
        """Return the row of each octave: from the first one on from which all curves are alike, every g-th has one."""
        scaled = [
            each / 2.0 ** (curve.power * np.arange(self.depth)[:, None] // self.degree)
            for curve, each in zip(self.curves, values, strict=True)
        ]

        def alike(start: int) -> bool:
            parts = [each[start + rest :: self.degree] for each in scaled for rest in range(self.degree)]
            return all(len(part) < 2 or (part.max(0) <= (1 + ALIKE) * part.min(0)).all() for part in parts)

        start = next(octave for octave in range(self.depth) if alike(octave))
        return [o if o < start else start + (o - start) % self.degree for o in range(self.depth)]

    def _table(self, curve: Curve, values: np.ndarray, rows: list[int]) -> tuple[list[int], list[int]]:
        """Return the entries of a curve, and the shift of each octave."""
        entries, shifts = [], [0] * len(rows)
        for row in range(max(rows) + 1):
            octaves = [octave for octave, its in enumerate(rows) if its == row]
            # The octaves of a row, as if they were its first one.
            gains = [curve.power * (octave - row) // self.degree for octave in octaves]
            alike = np.array([values[octave] / 2.0**gain for octave, gain in zip(octaves, gains, strict=True)])
            low, high = alike[:, :-1].min(0), alike[:, 1:].max(0)
            best = 2 * low * high / (low + high)
            scale = MANTISSA_BITS - math.floor(math.log2(best[0]))
            entries += [round(math.ldexp(each, scale)) for each in best.tolist()]
            for octave, gain in zip(octaves, gains, strict=True):
                shifts[octave] = curve.fraction - scale + gain
        return entries, shifts


@compiled
def term(params, number, size, octaves):
    """Return the word of a term of the magnitude `size`."""
    if size == 0:
        return 0
    place = length_of(size) - 1
    octave = place + params.offset - octaves
    if octave < 0:
        return shift_floor(params.doubles[number] * size, params.fraction + 1 - params.places[number])
    entry = STEPS * params.rows[octave] + (shift_floor(size, place - STEP_BITS) & STEPS - 1)
    return shift_floor(params.tables[number, entry], -params.shifts[number, octave] - octaves)
