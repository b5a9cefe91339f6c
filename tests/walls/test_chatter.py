"""The chatter of an estimate at rest against its closed form, and the law of rest against its definition."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from hardwall.model.axis.axis import Axis
from hardwall.sim.scene.load import load
from hardwall.sim.walls import methods
from hardwall.sim.walls.chatter import Chatter, at_rest, motions
from stimuli.scenes import ODD


def scene(method: str, changes: dict | None = None):
    return load("seed-2011", methods.methods()[method].changes | (changes or {}))


def two_cycle_m_per_s(loaded) -> float:
    """Return u in Levant's cycle of two samples.

    From u1 = 0 on, u1 is a multiple of alpha: it is 0 and alpha in turn, and u is -S and S. With errors e1 and e2 to
    either side, e1 + e2 = S, l sqrt(e1) = S + a and l sqrt(e2) = S, so 2 S^2 - (l^2 - 2 a) S + a^2 = 0; the larger root
    is stable.
    """
    gains, tau, q = loaded.controller.gains.levant, 1 / loaded.controller.sample_hz, loaded.encoder.count_m
    lam, alpha = gains.lambda_sqrt_m_per_s * tau / math.sqrt(q), gains.alpha_m_per_s2 * tau**2 / q
    return max(np.roots([2, 2 * alpha - lam**2, alpha**2]).real) * q / tau


def test_a_cycle_of_two_samples_is_seen_from_one_side_where_the_force_takes_every_tenth():
    loaded = scene("adjusted")
    chatter = at_rest(loaded, "float")
    assert chatter.swing_m_per_s.max() < 1e-9
    ends = two_cycle_m_per_s(loaded)
    assert ends == pytest.approx(5e-3)
    assert np.abs(chatter.mean_m_per_s) == pytest.approx(ends)
    # The side depends on how the motion before came to rest.
    assert 0.2 < (chatter.mean_m_per_s > 0).mean() < 0.8


def test_it_is_seen_from_both_sides_where_the_force_takes_every_eleventh():
    loaded = scene("adjusted", ODD)
    chatter = at_rest(loaded, "float")
    assert chatter.swing_m_per_s == pytest.approx(2 * two_cycle_m_per_s(loaded))
    assert np.abs(chatter.mean_m_per_s).max() < 1e-9


def four_cycle_m_per_s(loaded) -> tuple[float, float]:
    """Return |u| of every second sample, and of the others, in Levant's cycle of four samples.

    The errors are p, q, -p and -q, and u1 is alpha, 0, -alpha and 0. So u = alpha - l sqrt(p) = q - p at the first, and
    -l sqrt(q) = -p - q at the second. With s = sqrt(q), p = l s - s^2.
    """
    gains, tau, count = loaded.controller.gains.levant, 1 / loaded.controller.sample_hz, loaded.encoder.count_m
    lam, alpha = gains.lambda_sqrt_m_per_s * tau / math.sqrt(count), gains.alpha_m_per_s2 * tau**2 / count

    def first(s: float) -> float:
        return alpha - lam * math.sqrt(lam * s - s**2) - (2 * s**2 - lam * s)

    s = brentq(first, 1e-9 * lam, (1 - 1e-9) * lam)
    return abs(2 * s**2 - lam * s) * count / tau, lam * s * count / tau


def gained(lam: float, ratio: float, changes: dict | None = None):
    """Return the scene with lambda and the ratio lambda^2 / alpha."""
    pair = {"lambda_sqrt_m_per_s": lam, "alpha_m_per_s2": lam**2 / ratio}
    return load("seed-2011", {"controller.gains.levant": pair} | (changes or {}))


@pytest.mark.parametrize("lam", [4.0, 8.43, 12.0])
@pytest.mark.parametrize("ratio", [2.0, 2.2, 3.0])
def test_the_force_at_every_tenth_sample_mostly_takes_the_slow_half_of_a_cycle_of_four(lam, ratio):
    loaded = gained(lam, ratio)
    seen, (slow, fast) = at_rest(loaded, "float"), four_cycle_m_per_s(loaded)
    most = np.maximum(seen.most_m_per_s, -seen.least_m_per_s)
    quiet = most < (slow + fast) / 2
    assert quiet.mean() > 0.5
    assert most[quiet] == pytest.approx(slow, abs=1e-9)
    assert most.max() == pytest.approx(fast, abs=1e-9)
    # That half is no motion at all where lambda^2 = 2 alpha: sqrt(p) = lambda / 2 solves both equations.
    assert (slow < 1e-9) == (ratio == 2.0)


@pytest.mark.parametrize("ratio", [2.0, 3.0])
def test_every_second_value_of_u1_is_0_in_a_cycle_of_four(ratio):
    seen = at_rest(gained(11.7, ratio, {"controller.output": "u1"}), "float")
    most = np.maximum(seen.most_m_per_s, -seen.least_m_per_s)
    assert (most < 1e-9).mean() > 0.5
    odd = gained(11.7, ratio, ODD | {"controller.output": "u1"})
    alpha = odd.controller.gains.levant.alpha_m_per_s2 / odd.controller.sample_hz
    assert at_rest(odd, "float").swing_m_per_s == pytest.approx(2 * alpha)


def test_the_force_at_every_eleventh_sample_takes_both_halves():
    loaded = gained(8.43, 2.0, ODD)
    assert at_rest(loaded, "float").swing_m_per_s == pytest.approx(2 * four_cycle_m_per_s(loaded)[1])


def test_words_move_the_chatter_by_no_more_than_a_few_of_the_root_s_last_bits():
    """The root's last bit, here 2^-6 counts^(1/2), moves u by lambda times that bit."""
    loaded = scene("adjusted")
    bit = loaded.controller.gains.levant.lambda_sqrt_m_per_s * math.sqrt(1e-6) * loaded.spec.design.estimator.root.lsb
    fixed = at_rest(loaded, "fixed")
    assert np.abs(np.abs(fixed.mean_m_per_s) - two_cycle_m_per_s(loaded)).max() < 2 * bit
    assert 0 < fixed.swing_m_per_s.max() < 4 * bit


def test_what_the_force_takes_is_what_the_drive_shows():
    """In a wall that is only a damper and fills all space, it is the drive over B, to half the drive's resolution."""
    loaded = scene("proposed")
    damper = {"wall_stiffness": 0.0, "wall_damping": 400.0, "wall_position": -1e-3}
    drive = Axis(loaded.spec, **loaded.parameters | damper).run(motions(loaded)).drive_n[:, 3000:]
    velocity = -drive / 400.0
    chatter, half = at_rest(loaded, "fixed"), loaded.spec.force_resolution_n / 2 / 400.0
    assert np.abs(velocity.max(axis=1) - chatter.most_m_per_s).max() <= half * (1 + 1e-9)
    assert np.abs(velocity.min(axis=1) - chatter.least_m_per_s).max() <= half * (1 + 1e-9)


@pytest.mark.parametrize("estimator", ["fdm", "levant-implicit"])
def test_what_comes_to_rest_lets_the_handle_rest_in_every_wall(estimator):
    chatter = at_rest(load("seed-2011", {"controller.estimator": estimator}), "fixed")
    assert np.array_equal(chatter.most_m_per_s, chatter.least_m_per_s)
    assert chatter.rests_up_to(0.1, 0.3572).min() == math.inf


def test_the_law_is_that_a_place_of_rest_exists():
    dice = np.random.default_rng(7)
    ends = np.sort(dice.normal(size=(2, 500)) * 5e-3, axis=0)
    for coulomb, push in ((0.1, 0.3572), (0.3, 0.1)):
        limits = Chatter(*ends).rests_up_to(coulomb, push)
        for times, wanted in ((0.999, True), (1.001, False)):
            damping, stiffness = limits * times, 10 ** dice.uniform(2, 5, 500)
            # Either of the two velocities alone would let the handle rest.
            low, high = ((push + side * coulomb - damping * ends) / stiffness for side in (-1, 1))
            exists = np.minimum(*high) >= np.maximum(np.maximum(*low), 1e-15)
            assert (exists == wanted).all()


def test_an_estimator_of_stamps_is_refused():
    with pytest.raises(ValueError, match=r"one that needs only counts, not 'period'; hardwall.model.stamped.run takes"):
        at_rest(load("seed-2011", {"controller.estimator": "period"}), "fixed")
