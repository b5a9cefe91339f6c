"""Rate-hardness of a wall: how fast its force rises at contact, over the speed of the contact, N/m.

The metric is from Lawrence, Pao, Dougherty, Salada and Pavlou (2000): the initial rate of change of the force over the
velocity of penetration. The handle is moved into the wall at a constant speed v. The force is 0 before the contact, and
its initial rate of change is that to the time W behind it,

    rate-hardness = push(W) / (W v),

where push(W) is the mean push from 0.9 W to 1.1 W: not one step of a held force, nor one sample of a noisy estimate. A
wall of K and B that is neither late nor held has K + B / W: its force is B v at once, a step of infinite rate, and then
rises by K v. So the first force that acts is said apart, and how long after the contact.

The contact is the time at which the handle passes position 0. The wall's first force comes with its first count.
"""

import math

from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.starts import Start, start
from . import moved_handle
from .impedance import EDGES_MAX, SAMPLES_MAX, in_order
from .motions import Steady
from .moved_handle import Answer

LEAD_S = 0.1
"""The time of motion before the contact, s, if the travel is long enough: the estimators settle in it."""
STEP_S = 1e-3
"""The time in which edges are looked for at once."""
MEAN = 0.1
"""The part of W, before and behind it, over which the push at W is a mean."""


def ideal_n_per_m(scene: Scene, window_s: float) -> float:
    """Return the rate-hardness of a scene's wall as it is commanded, neither late nor held."""
    return scene.wall.stiffness_n_per_m + scene.wall.damping_n_s_per_m / window_s


def lead_s(scene: Scene, speed_m_per_s: float) -> float:
    """Return the time of motion before the contact, s: at least the time of two counts."""
    longest_s, two_s = (way_m / speed_m_per_s for way_m in (scene.controller.travel_m / 2, 2 * scene.encoder.count_m))
    return max(min(LEAD_S, longest_s), two_s)


def path(scene: Scene, speed_m_per_s: float, from_: Start) -> tuple[Steady, float]:
    """Return the motion from a start, and the time of the contact (s). The handle begins at the start's place in a
    count, and at its phase in a period of the force."""
    count_m, period_s = scene.encoder.count_m, 1 / scene.controller.actuation_hz
    counts = math.ceil(speed_m_per_s * (lead_s(scene, speed_m_per_s) + period_s) / count_m)
    start_m = (from_.counts - counts) * count_m + speed_m_per_s * from_.periods * period_s
    return Steady(speed_m_per_s, start_m), -start_m / speed_m_per_s


def samples_of(scene: Scene, speed_m_per_s: float, window_s: float) -> int:
    """Return a number of samples that reaches behind the window from any start."""
    spec = scene.spec
    latest_s = lead_s(scene, speed_m_per_s) + 1 / spec.actuation_hz + spec.count_m / speed_m_per_s
    return math.ceil((latest_s + (1 + MEAN) * window_s) * spec.sample_hz) + 1


def check(scene: Scene, speed_m_per_s: float, window_s: float) -> None:
    """Raise MotionError if a handle cannot be moved so."""
    controller, samples = scene.controller, samples_of(scene, speed_m_per_s, window_s)
    edges = samples / controller.sample_hz * speed_m_per_s / scene.encoder.count_m
    moved_handle.check(
        f"a speed of {speed_m_per_s * 1e3:g} mm/s until {window_s * 1e3:g} ms after the contact",
        ("a speed", speed_m_per_s, 0, controller.speed_max_m_per_s, "m/s"),
        ("a depth", speed_m_per_s * (1 + MEAN) * window_s, 0, controller.travel_m / 4, "m"),
        ("a run", samples, 1, SAMPLES_MAX, "samples"),
        ("a run", edges, 0, EDGES_MAX, "edges"),
    )


def rate_hardness_n_per_m(push: Answer, contact_s: float, speed_m_per_s: float, window_s: float) -> float:
    """Return the rate-hardness of an answer to a motion at constant speed."""
    ends_s = (contact_s + (1 + side) * window_s for side in (-MEAN, MEAN))
    return push.impulse_n_s(*ends_s) / (2 * MEAN * window_s) / (window_s * speed_m_per_s)


def first_force(push: Answer, contact_s: float, window_s: float) -> tuple[float, float] | tuple[None, None]:
    """Return the first push (N) that acts, and how long after the contact (s); None if there is none within W."""
    acting = push.push_n.nonzero()[0]
    if not len(acting):
        return None, None
    after_s = push.first_s + push.step_s * int(acting[0]) - contact_s
    return (float(push.push_n[acting[0]]), after_s) if after_s <= window_s else (None, None)


def measure(
    scene: str, text: str, changes: dict, backend: str, speed_m_per_s: float, window_s: float, starts: int
) -> dict:
    """Return the rate-hardness of the wall of a case at a speed, from so many starts.

    Args:
        scene, text, changes: the case, as `Case.job` has it.
        backend: one of `backends.BACKENDS`.
        speed_m_per_s: the speed.
        window_s: W.
        starts: number of starts.

    Returns:
        rate_hardness_n_per_m: list of the rate-hardness, by start.
        first_n, first_s: lists of the first push, and of how long after the contact it acts; None for none within W.
        flags: names of the flags that were raised.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    known = Case("", scene, text, changes).scene
    samples = samples_of(known, speed_m_per_s, window_s)
    hardness, firsts, flags = [], [], set()
    for number in range(starts):
        motion, contact_s = path(known, speed_m_per_s, start(number))
        push = moved_handle.answer(known, motion, samples + known.delay_samples, STEP_S, backend)
        hardness.append(rate_hardness_n_per_m(push, contact_s, speed_m_per_s, window_s))
        firsts.append(first_force(push, contact_s, window_s))
        flags |= set(push.flags)
    return {
        "rate_hardness_n_per_m": hardness,
        "first_n": [push_n for push_n, _ in firsts],
        "first_s": [after_s for _, after_s in firsts],
        "flags": in_order(known, flags),
    }
