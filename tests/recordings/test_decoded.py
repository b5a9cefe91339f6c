"""Captures in every form: the same edges, counted by the decoder; and those that are refused."""

import numpy as np
import pytest

from hardwall.sim.recordings.capture import Capture, Changes
from hardwall.sim.recordings.decoded import counts_at, edges_of, recording_of
from hardwall.sim.recordings.error import RecordingError
from hardwall.sim.recordings.recording import EdgeRecord
from stimuli.forms import TICK_HZ, edges, saleae, samples, session, sigrok_csv, vcd, waveforms

TICKS, LEVELS, COUNTS = edges()
FORMS = pytest.mark.parametrize(
    ("content", "file"),
    [
        (session(), "spindle.sr"),
        (session(unit=2, pieces=3), "spindle.sr"),
        (saleae(), "spindle.csv"),
        (sigrok_csv(), "spindle.csv"),
        (vcd(), "spindle.vcd"),
    ],
    ids=["sigrok", "sigrok in pieces", "saleae", "sigrok csv", "vcd"],
)


@FORMS
def test_every_form_has_the_same_edges(read, content, file):
    found = read(content, None, 10_000.0, file=file)
    exact = np.concatenate([[0], COUNTS])[np.searchsorted(TICKS, np.arange(len(found.counts)) * 100, side="right")]
    assert (found.counts == exact).all()
    assert found.edges.counts.tolist() == COUNTS.tolist()
    assert (found.edges.ticks / found.edges.tick_hz).tolist() == pytest.approx((TICKS / TICK_HZ).tolist(), abs=1e-12)
    assert len(found.counts) == (TICKS[-1] + 999) // 100 + 1
    assert f"{len(TICKS)} edges in" in found.notes[1]


def test_an_export_of_waveforms_has_its_edges_to_a_row(read):
    found = read(waveforms(), None, 10_000.0)
    assert found.start_s == -0.02
    assert found.edges.counts.tolist() == COUNTS.tolist()
    late = found.edges.ticks / found.edges.tick_hz - TICKS / TICK_HZ
    assert 0 <= late.min() <= late.max() < 1e-5


@FORMS
def test_channels_the_other_way_round_turn_the_other_way(read, content, file):
    found = read(content, None, 10_000.0, file=file, channels=("2", "1"))
    assert found.edges.counts.tolist() == (-COUNTS).tolist()


@pytest.mark.parametrize("apart", [1, 2, 3, 5])
def test_the_decoder_counts_edges_in_successive_ticks(apart):
    """Its latency is four clocks: each count is that after its own edge and no later one."""
    number = np.arange(1, 400)
    levels = np.array([0, 1, 3, 2])[number % 4]
    found = edges_of("made", Changes(1e6, apart * number, levels, 0, 2000))
    assert found.counts.tolist() == number.tolist()


def test_both_channels_at_once_are_refused():
    changes = Changes(1e6, np.array([100, 200, 250]), np.array([1, 2, 0]), 0, 1000)
    with pytest.raises(
        RecordingError, match=r"^made: A and B must not change at once, as at 0\.0002 s .* \(1 times of 3"
    ):
        edges_of("made", changes)


@pytest.mark.parametrize("ticks", [[100, 200, 150], [100, 200, 200], [-5, 200, 300]])
def test_times_that_do_not_increase_are_refused(ticks):
    changes = Changes(1e6, np.array(ticks), np.array([1, 3, 2]), 0, 1000)
    with pytest.raises(RecordingError, match=r"^made: times must increase from one change of levels to the next, not"):
        edges_of("made", changes)


def test_an_edge_at_the_time_of_a_sample_is_counted_there():
    found = EdgeRecord(1e6, np.array([1000, 1001, 3000]), np.array([1, 2, 3]), 0)
    assert counts_at(found, 1000.0, 5).tolist() == [0, 1, 2, 3, 3]
    for rate in (3.0, 7.0, 1e4 / 3):
        ticks = np.arange(1, 50)
        exact = counts_at(EdgeRecord(rate, ticks, ticks, 0), rate, 50)
        assert exact.tolist() == list(range(50))


@pytest.mark.parametrize(("rate", "last"), [(1000.0, 1001), (10_000.0, 3), (48_000.0, 54)])
def test_a_sample_at_the_end_of_the_capture_is_one_of_it(rate, last):
    """In float64 the end is a part in 10^16 before such a sample."""
    end = round(last * TICK_HZ / rate)
    assert end / TICK_HZ * rate < last

    class Made(Capture):
        name, form, channels = "made", "made", ["A", "B"]

        def changes(self, places):
            return Changes(float(TICK_HZ), np.array([1, end]), np.array([1, 3]), 0, end)

    found = recording_of(Made(), "made", (), rate)
    assert len(found.counts) == last + 1
    assert found.counts[-1] == 2


def test_the_index_is_said(read):
    levels = samples()
    lines = [f"{level & 1},{level >> 1},{int(20_000 <= k < 20_100)}" for k, level in enumerate(levels)]
    found = read("; Samplerate: 1 MHz\nA,B,Z\n" + "\n".join(lines), None, 1000.0)
    count = np.concatenate([[0], COUNTS])[np.searchsorted(TICKS, 20_000, side="right")]
    assert found.notes[-1] == f"Z rises 1 times, at counts {count}"
    assert found.column == "A,B,Z"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({}, "is a capture of edges, so the sample rate of the estimator must be given (--rate)"),
        ({"rate_hz": 1.0}, "must give 2 to 10000000 samples at 1 Hz, not 1: correct the rate"),
        ({"rate_hz": 10.0, "column": "A"}, "is a capture of edges, which has no column: name its channels"),
        ({"rate_hz": 10.0, "channels": ("1", "1")}, "A, B and Z must be different channels, not A, A"),
        ({"rate_hz": 10.0, "unit": "rad"}, "is a capture of edges, so --unit must be absent"),
        ({"rate_hz": 10.0, "counter_bits": 16}, "is a capture of edges, so --counter-bits must be absent"),
        ({"rate_hz": 10.0, "counter_modulus": 9}, "is a capture of edges, so --counter-modulus must be absent"),
        ({"rate_hz": 10.0, "gaps": "hold", "count": 2.0}, "so --count and --gaps must be absent"),
        ({"rate_hz": 10.0, "time": "t"}, "is a capture with times of its own, so --time must be absent"),
        ({"rate_hz": 10.0, "time_unit": "s"}, "is a capture with times of its own, so --time-unit must be absent"),
    ],
)
def test_what_a_capture_needs(refused, arguments, said):
    assert said in refused(session(), **{"column": None, "file": "spindle.sr"} | arguments)
