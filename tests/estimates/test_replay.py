"""Replays: recordings on every backend, the paper's equations, units, refused input and written files."""

import csv
import json
import math
import re
from functools import partial

import numpy as np
import pytest

from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.sim.estimates.replay import replay
from hardwall.sim.estimates.replay_plan import ReplayError, check_length
from hardwall.sim.pictures.replay import draw
from hardwall.sim.pictures.style import SUFFIXES, save
from hardwall.sim.recordings.load import load
from hardwall.sim.recordings.recording import Recording
from hardwall.testing import rng
from stimuli.lengths import LONG
from stimuli.replays import BOUND, COARSEN, EVERY, recording, reference_of, swing

FILES = ["davinci_L2_02.csv", "davinci_L2_22.csv", "davinci_R5_42.csv"]
REPLAYED = FILES if LONG else FILES[:1]
"""The recordings that every estimator gets: `make soak` gives it all."""
BY_RTL = ESTIMATORS if LONG else ("levant", "levant-edge", "kalman")
"""The estimators that `rtl` replays: by `make soak` all."""


@EVERY
@pytest.mark.parametrize("name", REPLAYED)
def test_recordings_on_every_backend(recordings, name, estimator, output):
    recorded = load(recordings / name, "motor_counts")
    backends = ("float", "fixed", *(["rtl"] if estimator in BY_RTL else []))
    results = {backend: replay(recorded, estimator, output, backend, COARSEN, BOUND) for backend in backends}
    fixed = results["fixed"]
    assert [result.flags for result in results.values()] == [[]] * len(backends)
    if rtl := results.get("rtl"):
        assert np.flatnonzero(fixed.velocity_counts_per_s != rtl.velocity_counts_per_s).tolist() == []
        assert fixed.velocity_sha256 == rtl.velocity_sha256
    derivative = reference_of(recorded)
    for result in results.values():
        error = (result.velocity_counts_per_s - derivative)[1000:]
        assert result.rms_counts_per_s == pytest.approx(math.sqrt(np.mean(error**2)), rel=1e-9)
        if estimator == "fdm":
            assert result.rms_counts_per_s == result.rms_fdm_counts_per_s
        else:
            assert result.rms_counts_per_s < result.rms_fdm_counts_per_s / 2
    if estimator == "levant":
        check_equations(recorded, BOUND)


# ---- float against the paper's algorithm ----------------------------------------------------------------------------


def check_equations(recorded: Recording, bound: float) -> None:
    """Assert that u and u1 of every sample are those of the paper's equations, written in SI and absolute position.

    Position is summed in extended precision, so only the rounding of the kernel's own sum remains: half an ulp a
    sample of a few counts at most. An error of d in e causes at most lambda sqrt(d) in u, and can turn the sign of an
    e that is within d of 0.
    """
    rate, tau = recorded.rate_hz, 1 / recorded.rate_hz
    u, u1 = (
        replay(recorded, "levant", output, "float", COARSEN, bound).velocity_counts_per_s.astype(np.longdouble)
        for output in ("u", "u1")
    )
    f = (recorded.counts // COARSEN * COARSEN).astype(np.longdouble)
    lam, alpha = np.sqrt(np.longdouble(bound)), 1.1 * np.longdouble(bound)
    x = f[0] + np.concatenate([[0], np.cumsum(tau * u)[:-1]])
    e = x - f
    before = np.concatenate([[0], u1[:-1]])
    d = len(f) * np.spacing(np.abs(e).max() + np.abs(u).max() * tau)
    assert np.abs(u - (before - lam * np.sqrt(np.abs(e)) * np.sign(e))).max() <= 2 * lam * np.sqrt(d)
    sure = np.abs(e) > d
    assert sure.mean() > 0.9
    off = np.abs(u1 - (before - tau * alpha * np.sign(e)))
    assert off[sure].max() <= len(f) * np.spacing(np.abs(u1).max())
    assert np.abs(u).max() > rate


def test_float_is_the_algorithm_of_the_paper():
    check_equations(swing(), BOUND)


def test_float_finite_difference_is_the_difference():
    made = swing()
    result = replay(made, "fdm", backend="float", coarsen=COARSEN)
    exact = np.diff(made.counts // 16, prepend=made.counts[0] // 16) * 16 * 1000.0
    assert (result.velocity_counts_per_s == exact).all()
    assert (result.difference_counts_per_s == exact).all()


# ---- units and ranges ------------------------------------------------------------------------------------------------


@EVERY
@pytest.mark.parametrize("backend", ["float", "fixed"])
def test_coarse_counts_are_judged_in_recorded_counts(estimator, output, backend):
    """Motion between coarse counts is not seen: the velocity is the same to the word, in units of recorded counts."""
    fine, random = swing(), rng()
    coarse = recording(fine.counts // COARSEN)
    other = recording(fine.counts // COARSEN * COARSEN + random.integers(0, COARSEN, len(fine.counts)))
    assert (coarse.counts < 0).any()
    seen = replay(fine, estimator, output, backend, COARSEN, BOUND)
    same = replay(other, estimator, output, backend, COARSEN, BOUND)
    small = replay(coarse, estimator, output, backend, 1, BOUND / COARSEN)
    assert (seen.velocity_counts_per_s == same.velocity_counts_per_s).all()
    assert np.allclose(seen.velocity_counts_per_s, COARSEN * small.velocity_counts_per_s, rtol=1e-12, atol=1e-9)
    assert seen.velocity_sha256 == same.velocity_sha256 == small.velocity_sha256
    assert (seen.velocity_sha256 is None) == (backend == "float")


@pytest.mark.parametrize("rate", [50.0, 1 / 0.003])
def test_any_rate_will_do(rate):
    """A ramp is followed to its slope; the reference's cutoff stays well below half the rate."""
    slope = 3.0 * rate
    made = recording(np.floor(slope * np.arange(2000) / rate), rate)
    for backend in ("float", "fixed"):
        result = replay(made, "levant", "u1", backend, acceleration_max_counts_per_s2=0.05 * rate**2)
        assert result.reference_hz == min(40.0, rate / 4)
        assert np.median(result.velocity_counts_per_s[1000:]) == pytest.approx(slope, rel=0.1)


@EVERY
@pytest.mark.parametrize("counts", [[5, 5], [5, 6], [0] * 300, [-(2**62)] * 40], ids=["still", "step", "rest", "far"])
def test_the_shortest_and_the_stillest(estimator, output, counts):
    for backend in ("float", "fixed"):
        result = replay(recording(counts), estimator, output, backend)
        assert len(result.velocity_counts_per_s) == len(counts)
        assert result.flags == []
        if len(set(counts)) == 1:
            assert not result.velocity_counts_per_s.any()


@EVERY
def test_the_widest(estimator, output):
    """The counts use all of 32 bits: the count wraps, and every word can be made."""
    slope = 2**32 // 4000
    counts = -(2**31) + slope * np.arange(4000)
    if ESTIMATORS[estimator].uses_stamps():  # no clock counts so many edges
        with pytest.raises(ReplayError, match="the count must change by at most 100000 in a sample"):
            replay(recording(counts), estimator, output, "fixed")
        return
    result = replay(recording(counts), estimator, output, "fixed", acceleration_max_counts_per_s2=slope * 1e5)
    assert result.spec.count_width == 32
    assert np.median(result.velocity_counts_per_s[2000:]) == pytest.approx(slope * 1000.0, rel=0.1)
    # Gains also follow from zero acceleration.
    assert replay(recording(counts), estimator, output, "fixed").acceleration_max_counts_per_s2 > 0
    jump = np.zeros(1000, np.int64)
    jump[500:] = 2**31 - 1
    assert np.isfinite(replay(recording(jump), estimator, output, "fixed").velocity_counts_per_s).all()


# ---- refused input --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"estimator": "nobody"}, f"estimator must be one of {', '.join(ESTIMATORS)}, not 'nobody'"),
        ({"output": "u2"}, "output of levant must be one of u, u1, not 'u2'"),
        ({"estimator": "fdm", "output": "u1"}, "output of fdm must be one of u, not 'u1'"),
        ({"backend": "gpu"}, "backend must be one of float, fixed, rtl, not 'gpu'"),
        ({"coarsen": 0}, "coarsen must be a whole number of 1 to 2147483647, not 0"),
        ({"coarsen": 1.5}, "coarsen must be a whole number of 1 to 2147483647, not 1.5"),
        ({"acceleration_max_counts_per_s2": 0.0}, "acceleration_max_counts_per_s2 must be "),
        ({"acceleration_max_counts_per_s2": math.inf}, "acceleration_max_counts_per_s2 must be "),
        (
            {"acceleration_max_counts_per_s2": 1e12},
            "acceleration_max_counts_per_s2 must give gains that fit this recording (as if 1024 samples were a second",
        ),
        (
            {"acceleration_max_counts_per_s2": 1e-12},
            "acceleration_max_counts_per_s2 must give gains that fit this recording (as if 1024 samples were a second",
        ),
    ],
)
def test_what_cannot_be_is_refused(arguments, message):
    with pytest.raises(ReplayError, match=rf"^{re.escape(message)}[^\n]*$"):
        replay(swing(), **arguments)


def test_a_recording_too_short_to_be_judged_is_refused():
    with pytest.raises(ReplayError, match=r"^made.csv: must be longer than 1 s, .* not 1000 samples at 1000 Hz$"):
        check_length(swing(1000))
    check_length(swing(1001))
    assert replay(swing(1000), coarsen=COARSEN).rms_counts_per_s is None
    assert replay(swing(1001), coarsen=COARSEN).rms_counts_per_s > 0


def test_a_change_too_fast_for_any_clock_is_refused_on_rtl_alone():
    counts = np.zeros(50, np.int64)
    counts[33:] = 100_001
    message = r"^made.csv, column counts: on rtl the count must change by at most 100000 in a sample at 1000 Hz "
    with pytest.raises(
        ReplayError, match=message + r"\(a clock of 100 MHz, and 16777216 edges\), not by 100001 at sample 33, 0.033 s$"
    ):
        replay(recording(counts), "fdm", backend="rtl")
    assert replay(recording(counts), "fdm", backend="fixed").velocity_counts_per_s.max() == 100_001_000.0


def test_more_edges_in_a_sample_than_memory_holds_are_refused():
    """A slow recording leaves each sample time for any number of edges."""
    counts = np.array([0, 2**30, 0])
    with pytest.raises(ReplayError, match=r"must change by at most 16777216 in a sample at 0.001 Hz"):
        replay(Recording("made.csv", "counts", counts, 1e-3), "period", backend="fixed")


@pytest.mark.parametrize("bound", [1e-300, 1e300])
@pytest.mark.parametrize("estimator", ["kalman", "butterworth", "fdm"])
def test_a_bound_beyond_every_use_is_refused_with_its_range(estimator, bound):
    with pytest.raises(
        ReplayError, match=r"^acceleration_max_counts_per_s2 must be 9.53674e-31 to 9.53674e\+29 counts/s\^2 at 1000"
    ):
        replay(swing(), estimator, acceleration_max_counts_per_s2=bound)


@pytest.mark.parametrize("rate", [1e-6, 1e9])
def test_the_slowest_and_the_fastest_rates_give_finite_numbers(rate):
    counts = np.cumsum(rng().integers(-2, 3, 300)) + 2**61
    for estimator in ("fdm", "kalman"):
        report = replay(Recording("made.csv", "counts", counts, rate), estimator).report()
        assert json.dumps(report, allow_nan=False)


# ---- written files --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("coarsen", [1, COARSEN])
def test_the_report_is_json_with_units(coarsen):
    report = json.loads(json.dumps(replay(swing(), coarsen=coarsen).report(), allow_nan=False))
    assert report["samples"] == 3000
    assert (report["estimator"], report["output"], report["backend"]) == ("levant", "u", "fixed")
    assert (report["coarsen"], report["rate_hz"], report["clock_hz"]) == (coarsen, 1000.0, None)
    assert (report["file"], report["column"], report["flags"]) == ("made.csv", "counts", [])
    assert 0 < report["rms_counts_per_s"] < report["rms_fdm_counts_per_s"]
    assert re.fullmatch("[0-9a-f]{64}", report["velocity_sha256"])
    assert report["samples_per_s"] == pytest.approx(3000 / report["seconds"])
    assert 0 < report["max_abs_counts_per_s"] < 1e6


@pytest.mark.parametrize("coarsen", [1, COARSEN])
def test_samples_are_saved(tmp_path, coarsen):
    made = recording(swing().counts, start_s=0.25)
    result = replay(made, coarsen=coarsen)
    path = tmp_path / "out.csv"
    path.write_text("what was there")
    result.save(path)
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == ["time_s", "count", "velocity_counts_per_s", "reference_counts_per_s"]
    assert result.acceleration_counts_per_s2 is None
    assert [int(row["count"]) for row in rows] == made.counts.tolist()
    assert [float(row["time_s"]) for row in rows] == pytest.approx(made.time_s.tolist(), abs=1e-9)
    assert [float(row["velocity_counts_per_s"]) for row in rows] == pytest.approx(
        result.velocity_counts_per_s.tolist(), rel=1e-11
    )
    saved = [float(row["reference_counts_per_s"]) for row in rows]
    assert saved == pytest.approx(result.reference_counts_per_s.tolist(), rel=1e-11)
    # The saved file can be replayed.
    again = replay(load(path, "count"), coarsen=coarsen)
    assert again.velocity_sha256 == result.velocity_sha256


@pytest.mark.parametrize("backend", ["float", "fixed"])
@pytest.mark.parametrize("estimator", ["kalman", "edge-kalman"])
def test_the_acceleration_is_saved_where_the_estimator_has_one(tmp_path, estimator, backend):
    """It is in recorded counts and true seconds: the slope of the reference, whose signal is smooth."""
    made = recording(swing().counts, start_s=0.25)
    result = replay(made, estimator, None, backend, COARSEN)
    path = tmp_path / "out.csv"
    result.save(path)
    with path.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = ["time_s", "count", "velocity_counts_per_s", "acceleration_counts_per_s2", "reference_counts_per_s"]
    assert list(rows[0]) == names
    saved = [float(row["acceleration_counts_per_s2"]) for row in rows]
    assert saved == pytest.approx(result.acceleration_counts_per_s2.tolist(), rel=1e-11)
    slope = np.gradient(result.reference_counts_per_s) * made.rate_hz
    seen, true = (each[result.judged_from :] for each in (result.acceleration_counts_per_s2, slope))
    assert np.corrcoef(seen, true)[0, 1] > 0.9
    assert np.std(seen) == pytest.approx(np.std(true), rel=0.3)
    assert [each.name for each in tmp_path.iterdir()] == ["out.csv"]


def test_a_file_that_cannot_be_written_is_refused_and_leaves_nothing(tmp_path):
    result = replay(swing())
    for write, name in ((result.save, "out.csv"), (partial(save, draw(result)), "out.png")):
        with pytest.raises(OSError, match=rf"^{re.escape(str(tmp_path))}/none/{name}: cannot be written \(No such"):
            write(tmp_path / "none" / name)
        (tmp_path / name).mkdir()
        with pytest.raises(OSError, match=r"cannot be written \(Is a directory\)$"):
            write(tmp_path / name)
    assert sorted(each.name for each in tmp_path.iterdir()) == ["out.csv", "out.png"]


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_picture_is_drawn(tmp_path, suffix):
    path = tmp_path / f"replay{suffix}"
    result = replay(swing(), coarsen=COARSEN, acceleration_max_counts_per_s2=BOUND)
    save(draw(result), path)
    content = path.read_bytes()
    assert content.startswith({".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[suffix])
    if suffix == ".svg":
        text = content.decode()
        shown = ("counts (counts)", "velocity (counts/s)", "time (s)", "finite difference", "zero-phase reference")
        for label in (
            *shown,
            f"RMS error {float(format(result.rms_counts_per_s, '.3g')):g} counts/s",
            "levant, output u",
        ):
            assert label in text
    save(draw(result), path)
    assert path.read_bytes() == content


@EVERY
def test_a_picture_of_little_is_drawn(tmp_path, estimator, output):
    save(draw(replay(recording([3, 4]), estimator, output)), tmp_path / "little.png")
    assert (tmp_path / "little.png").stat().st_size > 1000
