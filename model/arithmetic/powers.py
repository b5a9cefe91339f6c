"""Fractional powers of a magnitude, times constants, from its leading bits: no multiplication and no division.

For a magnitude a = size 2**-fraction and a degree g, the term of power n (1 to g - 1) is

    c_n a^(n/g) 2^(k (g - n) / g)

with constants c_n and a whole number k, the octaves, by which a host scales all terms at run time. (A sliding-mode
differentiator whose Lipschitz bound L is doubled has its n-th correction multiplied by 2^((g - n) / g).)

The place P of the leading one of `size` and the three bits below it give log2 a to an eighth of an octave's mantissa.
With D = P - fraction - k, its quotient Q and rest R of the division by g,

    term = 2^(n Q + k) * table_n[R, three bits],      table_n[R, m] = c_n 2^(n R / g) (1 + (m + 1/2) / 8)^(n/g)

so a term is an entry of a table of 8 g, shifted. D is made positive by a multiple of g.

Rounding. An entry stands for all mantissas of an eighth: it is the one with the least relative error, which is below
(n / g) / 16. Its word has `MANTISSA_BITS` behind its leading one, at least, so rounding it adds
2**-(MANTISSA_BITS + 1). A shift to the right rounds down. A magnitude of 0 has terms of 0.

Source: splitting a number into its octave and what is left is how tables of logarithms have always been read; the
arithmetic here is this project's own.
"""

import math
from typing import NamedTuple

import numpy as np

from ..checks import check_int
from ..runtime.compiled import compiled
from .fixed import SQ, bits_for, length_of, shift_floor

MANTISSA_BITS = 6
"""Bits of the least entry of a table behind its leading one."""
STEP_BITS = 3
"""Bits of the magnitude behind its leading one that are used."""
STEPS = 1 << STEP_BITS
LATENCY = 4
"""Clocks from a magnitude to its terms: two for its leading bits, one for the tables, one for the shifts."""


class Params(NamedTuple):
    """What the kernel needs: see `Design`."""

    degree: int
    offset: int
    tables: np.ndarray
    """Row i has the entries of the i-th term, in the order R, three bits."""
    powers: np.ndarray
    shifts: np.ndarray
    """The shift to the left of each term at Q = 0 and k = 0."""


class Term(NamedTuple):
    """One term: its power n, its constant c_n, and the fraction bits of its word."""

    power: int
    constant: float
    fraction: int


class Design:
    """Tables, shifts and widths.

    Args:
        width: bits of the magnitude.
        fraction: its fraction bits.
        degree: g.
        terms: the terms.
        octaves: the least and the largest k.

    Attributes:
        params: for the kernel.
        octave_format: the format of k.
        depth: one more than the largest D.
        entry_bits: bits of the entries of each term's table.
        most: the largest shift to the left of each term.
        widths: bits of each term.
    """

    latency = LATENCY

    def __init__(self, width: int, fraction: int, degree: int, terms: tuple[Term, ...], octaves: tuple[int, int]):
        check_int("width", width, 1, 62)
        self.width, self.fraction, self.degree, self.terms, self.octaves = width, fraction, degree, terms, octaves
        least, largest = octaves
        self.octave_format = SQ(1 + bits_for(max(-least, largest + 1)), 0)
        # The least multiple of the degree that no D is below.
        base = -(-(fraction + largest) // degree) * degree
        self.depth = width - 1 - fraction - least + base + 1
        scales = [MANTISSA_BITS - math.floor(math.log2(term.constant)) for term in terms]
        tables = [self._table(term, scale) for term, scale in zip(terms, scales, strict=True)]
        shifts = [t.fraction - scale - t.power * base // degree for t, scale in zip(terms, scales, strict=True)]
        self.params = Params(
            degree=degree,
            offset=base - fraction,
            tables=np.array(tables, np.int64),
            powers=np.array([term.power for term in terms], np.int64),
            shifts=np.array(shifts, np.int64),
        )
        self.entry_bits = tuple(max(table).bit_length() for table in tables)
        # The largest magnitude has the largest terms, at one of the octaves.
        ends = [(*divmod(width - 1 + base - fraction - k, degree), k) for k in range(least, largest + 1)]
        self.most = tuple(
            max(term.power * quotient + k for quotient, _, k in ends) + shift
            for term, shift in zip(terms, shifts, strict=True)
        )
        self.widths = tuple(
            max(
                int(math.ldexp(table[STEPS * rest + STEPS - 1], term.power * quotient + k + shift)).bit_length()
                for quotient, rest, k in ends
            )
            or 1
            for term, table, shift in zip(terms, tables, shifts, strict=True)
        )

    def _table(self, term: Term, scale: int) -> list[int]:
        """Return the entries of a term, with `scale` fraction bits."""
        share = term.power / self.degree
        entries = []
        for rest in range(self.degree):
            for step in range(STEPS):
                low, high = ((1 + each / STEPS) ** share for each in (step, step + 1))
                value = 2 * low * high / (low + high)
                entries.append(round(term.constant * 2.0 ** (share * rest + scale) * value))
        return entries


@compiled
def place_of(params, size, octaves):
    """Return (Q, the entry's number) of a magnitude that is not 0."""
    place = length_of(size) - 1
    octave = place + params.offset - octaves
    return octave // params.degree, STEPS * (octave % params.degree) + (
        shift_floor(size, place - STEP_BITS) & STEPS - 1
    )


@compiled
def term(params, number, size, octaves):
    """Return the word of a term of the magnitude `size`."""
    if size == 0:
        return 0
    quotient, entry = place_of(params, size, octaves)
    shift = params.powers[number] * quotient + octaves + params.shifts[number]
    return shift_floor(params.tables[number, entry], -shift)
