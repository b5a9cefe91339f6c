"""A wall that answers a moved handle: place, time and size of every force, and the same words by the RTL."""

import math
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest

from hardwall.model.encoder.quadrature import latency
from hardwall.sim.estimates import moved_handle
from hardwall.sim.estimates.motions import Sine, Steady
from hardwall.sim.scene.case import Case
from hardwall.sim.scene.schema import Scene

PROMPT = {"amplifier": None, "controller.estimator": "fdm", "controller.output": None}
SINE = Sine(3.3e-4, 2.1e-4, 37.0, 1.3e-3)


def scene(**changes) -> Scene:
    return Case.of("seed-2011", PROMPT | {key.replace("__", "."): value for key, value in changes.items()}).scene


def pushes(known: Scene, motion: Steady, samples: int) -> list[Fraction]:
    """Return the push of every sample at the force's rate, in newtons, from the places at the clocks that are counted.

    It is exact arithmetic on what the pages say: nothing of the simulation takes part.
    """
    controller, count = known.controller, Fraction(known.encoder.count_m).limit_denominator(10**9)
    clocks, every = controller.clock_hz // controller.sample_hz, controller.sample_hz // controller.actuation_hz
    start, speed = Fraction(motion.start_m), Fraction(motion.speed_m_per_s)
    cells = []
    for k in range(-1, samples):
        clock = max(clocks * (k + 1) - 1 - latency(known.glitch_clocks), 0)
        cells.append(math.floor((start + speed * clock / controller.clock_hz) / count))
    stiffness, damping = Fraction(known.wall.stiffness_n_per_m), Fraction(known.wall.damping_n_s_per_m)
    found = []
    for before, here in pairwise(cells):
        push = count * (stiffness * here + damping * (here - before) * controller.sample_hz)
        found.append((push if here > 0 else Fraction(0)) if len(found) % every == 0 else found[-1])
    return found


@pytest.mark.parametrize(
    ("changes", "samples"),
    [({}, 300), ({"controller__sample_hz": 1000}, 60), ({"amplifier": {"delay_s": 3e-4}}, 300)],
)
def test_every_force_is_that_of_the_place_that_was_counted(changes, samples):
    known, motion = scene(**changes), Steady(0.0317, -3.17e-4)
    found = moved_handle.answer(known, motion, samples, 1e-3, "float")
    expected, late = pushes(known, motion, samples), known.delay_samples
    assert len(found.push_n) == samples
    assert found.push_n[:late].tolist() == [0.0] * late
    in_time = [float(each) for each in expected[: samples - late]]
    assert found.push_n[late:].tolist() == pytest.approx(in_time, rel=1e-12)
    assert max(expected) > 5
    design = known.spec.design
    clocks = known.spec.clocks_per_sample - 1 + design.latency_to_drive
    assert (found.first_s, found.step_s) == (clocks / known.spec.clock_hz, 1 / known.spec.sample_hz)


def test_the_rtl_answers_with_the_words_of_fixed():
    known = scene(controller__estimator="levant")
    fixed, rtl = (moved_handle.answer(known, SINE, 500, 1e-3, backend) for backend in ("fixed", "rtl"))
    assert fixed.drives.tolist() == rtl.drives.tolist()
    assert fixed.flags == rtl.flags == []
    assert len(set(fixed.drives.tolist())) > 30


def test_words_differ_from_float64_by_their_rounding():
    known = scene()
    floating, fixed = (moved_handle.answer(known, SINE, 500, 1e-3, backend) for backend in ("float", "fixed"))
    words = {word.name: word for word in known.spec.design.words}
    relative = max(
        abs(words[name].to_si(known.words[name]) / value - 1)
        for name, value in (
            ("wall_stiffness", known.wall.stiffness_n_per_m),
            ("wall_damping", known.wall.damping_n_s_per_m),
        )
    )
    # Spring and damper may have different signs, so that the rounding of gains counts for the sum of their sizes: at
    # most the spring's, and the damper's of the largest difference of counts.
    depth_n = known.wall.stiffness_n_per_m * (SINE.centre_m + SINE.amplitude_m)
    speed_m_per_s = math.tau * SINE.frequency_hz * SINE.amplitude_m + known.spec.velocity_unit_m_per_s
    largest_n = depth_n + known.wall.damping_n_s_per_m * speed_m_per_s
    bound_n = known.controller.force_resolution_n + relative * largest_n
    assert 0 < np.abs(floating.push_n - fixed.push_n).max() <= bound_n


def test_what_is_put_out_has_the_steps_of_the_converter():
    known = scene(output={"full_scale_n": 40.0, "dac_bits": 9})
    found = moved_handle.answer(known, SINE, 500, 1e-3, "fixed")
    step_n = 80 / 512
    commands_n = found.drives * known.controller.force_resolution_n
    assert (found.push_n / step_n).tolist() == (-np.floor(commands_n / step_n + 0.5)).tolist()


def test_an_impulse_is_of_the_force_as_it_is_held():
    found = moved_handle.Answer(np.zeros(3), np.array([1.0, 4.0, -2.0]), 0.5, 0.25, [])
    assert found.impulse_n_s(0.0, 0.5) == 0
    assert found.impulse_n_s(0.25, 0.75) == pytest.approx(0.25)
    assert found.impulse_n_s(0.625, 1.125) == pytest.approx(0.125 + 1.0 - 0.25)
    assert found.impulse_n_s(0.875, 0.875) == 0


def test_flags_are_named():
    known = scene(wall__stiffness_n_per_m=200e3)
    assert moved_handle.answer(known, SINE, 500, 1e-3, "fixed").flags == ["force_limited"]
