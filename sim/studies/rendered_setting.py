"""The values that a scene's wall renders with one estimator at one rate, and the values expected by theory."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..estimates import impedance
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls import theory
from ..walls.methods import Curve

WITHIN = 0.1
"""The part of the commanded value by which a rendered one may be off and count as rendered."""
SLOW_HZ = 10.0
"""The frequency at which the damping lost to the spring is measured: about the rate of a shaking hand."""


class Spread(NamedTuple):
    """Values of several starts: their median, the least and the largest."""

    median: float
    low: float
    high: float


def spread(values: list[float]) -> Spread:
    """Return the spread of values."""
    return Spread(float(np.median(values)), min(values), max(values))


def report_of(value: Spread | None, key: str) -> dict[str, float | None]:
    """Return the values of a spread by a key of a report, and by two that begin with it; None for no spread."""
    median, low, high = value or (None, None, None)
    return {key: median, f"{key}_low": low, f"{key}_high": high}


def rate_text(rate_hz: int) -> str:
    """Return a rate as text."""
    return f"{rate_hz / 1e6:g} MHz" if rate_hz >= 1e6 else f"{rate_hz / 1e3:g} kHz"


def slow_hz(frequencies_hz: Iterable[int]) -> int:
    """Return the frequency nearest to `SLOW_HZ`, by ratio."""
    return min(frequencies_hz, key=lambda frequency_hz: abs(math.log(frequency_hz / SLOW_HZ)))


@dataclass(frozen=True)
class Setting:
    """An estimator at a rate, and what its wall renders.

    Attributes:
        curve: the estimator.
        rate_hz: the rate of estimator and force; None for the scene's own.
        case: the scene at that rate.
        waves: results of `impedance.measure` by frequency, in Hz, ascending.
        spring: the value of the spring alone, at `slow_hz`; None without any frequency.
        contacts: results of `hardness.measure`, by speed.
    """

    curve: Curve
    rate_hz: int | None
    case: Case
    waves: dict[int, dict]
    spring: dict | None
    contacts: dict[float, dict]

    @property
    def scene(self) -> Scene:
        """The scene at the rate."""
        return self.case.scene

    @property
    def name(self) -> str:
        """The rate in words."""
        return "own rates" if self.rate_hz is None else rate_text(self.rate_hz)

    @property
    def khz(self) -> str:
        """The rate in kHz, as a table has it."""
        return "own" if self.rate_hz is None else f"{self.rate_hz / 1e3:g}"

    def stiffness(self, frequency_hz: int) -> Spread:
        """Return K_r at a frequency."""
        return spread(self.waves[frequency_hz]["stiffness_n_per_m"])

    def damping(self, frequency_hz: int) -> Spread:
        """Return B_r at a frequency."""
        return spread(self.waves[frequency_hz]["damping_n_s_per_m"])

    @property
    def delay_s(self) -> float:
        """T: the time by which the force is late on average."""
        return theory.delay_s(self.scene) + 0.5 / self.scene.controller.actuation_hz

    @property
    def lost_n_s_per_m(self) -> Spread | None:
        """The damping that the spring takes at `slow_hz`: K T."""
        return None if self.spring is None else spread([-taken for taken in self.spring["damping_n_s_per_m"]])

    @property
    def flips_at_n_s_per_m(self) -> Spread | None:
        """B*: the commanded damping below which the rendered one is negative at `slow_hz`.

        None without a damper, and where more of it renders less from some start.
        """
        damping = self.scene.wall.damping_n_s_per_m
        if self.spring is None or not damping:
            return None
        rendered = self.waves[slow_hz(self.waves)]["damping_n_s_per_m"]
        alone = self.spring["damping_n_s_per_m"]
        gains = [(both - spring) / damping for both, spring in zip(rendered, alone, strict=True)]
        if min(gains) <= 0:
            return None
        return spread([-spring / gain for spring, gain in zip(alone, gains, strict=True)])

    def _renders_to_hz(self, commanded: float, rendered: Callable[[int], Spread]) -> int | None:
        """Return the highest frequency up to which all starts render the commanded wall; None if there is none."""
        highest = None
        for frequency_hz in self.waves:
            ends = rendered(frequency_hz)
            if max(abs(end - commanded) for end in (ends.low, ends.high)) > WITHIN * commanded:
                break
            highest = frequency_hz
        return highest

    @property
    def stiffness_to_hz(self) -> int | None:
        """The frequency up to which K is rendered."""
        return self._renders_to_hz(self.scene.wall.stiffness_n_per_m, self.stiffness)

    @property
    def damping_to_hz(self) -> int | None:
        """The frequency up to which B is rendered."""
        return self._renders_to_hz(self.scene.wall.damping_n_s_per_m, self.damping)

    def expected(self, frequency_hz: int, exact: bool) -> dict[str, float | None]:
        """Return what theory expects at a frequency, of the estimator or of the exact velocity; None for no theory."""
        if not exact and self.scene.controller.estimator not in theory.LINEAR:
            return {"stiffness_n_per_m": None, "damping_n_s_per_m": None}
        whole = theory.impedance_n_per_m(self.scene, frequency_hz, exact)
        return {"stiffness_n_per_m": whole.real, "damping_n_s_per_m": whole.imag / (math.tau * frequency_hz)}

    @property
    def flags(self) -> list[str]:
        """The flags that were raised."""
        raised = [result["flags"] for result in (*self.waves.values(), *self.contacts.values())]
        return impedance.in_order(self.scene, {flag for flags in raised for flag in flags})

    def report(self) -> dict[str, Any]:
        """Return the setting as the command line prints it."""
        controller = self.scene.controller
        return {
            "label": self.curve.label,
            "estimator": self.curve.estimator,
            "output": self.curve.output,
            "own_rates": self.rate_hz is None,
            "sample_hz": controller.sample_hz,
            "actuation_hz": controller.actuation_hz,
            "mean_delay_s": self.delay_s,
            "delay_s": self.delay_s,
            "slow_hz": slow_hz(self.waves) if self.waves else None,
            **report_of(self.lost_n_s_per_m, "spring_takes_n_s_per_m"),
            **report_of(self.flips_at_n_s_per_m, "negative_below_n_s_per_m"),
            "stiffness_rendered_to_hz": self.stiffness_to_hz,
            "damping_rendered_to_hz": self.damping_to_hz,
            "impedance": [self._wave(frequency_hz) for frequency_hz in self.waves],
            "contact": [self._contact(speed) for speed in self.contacts],
            "flags": self.flags,
        }

    def _wave(self, frequency_hz: int) -> dict[str, Any]:
        return {
            "frequency_hz": frequency_hz,
            **report_of(self.stiffness(frequency_hz), "stiffness_n_per_m"),
            **report_of(self.damping(frequency_hz), "damping_n_s_per_m"),
            "rest_n": spread(self.waves[frequency_hz]["rest_n"]).median,
            "theory": self.expected(frequency_hz, exact=False),
            "exact_velocity": self.expected(frequency_hz, exact=True),
        }

    def _contact(self, speed_m_per_s: float) -> dict[str, Any]:
        first_n, first_s = self.first(speed_m_per_s) or (None, None)
        return {
            "speed_m_per_s": speed_m_per_s,
            **report_of(self.hardness(speed_m_per_s), "rate_hardness_n_per_m"),
            "step_n": self.scene.wall.damping_n_s_per_m * speed_m_per_s,
            **report_of(first_n, "first_n"),
            **report_of(first_s, "first_s"),
        }

    def hardness(self, speed_m_per_s: float) -> Spread:
        """Return the rate-hardness at a speed."""
        return spread(self.contacts[speed_m_per_s]["rate_hardness_n_per_m"])

    def first(self, speed_m_per_s: float) -> tuple[Spread, Spread] | None:
        """Return the first push (N) and its time after the contact (s); None if a start has none within W."""
        result = self.contacts[speed_m_per_s]
        if None in result["first_n"]:
            return None
        return spread(result["first_n"]), spread(result["first_s"])
