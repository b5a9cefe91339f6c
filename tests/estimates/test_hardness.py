"""Rate-hardness: a contact by hand, forces made by hand, every start, and refused motions."""

import numpy as np
import pytest

from hardwall.model.encoder.quadrature import latency
from hardwall.sim.estimates import hardness, moved_handle
from hardwall.sim.estimates.motions import Steady, position
from hardwall.sim.estimates.moved_handle import Answer, MotionError
from hardwall.sim.scene.case import Case
from hardwall.sim.studies.rates import at_rate
from hardwall.sim.walls.starts import Start, start

FDM = {"controller.estimator": "fdm", "controller.output": None}
SLOW = FDM | {
    "controller.sample_hz": 1_000, "controller.clock_hz": 1_000_000, "controller.speed_max_m_per_s": 0.5,
    "amplifier": None,
}  # fmt: skip


def test_a_contact_by_hand():
    """1 kHz, 50 mm/s: 50 counts a sample, so that the difference has the exact velocity.

    The clock is 1 MHz, a strobe is at 999, 1999, ... us, and sees the place of 6 us before. The contact is at 100.01
    ms. The first strobe behind it, at 100.999 ms, counts 983 us of the way: 49 counts. Its force, 49 um of 10 N/mm and
    50 mm/s of 20 N s/m, acts 6 us later, 995 us after the contact; the next one, of 99 counts, a millisecond later.
    From 1.8 to 2.2 ms there are 195 us of 1.49 N and 205 us of 1.99 N: 1.74625 N, over 2 ms and 50 mm/s.
    """
    scene = Case.of("seed-2011", SLOW).scene
    assert (latency(scene.glitch_clocks), scene.spec.design.latency_to_drive) == (6, 6)
    push = moved_handle.answer(scene, Steady(0.05, -5.0005e-3), 150, 1e-3, "float")
    assert push.push_n[99:103].tolist() == pytest.approx([0, 1.49, 1.99, 2.49], rel=1e-12)
    found = hardness.rate_hardness_n_per_m(push, 0.10001, 0.05, 2e-3)
    assert found == pytest.approx(17_462.5, rel=1e-9)
    first_n, after_s = hardness.first_force(push, 0.10001, 2e-3)
    assert (first_n, after_s) == pytest.approx((1.49, 995e-6), rel=1e-9)


def test_an_ideal_wall_has_k_and_b_over_the_window():
    """A force that is neither late nor held, in steps as short as one likes."""
    scene, step_s = Case.of("seed-2011").scene, 1e-7
    times = step_s * (np.arange(40_000) + 0.5)
    for speed, contact_s, window_s in ((0.05, 1e-3, 2e-3), (0.2, 0.5e-3, 1e-3)):
        forces = np.where(times > contact_s, 10e3 * speed * (times - contact_s) + 20.0 * speed, 0.0)
        push = Answer(forces, forces, 0.0, step_s, [])
        found = hardness.rate_hardness_n_per_m(push, contact_s, speed, window_s)
        assert found == pytest.approx(hardness.ideal_n_per_m(scene, window_s), rel=1e-9)
        assert hardness.ideal_n_per_m(scene, window_s) == 10e3 + 20.0 / window_s
        first_n, after_s = hardness.first_force(push, contact_s, window_s)
        assert first_n == pytest.approx(20.0 * speed, rel=1e-3)
        assert 0 <= after_s <= step_s


@pytest.mark.parametrize("rate_hz", [1_000, 10_000, 100_000])
def test_a_force_that_is_late_and_held_is_softer_by_that(rate_hz):
    """A difference has the velocity to a count a sample, and the depth is a mean of half a count less; over the starts,
    a force is late by the path and by half a period."""
    case = Case.of("seed-2011", at_rate(rate_hz) | FDM)
    found = hardness.measure(**case.job(), backend="float", speed_m_per_s=0.05, window_s=1.5e-3, starts=200)
    scene, total_s = case.scene, latency(2) + case.scene.spec.design.latency_to_drive
    total_s = total_s / scene.spec.clock_hz + 0.5 / rate_hz
    expected = 10e3 * (1 - (total_s + 0.5e-6 / 0.05) / 1.5e-3) + 20.0 / 1.5e-3
    # 200 uniform starts have a mean within four standard errors; the force varies by a period's rise at most.
    apart = 10e3 / rate_hz / 1.5e-3 + 20.0 * 1e-6 * rate_hz / 0.05 / 1.5e-3 / max(1, 3e-4 * rate_hz)
    assert np.mean(found["rate_hardness_n_per_m"]) == pytest.approx(expected, abs=4 * apart / (12 * 200) ** 0.5)


def test_starts_are_uniform_in_the_count_and_in_the_period():
    scene = Case.of("seed-2011", SLOW).scene
    speed, count_m = 0.05, scene.encoder.count_m
    for chosen in (Start(0.0, 0.0), Start(0.25, 0.0), Start(0.0, 0.75), Start(0.999, 0.999), *map(start, range(20))):
        motion, contact_s = hardness.path(scene, speed, chosen)
        assert position(motion, contact_s) == pytest.approx(0, abs=1e-15)
        # Before its part of a period it was at the chosen place in a count.
        counts = position(motion, -chosen.periods * 1e-3) / count_m
        assert (counts - chosen.counts) % 1 == pytest.approx(0, abs=1e-6) or (counts - chosen.counts) % 1 > 1 - 1e-6
        assert hardness.LEAD_S - count_m / speed <= contact_s <= hardness.LEAD_S + 1e-3 + count_m / speed
        reached_s = hardness.samples_of(scene, speed, 2e-3) / 1000
        assert contact_s + 1.1 * 2e-3 < reached_s


def test_contacts_are_uniform_in_the_period():
    """A speed of whole counts in a period, at which a count is a fiftieth of it."""
    scene = Case.of("seed-2011", SLOW).scene
    phases = sorted(hardness.path(scene, 0.05, start(number))[1] / 1e-3 % 1 for number in range(400))
    # The distance of 400 uniform numbers from their distribution is below this in 999 of 1000 draws.
    assert np.abs(np.arange(400) / 400 - phases).max() < 1.95 / 400**0.5


def test_a_short_travel_shortens_the_way_and_a_slow_motion_keeps_two_counts():
    scene = Case.of("seed-2011", FDM).scene
    assert hardness.lead_s(scene, 0.05) == 0.1
    assert hardness.lead_s(scene, 1.5) == pytest.approx(0.05)
    assert hardness.lead_s(scene, 1e-5) == pytest.approx(0.2)


def test_a_wall_that_does_not_answer_in_time_has_no_first_force():
    quiet = Answer(np.zeros(40), np.zeros(40), 0.0, 1e-3, [])
    assert hardness.first_force(quiet, 5e-3, 2e-3) == (None, None)
    forces = np.zeros(40)
    forces[10:] = 3.0
    late = Answer(forces, forces, 0.0, 1e-3, [])
    assert hardness.first_force(late, 7.9e-3, 2e-3) == (None, None)
    assert hardness.first_force(late, 8.1e-3, 2e-3) == pytest.approx((3.0, 1.9e-3))
    assert hardness.rate_hardness_n_per_m(late, 7e-3, 0.1, 2e-3) == 0


@pytest.mark.parametrize(
    ("speed_m_per_s", "window_s", "said"),
    [
        (3.0, 2e-3, "a speed of 3000 mm/s until 2 ms after the contact is a speed of 3 m/s, which must be 0 to 2"),
        (
            1.9,
            0.1,
            "a speed of 1900 mm/s until 100 ms after the contact is a depth of 0.209 m, which must be 0 to 0.",
        ),
    ],
)
def test_a_handle_that_cannot_be_moved_so_is_refused(speed_m_per_s, window_s, said):
    with pytest.raises(MotionError) as refused:
        hardness.check(Case.of("seed-2011").scene, speed_m_per_s, window_s)
    assert str(refused.value).startswith(said)
