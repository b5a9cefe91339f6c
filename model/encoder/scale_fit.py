"""Learns a map of an encoder's scale from the stamped edges of training passes: the host's part of `scale_map`.

Edge k of a pass, number n_k, was passed at its stamp t_k. The axis was then at n_k + e(n_k), and half the hysteresis h
off in the direction of motion. The motion x of a pass is modelled as a spline of degree DEGREE with a knot every
`knot_s`. It covers the edges on both sides of any moment. Every bin of the map has one error. All of them at once are
those with the least sum of squares, over all passes:

    sum_k (x(t_k) - n_k - e(bin of n_k) - h d_k)**2 + RIDGE sum_bins e**2             d_k = 1/2 upwards, -1/2 downwards

The errors are eliminated bin by bin, and the coefficients of the splines are the solution of what is left. Nothing but
stamps and numbers is used, and no order of passes matters.

What cannot be told. If a spline can follow an error as a function of the time of a pass, the error cannot be told from
motion. Such errors are a constant, a term proportional to n, and a long wave: one that passes below about 1 / (2
knot_s) Hz in all passes. RIDGE, which is far less than one edge, gives that part to the motion: a map keeps the mean
and the scale of the encoder. In turn, motion of the hand above that frequency is taken for an error of the scale. It
differs in every pass, so it falls with the number of passes.

Source: the splines are de Boor 1978, A Practical Guide to Splines, chapter X; least squares with the many unknowns of
their own elimination are the bundle adjustment of photogrammetry. Their use on an encoder's edges is this project's.
"""

import numpy as np

from ..checks import check_number, check_range
from ..runtime.compiled import compiled
from .scale_map import Design, Params, bin_of, place_of

DEGREE = 5
KNOT_S = 0.1
"""The distance of two knots: a hand that swings has little beyond 5 Hz."""
KNOTS_S = 1e-3, 10.0
RIDGE = 1e-2
"""The cost of an error of one count, in squares of a count; hundreds of edges in a bin outweigh it."""
FIRM = 1e-9
"""The cost of a coefficient of a spline, so that a spline without edges is 0; an edge has some thousandths at least."""


@compiled
def _basis(within, values):
    """Fill `values` with the DEGREE + 1 splines that are not 0, at a place between two knots, 0 to 1: de Boor."""
    values[0] = 1.0
    for degree in range(1, DEGREE + 1):
        carried = 0.0
        for k in range(degree):
            part = values[k] / degree
            values[k] = carried + (k + 1 - within) * part
            carried = (within + degree - 1 - k) * part
        values[degree] = carried


@compiled
def _accumulate(scale, times, numbers, knot_s, gram, cross, right, hits, sums):
    """Add a pass to the sums of products: of coefficients, of coefficients and bins, and of both with the numbers."""
    values, places = np.zeros(DEGREE + 2), np.zeros(DEGREE + 2, np.int64)
    places[DEGREE + 1] = len(right) - 1
    up = len(numbers) > 1 and numbers[1] >= numbers[0]
    middle = numbers[len(numbers) // 2]
    for k in range(len(times)):
        # An edge that is met again is met from its other side.
        if k and numbers[k] == numbers[k - 1]:
            up = not up
        elif k:
            up = numbers[k] > numbers[k - 1]
        if place_of(scale, numbers[k]).outside:
            continue
        at = (times[k] - times[0]) / knot_s
        first = int(at)
        _basis(at - first, values)
        values[DEGREE + 1] = -0.5 if up else 0.5
        for n in range(DEGREE + 1):
            places[n] = first + n
        bin_, number = bin_of(scale, numbers[k]), float(numbers[k] - middle)
        hits[bin_] += 1
        sums[bin_] += number
        for n in range(DEGREE + 2):
            right[places[n]] += values[n] * number
            cross[places[n], bin_] += values[n]
            for other in range(DEGREE + 2):
                gram[places[n], places[other]] += values[n] * values[other]


class Fit:
    """The fit of a map to training passes, which are added one after the other.

    Args:
        scale: the bins.
        knot_s: the distance of two knots of a motion, s.

    Raises:
        TypeError, ValueError: if the distance is no number in its range.
    """

    def __init__(self, scale: Design, knot_s: float = KNOT_S):
        check_number("knot_s", knot_s)
        check_range("knot_s", knot_s, *KNOTS_S)
        self.scale, self.knot_s = scale, knot_s
        self._bins = Params(scale.first, scale.bin_bits, np.zeros(scale.bins))
        self._hits, self._sums = np.zeros(scale.bins), np.zeros(scale.bins)
        self._passes: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []

    @property
    def visited(self) -> int:
        """How many bins have been visited."""
        return int(np.count_nonzero(self._hits))

    def add(self, times_s: np.ndarray, numbers: np.ndarray) -> None:
        """Add a pass: the times of its edges, in order, and their numbers in a referenced count.

        Raises:
            ValueError: if there are no edges, not as many times as numbers, or times that fall.
        """
        times, edges = np.asarray(times_s, np.float64), np.asarray(numbers, np.int64)
        if times.shape != edges.shape or times.ndim != 1 or not len(times) or np.any(np.diff(times) < 0):
            raise ValueError(f"times_s must be as many as numbers, 1 or more, and must not fall: {times.shape}")
        # The last coefficient is the hysteresis.
        size = int((times[-1] - times[0]) / self.knot_s) + DEGREE + 2
        gram, cross, right = np.zeros((size, size)), np.zeros((size, self.scale.bins)), np.zeros(size)
        _accumulate(self._bins, times, edges, self.knot_s, gram, cross, right, self._hits, self._sums)
        # The numbers of a pass are counted from their middle; a spline takes any constant.
        self._passes.append((gram, cross, right))

    def errors(self) -> np.ndarray:
        """Return the errors of all bins, counts; 0 for a bin that was not visited.

        Raises:
            ValueError: if no pass has been added.
        """
        if not self._passes:
            raise ValueError("no training pass has been added")
        weight = 1 / (self._hits + RIDGE)
        cross = np.concatenate([part for _, part, _ in self._passes])
        left = -(cross * weight) @ cross.T
        right = np.concatenate([part for _, _, part in self._passes]) - cross @ (weight * self._sums)
        start = 0
        for gram, _, _ in self._passes:
            here = slice(start, start + len(gram))
            left[here, here] += gram
            start += len(gram)
        left[np.diag_indices_from(left)] += FIRM
        return weight * (np.linalg.solve(left, right) @ cross - self._sums)
