"""How much of real time is kept: the fewest seconds of the last windows."""

import pytest

from hardwall.sim.virtual.real_time import WINDOW_S, WINDOWS, Keeping


def test_it_is_that_of_the_slowest_of_the_last_windows():
    keeping, simulated_s, real_s = Keeping(), 0.0, 0.0

    def window(pace: float) -> float:
        nonlocal simulated_s, real_s
        for _ in range(4):
            simulated_s, real_s = simulated_s + pace * WINDOW_S / 4, real_s + WINDOW_S / 4
            keeping.take(simulated_s, real_s)
        return keeping.least

    assert keeping.least is None
    assert window(0.9) == pytest.approx(0.9)
    assert window(0.2) == pytest.approx(0.2)
    for _ in range(WINDOWS - 1):
        assert window(0.7) == pytest.approx(0.2)
    assert window(0.7) == pytest.approx(0.7)
