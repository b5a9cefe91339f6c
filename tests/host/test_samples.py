"""Samples at a rate: every one that is due is yielded or counted, and it is said when some were missed."""

import time

import pytest

from hardwall.host.errors import PortError, SilentError
from hardwall.host.samples import COLUMNS, GAPS, Gap, Sample, Samples
from hardwall.host.status import State
from hardwall.model.axis.supervisor import CAUSES
from hardwall.model.checks import FieldError


class Clock:
    """A clock that goes on only where it is waited, and an axis whose answers take time on it.

    Attributes:
        now_s: its time.
        answer_s: what the next answers take; None for one that does not come.
    """

    def __init__(self, monkeypatch, *answer_s: float | None):
        self.now_s, self.answer_s = 100.0, list(answer_s)
        monkeypatch.setattr(time, "monotonic", lambda: self.now_s)
        monkeypatch.setattr(time, "sleep", self.wait)

    def wait(self, seconds: float) -> None:
        assert seconds > 0
        self.now_s += seconds

    @property
    def status(self) -> str:
        answer_s = self.answer_s.pop(0) if self.answer_s else 0.001
        self.now_s += 1.03 if answer_s is None else answer_s
        if answer_s is None:
            raise SilentError("nothing answers any more")
        return "status"


def taken(samples: Samples) -> list[tuple[float, bool, int]]:
    return [(round(each.time_s, 6), each.status is not None, each.missed) for each in samples]


def test_samples_are_due_at_multiples_of_the_period(monkeypatch):
    samples = Samples(Clock(monkeypatch), 10.0, 0.5)
    assert taken(samples) == [(0.0, True, 0), (0.1, True, 0), (0.2, True, 0), (0.3, True, 0), (0.4, True, 0)]
    assert str(samples) == "5 samples at 10 Hz, 0 missed"
    assert samples.gaps == []


def test_a_late_sample_is_none_that_is_missed_until_the_next_is_due(monkeypatch):
    samples = Samples(Clock(monkeypatch, 0.15, 0.12), 10.0, 0.5)
    # The second is asked at 0.15 s and the third at 0.27 s, each before the one behind it is due.
    assert taken(samples) == [(0.0, True, 0), (0.15, True, 0), (0.27, True, 0), (0.3, True, 0), (0.4, True, 0)]


def test_what_is_missed_is_counted_where_it_was(monkeypatch):
    samples = Samples(Clock(monkeypatch, 0.01, 0.35), 10.0, 0.8)
    assert taken(samples) == [
        (0.0, True, 0), (0.1, True, 0), (0.45, True, 2), (0.5, True, 0), (0.6, True, 0), (0.7, True, 0),
    ]  # fmt: skip
    assert (samples.taken, samples.missed, samples.gaps) == (6, 2, [Gap(2, 0.2)])
    assert str(samples) == "6 samples at 10 Hz, 2 missed: 2 from 0.200 s on"


def test_a_silent_board_ends_nothing(monkeypatch):
    samples = Samples(Clock(monkeypatch, 0.01, None, None), 10.0, 3.0)
    found = taken(samples)
    assert found[:4] == [(0.0, True, 0), (0.1, False, 1), (1.13, False, 10), (2.16, True, 9)]
    # One gap, however often the board was asked in it.
    assert samples.gaps == [Gap(20, 0.1)]
    assert samples.taken + samples.missed == 30


def test_what_is_missed_at_the_end_is_counted_too(monkeypatch):
    samples = Samples(Clock(monkeypatch, 0.01, 5.0), 10.0, 1.0)
    assert taken(samples) == [(0.0, True, 0), (0.1, True, 0), (5.1, False, 8)]
    assert (samples.taken, samples.missed, samples.gaps) == (2, 8, [Gap(8, 0.2)])
    assert taken(samples) == []


def test_only_the_longest_gaps_are_remembered(monkeypatch):
    waits = [wait for number in range(1, 2 * GAPS + 1) for wait in (0.1 * number + 0.15, 0.001)]
    samples = Samples(Clock(monkeypatch, *waits), 10.0, 60.0)
    list(samples)
    assert samples.missed == sum(range(1, 2 * GAPS + 1))
    assert [gap.missed for gap in samples.gaps] == list(range(GAPS + 1, 2 * GAPS + 1))
    assert str(samples).endswith(f", and {sum(range(1, GAPS + 1))} in shorter gaps")


def test_a_port_that_is_gone_ends_it(board, axis):
    samples = Samples(axis, 1000.0)
    assert next(samples).status.state is State.DISARMED
    board.hang_up()
    with pytest.raises(PortError, match="is gone"):
        list(samples)
    assert samples.taken >= 1


def test_samples_write_nothing(board, axis):
    before = len(board.requests)
    list(Samples(axis, 200.0, 0.1))
    assert {request[1] for request in board.requests[before:]} == {3}


def test_a_row_has_every_column(board, axis):
    emergency = next(bit for bit, cause in enumerate(CAUSES) if cause.name == "emergency_stop")
    board.show(state=State.TRIPPED, latched=1 << emergency, flags=3, count=5)
    row = next(Samples(axis)).row
    assert tuple(row) == COLUMNS
    assert (row["state"], row["causes"], row["missed"]) == ("TRIPPED", ["emergency_stop"], 0)
    assert row["flags"] == ["encoder_illegal", "encoder_overspeed"]
    assert row["position_m"] == 5 * axis.device.registers["count"].lsb
    assert row["acceleration_m_per_s2"] is None
    silent = Sample(1.0, 2.0, None, 7).row
    assert tuple(silent) == COLUMNS
    assert [name for name, value in silent.items() if value is not None] == ["time_s", "unix_s", "missed"]


def test_a_row_has_the_acceleration_of_a_board_that_has_one(accelerated_board, accelerated_axis, accelerated):
    accelerated_board.show(acceleration=-7)
    row = next(Samples(accelerated_axis)).row
    assert tuple(row) == COLUMNS
    assert row["acceleration_m_per_s2"] == -7 * accelerated["acceleration"].lsb


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, 1001.0, float("nan")])
def test_a_rate_that_is_none_is_refused(axis, rate_hz):
    with pytest.raises(FieldError, match=r"rate_hz must be 0\.001 to 1000, not "):
        Samples(axis, rate_hz)
    with pytest.raises(TypeError, match="rate_hz must be a number, not '5'"):
        Samples(axis, "5")
    with pytest.raises(FieldError, match=r"seconds must be 0 to 1e\+09, not -1"):
        Samples(axis, 1.0, -1.0)
