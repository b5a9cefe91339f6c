"""The figures of an estimate against the errors that were put into it."""

import numpy as np
import pytest

from hardwall.sim.estimates.judge import CHATTER_S, Judge
from hardwall.testing import rng

RATE = 10_000.0


def judged(estimate, exact, chunk=777) -> Judge:
    judge = Judge(len(estimate), RATE)
    for first in range(0, len(estimate), chunk):
        judge.add(first, estimate[first : first + chunk], exact[first : first + chunk])
    return judge


def test_bias_is_error_and_no_chatter_and_what_alternates_is_both():
    exact = np.sin(np.arange(30_000) / 500)
    judge = judged(exact + 0.3 + 0.4 * (-1.0) ** np.arange(len(exact)), exact)
    assert judge.rms == pytest.approx(0.5, rel=1e-12)
    assert judge.largest == pytest.approx(0.7, rel=1e-12)
    assert round(CHATTER_S * RATE) % 2 == 0
    assert judge.chatter == pytest.approx(0.4, rel=1e-9)


@pytest.mark.parametrize("delay", [-3e-3, 0.0, 1.234e-4, 2e-2])
def test_a_delay_is_found(delay):
    def exact(times):
        return np.exp(-times) * np.sin(2 * np.pi * times)

    times = np.arange(200_000) / RATE
    judge = judged(exact(times - delay) + 0.01 * rng().standard_normal(len(times)), exact(times))
    # The noise moves the peak by about its RMS over the RMS of the slope and over the root of the number of samples.
    slope = np.sqrt(np.mean(np.gradient(exact(times), times) ** 2))
    assert judge.delay_s(exact, 0.1) == pytest.approx(delay, abs=5 * 0.01 / slope / np.sqrt(len(times)))


def test_without_change_there_is_no_delay():
    ones = np.ones(1000)
    assert judged(ones, ones).delay_s(np.ones_like, 0.1) is None
    assert judged(0 * ones, np.sin(np.arange(1000))).delay_s(np.sin, 0.1) is None


def test_a_delay_beyond_the_limits_is_none():
    times = np.arange(20_000) / RATE
    judge = judged(np.exp(-((times - 1.05) ** 2)), np.exp(-((times - 1) ** 2)))
    assert judge.delay_s(lambda at: np.exp(-((at - 1) ** 2)), 0.1) == pytest.approx(0.05, abs=1e-6)
    assert judge.delay_s(lambda at: np.exp(-((at - 1) ** 2)), 0.04) is None


def test_chunks_do_not_matter():
    values = rng().standard_normal((2, 12_345))
    whole, pieces = judged(*values, chunk=20_000), judged(*values, chunk=100)
    assert pieces.rms == pytest.approx(whole.rms, rel=1e-12)
    assert pieces.chatter == pytest.approx(whole.chatter, rel=1e-12)
    assert pieces.largest == whole.largest
