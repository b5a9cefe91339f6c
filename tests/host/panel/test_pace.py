"""The pace of a board beside ours, from stamps that wrap."""

import pytest

from hardwall.host.panel.pace import Pace


@pytest.mark.parametrize("true", [1.0, 0.3])
def test_the_pace_is_that_of_the_stamps_across_their_wrap(true):
    pace = Pace(wrap_s=1.05)
    for look in range(300):
        pace.take(10 + look / 50, (7 + true * look / 50) % 1.05)
    assert pace.pace == pytest.approx(true)
    assert pace.looks_hz == pytest.approx(50)


def test_it_is_not_known_at_first_and_after_a_pause_that_a_stamp_may_have_wrapped_in():
    pace = Pace(wrap_s=1.0)
    assert pace.pace is None
    for look in range(100):
        pace.take(look / 50, look / 50 % 1.0)
    assert pace.pace == pytest.approx(1.0)
    pace.take(2.0 + 0.51, 0.5)
    assert (pace.pace, pace.looks_hz) == (None, 0.0)
    for look in range(100):
        pace.take(2.51 + look / 50, (0.5 + look / 100) % 1.0)
    assert pace.pace == pytest.approx(0.5)
