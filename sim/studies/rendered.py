"""What a wall renders of what it is commanded: stiffness and damping by frequency, and rate-hardness at contact.

The handle is moved along a known path, so that stability is no question: what is rendered is what an instrument on the
handle would measure, were the drive ideal. See `estimates.impedance` and `estimates.hardness` for the measures.

As the path is given, the estimate does not depend on the wall, and what is rendered is linear in K and B but for the
words' rounding and limits: at a frequency B_r = -K T + B g, with a total delay T (`walls.theory.delay_s`, and half a
period of the hold) and a gain g of the estimator. The spring alone, B = 0, gives K T; both together give the damping
B* = K T / g below which the wall renders a negative one.
"""

from collections.abc import Callable
from typing import Any

from ..estimates import hardness, impedance, moved_handle
from ..scene.case import Case
from ..walls.methods import Curve
from .rates import at_rate
from .rendered_result import Moving, Rendered
from .rendered_setting import Setting, slow_hz

RATES_HZ = (1_000, 10_000, 1_000_000)
FREQUENCIES_HZ = (1, 5, 10, 20, 50, 100, 200, 400)
SPEEDS_MM_PER_S = (10.0, 50.0, 200.0)
AMPLITUDE_MM = 0.1
WINDOW_MS = 2.0
STARTS = 10
METHODS = ("fdm", "fdm-100", "butterworth", "adjusted", "levant:u1", "kalman", "levant-edge")
"""A difference without a filter, with a slow one and with a fast one; the founding paper's; and the most accurate from
counts and from stamps of edges."""

SPRING = 0
"""The place of a frequency at which the spring alone is moved, at `slow_hz`."""

Run = Callable[[str, Callable[..., dict], list[dict]], list[dict]]
"""What returns the results of jobs, by a title, the function of the jobs, and their arguments."""


def study(
    case: Case, curves: list[Curve], rates_hz: list[int], moving: Moving, backend: str, starts: int, run: Run
) -> Rendered:
    """Return what the wall of a scene renders with every estimator, at the scene's own rates and at others.

    Args:
        case: the scene.
        curves: the estimators.
        rates_hz: the other rates.
        moving: how the handle is moved; a frequency is left out at a rate that is not more than twice as high.
        backend: one of `backends.BACKENDS`.
        starts: number of starts.
        run: what does the jobs.

    Raises:
        SceneError: if there is no such axis, or the scene has a coupling.
        MotionError: if the handle cannot be moved so.
        RuntimeError: if the RTL could not be built.
    """
    case.without_coupling("what is rendered is a wall's, and not that of a tool")
    places = [
        (curve, rate, case.changed(curve.changes | (at_rate(rate) if rate else {}), curve.label))
        for curve in curves
        for rate in (None, *rates_hz)
    ]
    waves, contacts = _jobs([place for *_, place in places], moving, {"backend": backend, "starts": starts})

    def results(title: str, function: Callable[..., dict], jobs: dict[Any, dict]) -> dict[Any, dict]:
        # The fastest rates come first, because they take longest.
        keys = sorted(jobs, key=lambda key: -places[key[0]][-1].scene.controller.sample_hz)
        return dict(zip(keys, run(title, function, [jobs[key] for key in keys]), strict=True))

    rendered = results("what is rendered by frequency", impedance.measure, waves)
    struck = results("what is rendered at contact", hardness.measure, contacts)
    settings = []
    for number, (curve, rate, place) in enumerate(places):
        own = {frequency: result for (of, frequency), result in rendered.items() if of == number}
        spring = own.pop(SPRING, None)
        felt = {speed: result for (of, speed), result in struck.items() if of == number}
        settings.append(Setting(curve, rate, place, own, spring, felt))
    return Rendered(case.scene, backend, starts, moving, settings)


def _jobs(places: list[Case], moving: Moving, common: dict[str, Any]) -> tuple[dict[Any, dict], dict[Any, dict]]:
    """Return the jobs of `impedance.measure` and of `hardness.measure`, by the number of the place and by frequency, or
    `SPRING`, and speed.

    Raises:
        SceneError: if there is no such axis.
        MotionError: if the handle cannot be moved so.
    """
    fastest_hz = max(place.scene.controller.actuation_hz for place in places)
    highest_hz = moving.frequencies_hz[-1]
    moved_handle.check("the fastest motion", ("a frequency", highest_hz, 1, (fastest_hz - 1) // 2, "Hz"))
    wave, contact = common | {"amplitude_m": moving.amplitude_m}, common | {"window_s": moving.window_s}
    waves, contacts = {}, {}
    for number, place in enumerate(places):
        scene = place.scene
        possible = [each for each in moving.frequencies_hz if 2 * each < scene.controller.actuation_hz]
        for frequency_hz in possible:
            impedance.check(scene, frequency_hz, moving.amplitude_m)
            waves[number, frequency_hz] = wave | {"frequency_hz": frequency_hz, **place.job()}
        if possible:
            undamped = place.changed({"wall.damping_n_s_per_m": 0.0})
            waves[number, SPRING] = wave | {"frequency_hz": slow_hz(possible), **undamped.job()}
        for speed_m_per_s in moving.speeds_m_per_s:
            hardness.check(scene, speed_m_per_s, moving.window_s)
            contacts[number, speed_m_per_s] = contact | {"speed_m_per_s": speed_m_per_s, **place.job()}
    return waves, contacts
