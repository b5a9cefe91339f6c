"""The rendered against the commanded wall: stiffness and damping by frequency, and rate-hardness at contact.

The handle is moved along a known path, so stability plays no part. The rendered values are those that an instrument on
the handle would measure with an ideal drive. See `estimates.impedance` and `estimates.hardness` for the measures.

As the path is given, the estimate does not depend on the wall. The rendered values are linear in K and B, except for
the words' rounding and limits. At a frequency, B_r = -K T + B g: T is the total delay (`walls.theory.delay_s`, and half
a period of the hold), g a gain of the estimator. The spring alone, B = 0, gives K T; both together give the damping B*
= K T / g below which the wall renders a negative one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...model.runtime.result import Table, table_of
from ..estimates import hardness, impedance, moved_handle
from ..jobs.parallel import Run
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls.methods import Curve
from .rates import at_rate
from .rendered_setting import WITHIN, Setting, Spread, slow_hz, spread

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
WIDE = 0.02
"""The part of the commanded value from which on a table has the least and the largest value of the starts."""


class Moving(NamedTuple):
    """How the handle is moved: frequencies and amplitude inside of the wall; speeds, and the time W, at contact."""

    frequencies_hz: list[int]
    amplitude_m: float
    speeds_m_per_s: list[float]
    window_s: float


@dataclass(frozen=True)
class Rendered:
    """The result of the study.

    Attributes:
        scene: the scene at its own rates.
        backend: the backend.
        starts: number of starts.
        moving: how the handle was moved.
        settings: every estimator at every rate.
    """

    scene: Scene
    backend: str
    starts: int
    moving: Moving
    settings: list[Setting]

    @property
    def hardest_n_per_m(self) -> float:
        """The rate-hardness of the wall as it is commanded."""
        return hardness.ideal_n_per_m(self.scene, self.moving.window_s)

    def report(self) -> dict[str, Any]:
        """Return what the command line prints, units in the keys."""
        wall = self.scene.wall
        return {
            "scene": self.scene.name,
            "backend": self.backend,
            "starts": self.starts,
            "stiffness_n_per_m": wall.stiffness_n_per_m,
            "damping_n_s_per_m": wall.damping_n_s_per_m,
            "amplitude_m": self.moving.amplitude_m,
            "window_s": self.moving.window_s,
            "commanded_rate_hardness_n_per_m": self.hardest_n_per_m,
            "rows": [each.report() for each in self.settings],
        }

    def tables(self) -> list[Table]:
        """Return tables of what is rendered up to where, of K and B by frequency, and of the contact by speed."""
        wall, speeds = self.scene.wall, self.moving.speeds_m_per_s
        k, b = wall.stiffness_n_per_m, wall.damping_n_s_per_m
        by_frequency = [f"{each} Hz" for each in self.moving.frequencies_hz]
        by_speed = [f"{each * 1e3:g} mm/s" for each in speeds]
        hardest = self.hardest_n_per_m
        return [
            self._table(("T (us)", "K T (N s/m)", "flips at B", "K to (Hz)", "B to (Hz)", "rest (N)"), _summary),
            self._table(
                by_frequency, lambda each: self._by_frequency(each, each.stiffness, k, 1e3), f"K_r of {k / 1e3:g} kN/m"
            ),
            self._table(
                by_frequency, lambda each: self._by_frequency(each, each.damping, b, 1.0), f"B_r of {b:g} N s/m"
            ),
            self._table(
                by_speed,
                lambda each: [_text(each.hardness(speed), hardest, 1e3) for speed in speeds],
                f"rate-hardness of {hardest / 1e3:g} kN/m",
            ),
            self._table(
                by_speed, lambda each: [_first(each.first(speed)) for speed in speeds], "first force (N), after (ms)"
            ),
        ]

    def _table(self, numbers: Sequence[str], cells: Callable[[Setting], list[str]], title: str = "estimator") -> Table:
        rows = [[each.curve.label, each.khz, *cells(each)] for each in self.settings]
        return table_of((title, "kHz"), tuple(numbers), rows)

    def _by_frequency(
        self, setting: Setting, rendered: Callable[[int], Spread], commanded: float, unit: float
    ) -> list[str]:
        """Return a part of the impedance by frequency; a frequency that the rate does not allow is empty."""
        return [
            _text(rendered(each), commanded, unit) if each in setting.waves else ""
            for each in self.moving.frequencies_hz
        ]

    def notes(self) -> list[str]:
        """Return the meaning of the columns, the flags, and the parts of the device that are left out."""
        scene, moving = self.scene, self.moving
        slow = slow_hz(moving.frequencies_hz)
        steps = ", ".join(f"{scene.wall.damping_n_s_per_m * speed:g}" for speed in moving.speeds_m_per_s)
        said = [
            f"medians of {self.starts} starts; in brackets from the least to the largest, where that is wider than "
            f"{WIDE:.0%} of what is commanded",
            "own: at the scene's own rates of estimator and force; else both at the rate, without an amplifier's delay",
            "T: delay from a position to its force, by decoder, path, amplifier, and half a period of the hold",
            f"K T: the damping that the spring takes, measured with B = 0 at {slow} Hz",
            f"flips at B: the commanded damping (N s/m) below which the rendered one is negative at {slow} Hz; empty "
            "where more of it renders less from some start",
            f"K to, B to: the frequency up to which every start renders K, B within {WITHIN:.0%}; empty for none",
            f"rest: RMS of the force that is neither constant, nor spring, nor damper, at {slow} Hz",
            f"K_r, B_r: rendered to {moving.amplitude_m * 1e3:g} mm",
            f"rate-hardness: the force {moving.window_s * 1e3:g} ms after the contact, over that time and the speed "
            "(kN/m); as commanded K + B / W",
            f"first force: as commanded B v at once, {steps} N; empty where a start has none within that time",
        ]
        behind = {
            "the lag of the amplifier": scene.amplifier and scene.amplifier.bandwidth_hz,
            "the pulses of the output about their mean": scene.output and scene.output.pwm_carrier_hz,
            "the motor": scene.motor,
            "the cable": scene.transmission,
        }
        if any(behind.values()):
            parts = ", ".join(part for part, present in behind.items() if present)
            said.append(f"the force is the drive's; left out is what is behind it: {parts}")
        return said + [
            f"{each.curve.label}, {each.name}: {', '.join(each.flags)}" for each in self.settings if each.flags
        ]


def _number(value: float) -> str:
    """Return a number with three digits, and none of an exponent."""
    return f"{value:.3g}" if abs(value) < 1000 else f"{value:.0f}"


def _text(value: Spread, commanded: float, unit: float) -> str:
    """Return the median of a spread in a unit, and its ends if they are far apart."""
    low, high = _number(value.low / unit), _number(value.high / unit)
    ends = f" ({low} to {high})" if value.high - value.low > WIDE * commanded and low != high else ""
    return _number(value.median / unit) + ends


def _first(first: tuple[Spread, Spread] | None) -> str:
    return "" if first is None else f"{_number(first[0].median)}, {_number(first[1].median * 1e3)}"


def _summary(setting: Setting) -> list[str]:
    """Return the cells of the first table."""
    if not setting.waves:
        return [_number(setting.delay_s * 1e6), "", "", "", "", ""]
    damping, flips = setting.scene.wall.damping_n_s_per_m, setting.flips_at_n_s_per_m
    ends = ["" if each is None else str(each) for each in (setting.stiffness_to_hz, setting.damping_to_hz)]
    rest = spread(setting.waves[slow_hz(setting.waves)]["rest_n"]).median
    return [
        _number(setting.delay_s * 1e6),
        _text(setting.lost_n_s_per_m, damping, 1.0),
        "" if flips is None else _text(flips, damping, 1.0),
        *ends,
        _number(rest),
    ]


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
