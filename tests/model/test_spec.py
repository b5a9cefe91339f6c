"""The axis's specification: what follows from it, and what it refuses."""

import json
import math
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hardwall.model.axis.axis import Axis
from hardwall.model.encoder.quadrature import seen_count
from hardwall.model.estimators import levant
from hardwall.model.estimators.estimate import estimate
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.spec import AxisSpec
from stimuli.papers_signal import axis_at, swing
from stimuli.specs import ADJUSTED, MHZ, PAPER, SPECS, spec


@pytest.mark.parametrize("name", SPECS)
@pytest.mark.parametrize("estimator", ["levant", "fdm"])
def test_every_extreme_value_of_the_axis_fits_its_format(name, estimator):
    axis = spec(name, estimator)
    design = axis.design
    assert axis.travel_m / axis.count_m * 4 <= 2 ** (axis.count_width - 1)
    assert axis.force_max_n / axis.force_resolution_n <= axis.force.max / 2 + 1
    fastest = 2 * axis.speed_max_counts_per_sample
    assert design.estimator.velocity.to_real(design.estimator.velocity.max + 1) >= fastest
    words = {word.name: word for word in design.words}
    for name_, si in (("wall_stiffness", axis.stiffness_max_n_per_m), ("wall_damping", axis.damping_max_n_s_per_m)):
        assert words[name_].to_si(words[name_].from_si(si)) == pytest.approx(si, abs=words[name_].to_si(1))
    # The largest damping times half a velocity LSB of the damper moves the force by at most half an LSB.
    half = design.wall.coarse.lsb / 2 if design.wall.coarse.f < design.estimator.velocity.f else 0
    assert axis.damping_max_n_s_per_m / words["wall_damping"].si_per_unit * half <= 0.5


@pytest.mark.parametrize("name", ["paper", "proposed", "mhz", "wide"])
def test_gain_words_are_as_close_as_promised(name):
    axis = spec(name)
    lam, alpha, _ = axis.design.estimator.words
    gains = axis.design.gains
    assert lam.to_si(lam.reset) == pytest.approx(gains.lambda_sqrt_m_per_s, rel=2.0**-14)
    assert alpha.to_si(alpha.reset) == pytest.approx(gains.alpha_m_per_s2, rel=2.0**-10)
    # The words have two bits of headroom; but a lambda of more than 2 a sample would hold u1 still.
    assert lam.si_max >= min(3.9 * gains.lambda_sqrt_m_per_s, 2 * lam.si_per_unit)
    assert alpha.si_max >= 3.9 * gains.alpha_m_per_s2


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sample_hz": 7_000}, r"sample_hz must divide clock_hz 12000000, not 7000"),
        ({"actuation_hz": 3_000}, r"actuation_hz must divide sample_hz 10000, not 3000"),
        ({"clock_hz": -1}, r"clock_hz must be 1 to 281474976710656, not -1"),
        ({"count_m": math.nan}, r"count_m must be 1e-30 to 1e\+30, not nan"),
        ({"travel_m": 1e-9}, r"travel_m must be at least one count of 1e-06 m, not 1e-09"),
        ({"travel_m": 1e6}, r"travel_m must be at most 536.871 for a 32-bit count"),
        ({"force_resolution_n": 1e-9}, r"force_resolution_n must be .* to 40"),
        ({"force_resolution_n": 41.0}, r"force_resolution_n must be .* to 40"),
        (
            {"sample_hz": 2_000_000},
            r"sample_hz must leave 10 clocks from a sample to the next, so at most 1200000 at clock_hz 12000000, not",
        ),
        ({"estimator": "nobody"}, f"estimator must be one of {', '.join(ESTIMATORS)}, not 'nobody'"),
        (
            {"stiffness_max_n_per_m": 1e-30},
            r"stiffness_max_n_per_m must be at least .* beside the other gain's largest and .* speed, not 1e-30",
        ),
    ],
)
def test_impossible_axes_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        AxisSpec(**(PAPER | changes))


def test_an_estimator_that_is_too_quick_for_the_wall_is_refused(monkeypatch):
    monkeypatch.setattr(ESTIMATORS["fdm"], "latency", 1)
    with pytest.raises(ValueError, match=r"^estimator must take 2 clocks or more, as the wall's lead does, not 1$"):
        AxisSpec(**PAPER, estimator="fdm")


@pytest.mark.parametrize("changes", [{"clock_hz": 12e6}, {"count_m": "1"}, {"travel_m": True}])
def test_fields_of_the_wrong_kind_are_refused(changes):
    with pytest.raises(TypeError, match="not "):
        AxisSpec(**(PAPER | changes))


def test_unknown_parameters_and_values_that_do_not_fit_are_refused():
    with pytest.raises(ValueError, match=r"parameter must be one of .*wall_stiffness.*, not 'stiffness'"):
        Axis(spec("paper"), stiffness=1.0)
    with pytest.raises(ValueError, match=r"wall_stiffness must be 0 to 255996 N/m, not 1000000.0"):
        Axis(spec("paper"), wall_stiffness=1e6)


def test_counts_that_are_no_counts_are_refused():
    axis = Axis(spec("paper"))
    with pytest.raises(TypeError, match="counts must be integers"):
        axis.run(np.array([0.5]))
    with pytest.raises(ValueError, match="counts must have 1 or 2 dimensions, not 3"):
        axis.run(np.zeros((1, 1, 1), np.int64))


def test_lanes_are_independent_axes_side_by_side():
    axis = Axis(spec("paper"), wall_stiffness=1e3, wall_damping=5.0)
    counts = np.cumsum(np.random.default_rng(1).integers(-40, 41, (3, 500)), axis=1)
    together = axis.run(counts)
    for lane in range(3):
        alone = axis.run(counts[lane])
        for name in ("velocity", "force", "drive", "flags"):
            assert (getattr(together, name)[lane] == getattr(alone, name)).all()


def figure_2_counts(estimator: str = "levant") -> tuple[np.ndarray, AxisSpec]:
    """Return the counts of the signal of Figure 2, and the axis for its estimate."""
    return swing(10_000, 5.0)[0], axis_at(estimator, 10_000)


def figure_2(estimator: str, floating: bool) -> float:
    """Return the RMS error (mm/s) of the founding paper's second figure at 10 kHz, from 1 s on."""
    counts, exact = swing(10_000, 5.0)
    error = Axis(axis_at(estimator, 10_000), floating).run(counts).velocity_m_per_s - exact
    return 1e3 * math.sqrt(np.mean(error[10_000:] ** 2))


def test_fixed_point_gives_the_same_finite_difference():
    assert figure_2("fdm", floating=False) == figure_2("fdm", floating=True)


def test_fixed_point_costs_levant_no_more_than_its_rounding_is_worth():
    """The fixed-point estimator is the exact one on a position displaced by eta (`model.levant`, by test_levant).

    Quantisation displaces the position by up to half a count about its mean. Levant's error goes with the square root
    of the displacement, so it grows by no more than sqrt(1 + eta / 0.5), with the largest eta that this record's errors
    allow; gains that are off by up to 2**-10 change it in proportion.
    """
    floating, fixed = (figure_2("levant", floating) for floating in (True, False))
    design = axis_at("levant", 10_000).design.estimator
    error = largest_error(design)
    lam = design.words[0].reset * design.lambda_.lsb
    delta = lam * 2.0 ** -(design.root.f + 1) + 2.0 ** -(design.velocity.f + 1)
    eta = 2 * math.sqrt(error) * delta / lam + (delta / lam) ** 2
    assert abs(fixed / floating - 1) <= math.sqrt(1 + eta / 0.5) * (1 + 2.0**-10) - 1


def largest_error(design) -> float:
    """Return the largest |e| in counts, from 1 s on in the record of Figure 2."""
    counts, axis = figure_2_counts()
    params, state, largest = design.params({w.name: w.reset for w in design.words}), levant.START, 0.0
    for k, count in enumerate(counts.tolist()):
        if k >= axis.sample_hz:
            largest = max(largest, abs(state.lead * design.velocity.lsb - (count - state.count)))
        state, _, _ = estimate(params, state, seen_count(count), 0)
    return largest


def test_float_takes_the_gains_that_it_is_given():
    counts = figure_2_counts()[0][:2000]
    axis = spec("paper")
    designed, given = (Axis(axis, True, **si).run(counts) for si in ({}, {"levant_lambda": 5.0, "levant_alpha": 20.0}))
    fixed = Axis(axis, levant_lambda=5.0, levant_alpha=20.0).run(counts)
    assert np.abs(given.velocity_m_per_s - designed.velocity_m_per_s).max() > 1e-3
    # The two are the same algorithm until a rounding tips the first sign.
    assert np.abs(given.velocity_m_per_s - fixed.velocity_m_per_s)[:20].max() < 1e-3


def test_the_same_spec_at_two_rates_has_the_same_si_gains():
    slow, fast = AxisSpec(**PAPER, gains=ADJUSTED), AxisSpec(**MHZ, gains=ADJUSTED)
    for ours, theirs in zip(slow.design.estimator.words[:2], fast.design.estimator.words[:2], strict=True):
        assert ours.to_si(ours.reset) == pytest.approx(theirs.to_si(theirs.reset), rel=2.0**-9)


def test_plain_python_gives_the_same_words():
    """Without the JIT the same kernels run as ordinary Python, also on NumPy's scalars."""
    code = (
        "import sys, json; sys.path[:0] = sys.argv[1:]; from test_spec import words_of_levant_and_fdm; "
        "print(json.dumps(words_of_levant_and_fdm()))"
    )
    command = [sys.executable, "-W", "error", "-c", code, *map(str, Path(__file__).parents[:2])]
    plain = subprocess.run(
        command, env=os.environ | {"NUMBA_DISABLE_JIT": "1"}, capture_output=True, text=True, check=True
    )
    assert json.loads(plain.stdout) == words_of_levant_and_fdm()
    assert plain.stdout.count(",") > 2000


def words_of_levant_and_fdm() -> list[list]:
    """Return all words of an axis with either estimator on a random walk."""
    counts = np.cumsum(np.random.default_rng(1).integers(-300, 301, 400))
    axes = (Axis(spec("paper", name), wall_stiffness=1e3, wall_damping=5.0) for name in ("levant", "fdm"))
    records = [axis.run(counts) for axis in axes]
    return [array.tolist() for r in records for array in (r.velocity, r.force, r.drive, r.flags)]
