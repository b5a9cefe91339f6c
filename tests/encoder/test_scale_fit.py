"""The fit of a map: against least squares of all unknowns at once, and what can and cannot be told from passes."""

import math

import numpy as np
import pytest
import scipy.interpolate

from hardwall.model.encoder.scale_fit import DEGREE, FIRM, RIDGE, Fit
from hardwall.model.encoder.scale_map import Design
from hardwall.testing import rng

SECONDS = 4.0
BINS = Design(12, -300, 2, 150)


def passed(errors_counts, amplitude: float, hertz: float, hysteresis: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the times and the numbers of the edges of a sine, each off by its bin's or its own error."""
    times = np.linspace(0, SECONDS, 400_001)
    place = amplitude * np.sin(math.tau * hertz * times)
    numbers = np.arange(-300, 300)
    stands = numbers + errors_counts[(numbers + 300) * len(errors_counts) // 600]
    # An edge that is too near to a turn for the hysteresis is met from neither side.
    met = np.abs(stands) + hysteresis / 2 < amplitude
    numbers, stands = numbers[met], stands[met]
    found = []
    for up in (True, False):
        at = stands + (hysteresis / 2 if up else -hysteresis / 2)
        for number, where in zip(numbers.tolist(), at.tolist(), strict=True):
            before, after = place[:-1], place[1:]
            crossed = np.flatnonzero((before < where) & (after >= where) if up else (before >= where) & (after < where))
            share = (where - place[crossed]) / (place[crossed + 1] - place[crossed])
            found += [(time, number) for time in (times[crossed] + share * times[1]).tolist()]
    found.sort()
    return np.array([time for time, _ in found]), np.array([number for _, number in found])


def errors_at(wavelength_edges: float) -> np.ndarray:
    """Return a wave of errors of one count."""
    return np.sin(math.tau * (4 * np.arange(BINS.bins) + 2) / wavelength_edges)


def fitted(*passes: tuple[np.ndarray, np.ndarray], knot_s: float = 0.1) -> Fit:
    fit = Fit(BINS, knot_s)
    for each in passes:
        fit.add(*each)
    return fit


def left_of(errors: np.ndarray, known: np.ndarray, within: int) -> float:
    """Return the RMS of what a fit is off by, in bins up to some edges from the middle, but for mean and scale."""
    inner = np.abs(4 * np.arange(BINS.bins) - 300) < within
    off, at = (errors - known)[inner], np.arange(BINS.bins)[inner]
    return float(np.std(off - np.polyval(np.polyfit(at, off, 1), at)))


def test_errors_are_those_of_least_squares_of_all_unknowns_at_once():
    """Independent: SciPy's splines, and every unknown in one matrix."""
    truth = rng().normal(0, 0.2, BINS.bins)
    passes = [passed(truth, 250, 0.9, 0.4), passed(truth, 200, 1.2, 0.4)]
    blocks, knot_s = [], 0.1
    for times, numbers in passes:
        knots = times[0] + knot_s * np.arange(-DEGREE, int((times[-1] - times[0]) / knot_s) + DEGREE + 2)
        splines = scipy.interpolate.BSpline.design_matrix(times, knots, DEGREE).toarray()
        in_bin = (numbers[:, None] + 300) // 4 == np.arange(BINS.bins)
        slopes = np.cos(math.tau * (0.9 if len(blocks) == 0 else 1.2) * times)
        blocks.append((splines, -np.sign(slopes)[:, None] / 2, in_bin, numbers))
    rows, start, columns = [], BINS.bins, BINS.bins + sum(block[0].shape[1] + 1 for block in blocks)
    for splines, ways, in_bin, _ in blocks:
        row = np.zeros((len(ways), columns))
        row[:, : BINS.bins] = -in_bin.astype(float)
        row[:, start : start + splines.shape[1]] = splines
        row[:, start + splines.shape[1]] = ways[:, 0]
        start += splines.shape[1] + 1
        rows.append(row)
    rows.append(np.diag(np.sqrt([RIDGE] * BINS.bins + [FIRM] * (columns - BINS.bins))))
    right = np.concatenate([*(numbers - numbers[len(numbers) // 2] for *_, numbers in blocks), np.zeros(columns)])
    expected = np.linalg.lstsq(np.concatenate(rows), right)[0][: BINS.bins]
    found = fitted(*passes, knot_s=knot_s).errors()
    assert np.abs(expected).max() > 0.3
    assert np.allclose(found, expected, rtol=0, atol=1e-6)


def test_a_wave_above_the_band_of_the_motion_is_learned_and_one_within_it_is_not():
    """At 250 counts and 1 Hz the axis passes 1570 counts a second: 40 edges are 39 Hz, and 4 Hz at a fortieth of it."""
    short, long = errors_at(40), errors_at(1200)
    assert left_of(fitted(passed(short, 250, 1.0)).errors(), short, 200) < 0.05
    missed = fitted(passed(long, 250, 1.0)).errors()
    assert left_of(missed, long, 200) > 0.5 * left_of(np.zeros(BINS.bins), long, 200)


def test_mean_and_scale_are_those_of_the_encoder():
    known = 0.5 + 0.002 * np.arange(-300, 300)
    errors = fitted(passed(known, 250, 1.0)).errors()
    assert np.abs(errors).max() < 0.05 * np.abs(known).max()


def test_hysteresis_is_no_error_of_the_scale():
    none = np.zeros(BINS.bins)
    assert np.abs(fitted(passed(none, 250, 1.0, 0.4)).errors()).max() < 0.05


def test_a_bin_that_was_not_visited_has_no_error_and_edges_outside_are_left_out():
    fit = fitted(passed(errors_at(40), 100, 1.0))
    errors = fit.errors()
    assert fit.visited == 50
    assert np.count_nonzero(errors) == fit.visited
    narrow = Fit(Design(12, -40, 2, 20))
    narrow.add(*passed(errors_at(40), 250, 1.0))
    assert np.abs(narrow.errors()).max() < 2


@pytest.mark.parametrize(("times", "numbers"), [([], []), ([0.0], [1, 2]), ([1.0, 0.0], [1, 2]), ([[0.0]], [[1]])])
def test_what_is_no_pass_is_refused(times, numbers):
    with pytest.raises(ValueError, match="times_s must be as many as numbers"):
        Fit(BINS).add(np.array(times), np.array(numbers))


def test_a_fit_needs_a_pass_and_a_distance_of_knots():
    with pytest.raises(ValueError, match="no training pass"):
        Fit(BINS).errors()
    with pytest.raises(ValueError, match=r"knot_s must be 0.001 to 10, not 0"):
        Fit(BINS, 0)
