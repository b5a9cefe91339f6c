"""Where the edges of an encoder really stand: a map of the scale's error, in bins.

Twin of `hardwall.hdl.encoder.scale_map`.

Edge n of an encoder stands at n + e(n) counts. The map has one word e for each bin of 2**`bin_bits` edges, from edge
`first` on. The host writes it; it is zero before that, and the axis only reads it. `scale_fit` learns it.

    bin = floor((n - first) / 2**bin_bits), at least 0 and at most the last;  e = places[bin]

An edge `outside` the bins has the error of the nearest bin, so that there is no step at their ends. A count that wraps
does so outside. Edges are numbered by the count, so a map holds only while the count is referenced. A reader of the map
has an input `enabled` for this; without it every error is 0. If the origin is shifted while the map holds, the numbers
of all edges change. n is then the number less that shift (`unshifted`), so an edge keeps its bin.

Formats. `place` SQ(i, FRACTION_BITS) in counts: i holds `limit_counts`, to which errors saturate. Rounding to a 64th
gives 0.0045 counts RMS: a tenth of an edge error of 0.05 counts. The width of a bin costs more: an error that changes
by g counts an edge is off by g 2**bin_bits / sqrt(12).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from ..arithmetic.fixed import SQ, bits_for, wrap
from ..checks import FieldError, check_int, check_number, check_range
from ..runtime.compiled import compiled

FRACTION_BITS = 6
"""Fraction bits of an error, in counts."""
BINS_MAX = 1 << 20
LIMITS_COUNTS = 2.0**-FRACTION_BITS, 1e4
LATENCY = 2
"""Clocks from an edge's number to its error: the bin's number, and the memory."""


class Params(NamedTuple):
    """The bins of a map and their errors: words, or counts in float64."""

    first: int
    bin_bits: int
    places: np.ndarray


class Place(NamedTuple):
    """The error of an edge, and whether the edge is outside the bins."""

    error: float
    outside: int


def nothing(floating: bool = False) -> Params:
    """Return a map of no error anywhere."""
    return Params(0, 0, np.zeros(1, np.float64 if floating else np.int64))


@compiled
def unshifted(number, origin, count_width):
    """Return the number of an edge on the map, whose origin was shifted by `origin` counts since the map held."""
    return wrap(number - origin, count_width)


@compiled
def bin_of(params, number):
    """Return the bin of an edge's number, as if the bins had no ends."""
    return (number - params.first) >> params.bin_bits


@compiled
def place_of(params, number):
    """Return the `Place` of an edge."""
    wanted, last = bin_of(params, number), len(params.places) - 1
    held = min(max(wanted, 0), last)
    return Place(params.places[held], int(wanted != held))


class Design:
    """The bins and the formats of a map.

    Args:
        count_width: bits of the count.
        first: the number of the first bin's first edge.
        bin_bits: log2 of the edges in a bin.
        bins: how many bins there are.
        limit_counts: the largest error that a word holds, at least.

    Attributes:
        count_width, first, bin_bits, bins: the arguments.
        place: the format of an error, in counts.

    Raises:
        TypeError: if an argument is not a number of its kind.
        ValueError: if an argument is out of range, or the bins do not fit the count, with the accepted range.
    """

    latency = LATENCY

    def __init__(self, count_width: int, first: int, bin_bits: int, bins: int, limit_counts: float = 16.0):
        check_int("count_width", count_width, 2, 32)
        half = 1 << (count_width - 1)
        check_int("first", first, -half, half - 1)
        check_int("bin_bits", bin_bits, 0, count_width - 1)
        check_int("bins", bins, 2, BINS_MAX)
        check_number("limit_counts", limit_counts)
        check_range("limit_counts", limit_counts, *LIMITS_COUNTS)
        if first + (bins << bin_bits) > half:
            raise FieldError("bins", f"must be at most {(half - first) >> bin_bits} from edge {first} on, not {bins!r}")
        self.count_width, self.first, self.bin_bits, self.bins = count_width, first, bin_bits, bins
        self.place = SQ(1 + bits_for(limit_counts + 2.0**-FRACTION_BITS), FRACTION_BITS)

    @property
    def bits(self) -> int:
        """Bits of the memory."""
        return self.bins * self.place.width

    def words(self, errors_counts: ArrayLike) -> np.ndarray:
        """Return the words of the errors of all bins (counts), rounded half up and saturated.

        Raises:
            ValueError: if there is not one finite error for every bin.
        """
        errors = np.asarray(errors_counts, np.float64)
        if errors.shape != (self.bins,) or not np.isfinite(errors).all():
            raise ValueError(f"errors must be {self.bins} finite numbers, not {errors.shape} {errors.dtype}")
        return np.clip(np.floor(errors * 2.0**FRACTION_BITS + 0.5), -self.place.max, self.place.max).astype(np.int64)

    def params(self, errors_counts: ArrayLike, floating: bool = False) -> Params:
        """Return the map of the errors of all bins (counts): words, or unrounded in float64."""
        words = self.words(errors_counts)
        return Params(self.first, self.bin_bits, np.array(errors_counts, np.float64) if floating else words)
