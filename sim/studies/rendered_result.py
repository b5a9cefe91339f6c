"""The result of `rendered`: what every estimator's wall renders at every rate, and which of it is as commanded."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...model.runtime.result import Table, table_of
from ..estimates import hardness
from ..scene.schema import Scene
from .rendered_setting import WITHIN, Setting, Spread, slow_hz, spread

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
