"""The heartbeat: it lasts as long as its lease, and no longer."""

import time
from collections.abc import Callable
from contextlib import suppress

import pytest

from hardwall.host.errors import HostError, SilentError
from hardwall.host.heartbeat import BEATS, LEASE_S, Heartbeat

WATCHDOG_S = 0.2
PATIENCE_S = 60.0


class Beats:
    """What a board hears.

    Attributes:
        times: when; error: what the next beat raises.
    """

    def __init__(self) -> None:
        self.times: list[float] = []
        self.error: HostError | None = None

    def __call__(self) -> None:
        if self.error:
            raise self.error
        self.times.append(time.monotonic())


@pytest.fixture
def beats():
    return Beats()


@pytest.fixture
def heart(beats):
    heartbeat = Heartbeat(beats, WATCHDOG_S)
    yield heartbeat
    heartbeat.close()


def lives_until(heart: Heartbeat, happens: Callable[[], bool]) -> None:
    """Renew the lease before it ends until something happens by the beats of the thread."""
    until = time.monotonic() + PATIENCE_S
    while not happens():
        assert time.monotonic() < until
        # A renewal behind the end of a lease beats itself, and fails as this beat does.
        with suppress(HostError):
            heart.renew(LEASE_S)
        time.sleep(WATCHDOG_S / BEATS)


def test_it_begins_with_the_first_renewal(heart, beats):
    time.sleep(WATCHDOG_S)
    assert beats.times == []
    heart.renew(LEASE_S)
    assert len(beats.times) == 1


def test_it_ends_with_its_lease(heart, beats):
    heart.renew(LEASE_S)
    renewed = time.monotonic()
    time.sleep(2 * LEASE_S)
    assert beats.times[-1] < renewed + LEASE_S + WATCHDOG_S / BEATS
    assert len(beats.times) > BEATS
    heard = len(beats.times)
    time.sleep(WATCHDOG_S)
    assert len(beats.times) == heard
    heart.renew(LEASE_S)
    assert len(beats.times) == heard + 1


def test_it_can_rest_and_begin_again(heart, beats):
    heart.renew(LEASE_S)
    heart.rest()
    heard = len(beats.times)
    time.sleep(WATCHDOG_S)
    assert len(beats.times) == heard
    heart.renew(LEASE_S)
    assert len(beats.times) == heard + 1


def test_a_beat_that_is_lost_is_remembered_until_one_arrives(heart, beats):
    heart.renew(LEASE_S)
    beats.error = SilentError("nothing answers")
    lives_until(heart, lambda: heart.lost is beats.error)
    beats.error = None
    lives_until(heart, lambda: heart.lost is None)
    heart.rest()
    beats.error = SilentError("nothing answers")
    with pytest.raises(SilentError):
        heart.renew(LEASE_S)


def test_it_closes_without_ever_having_begun(beats):
    Heartbeat(beats, WATCHDOG_S).close()
    assert beats.times == []
