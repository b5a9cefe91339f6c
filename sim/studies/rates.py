"""The gain of a higher rate: maps from 1 kHz to 1 MHz, estimator and force at one rate, and at the scene's own rates.

A rigid device flatters a fast loop. So the scene's device should have an amplifier and a cable; the limit of the linear
loop without them, with either, and with both shows which of them ends the gain.
"""

from dataclasses import dataclass
from math import isfinite
from typing import Any

from ...model.runtime.result import Table, table_of
from ..scene.case import Case
from ..scene.schema import Scene
from ..walls import theory
from ..walls.grid import grid_of
from ..walls.mapping import Effort, Mapper
from ..walls.methods import Curve
from ..walls.zwidth import Map

RATES_HZ = (1_000, 2_500, 10_000, 25_000, 100_000, 250_000, 1_000_000)
METHODS = ("fdm", "butterworth", "adjusted", "levant:u1", "kalman", "levant-edge")
CLOCK_HZ = 50_000_000
"""A clock rate that all of the rates divide."""
FINE = {
    "zwidth.stiffness_step_n_per_m": 10e3,
    "zwidth.stiffness_to_n_per_m": 500e3,
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 150.0,
    "zwidth.damping_step_n_s_per_m": 20.0,
    "controller.stiffness_max_n_per_m": 500e3,
}
"""The grid of the maps: finer in K than in B, because the largest K is of interest."""
SHORT = {"protocol.settle_s": 2.0, "protocol.mean_s": 0.25}
"""Half of the paper's time to settle: the handle reaches the wall after half a second, and a hit at 1 MHz takes long. A
hit that still settles then goes on."""
FINER = 5
"""The factor by which the steps of K are finer at the scene's own rates, where the walls are softer."""
GAINED = 0.95
"""The share of the largest K at any rate; the first rate that reaches it has almost all of the gain."""


def at_rate(rate_hz: int) -> dict[str, Any]:
    """Return the changes of a scene for a rate; the force has only the delay of its own path."""
    rates = {"controller.sample_hz": rate_hz, "controller.actuation_hz": rate_hz}
    return {"controller.clock_hz": CLOCK_HZ, "amplifier.delay_s": 0.0, **rates}


@dataclass(frozen=True)
class Gain:
    """The gain of a higher rate with one method.

    Attributes:
        label: label of the method.
        rates_hz: the rates, ascending.
        own: the map at the scene's own rates.
        maps: the maps at the rates.
    """

    label: str
    rates_hz: list[int]
    own: Map
    maps: list[Map]

    @property
    def largest_n_per_m(self) -> list[float]:
        """The largest stable stiffness at every rate."""
        return [a_map.largest_n_per_m for a_map in self.maps]

    @property
    def ends_at_hz(self) -> int | None:
        """The lowest rate at which the stiffness is almost the largest of all; None where a map is clipped."""
        if any(a_map.clipped for a_map in self.maps):
            return None
        enough = GAINED * max(self.largest_n_per_m)
        return next(rate for rate, value in zip(self.rates_hz, self.largest_n_per_m, strict=True) if value >= enough)

    @property
    def ratio(self) -> float | None:
        """The largest stiffness at the highest rate, divided by the largest at the scene's own rates.

        None if the divisor is 0, or a map is clipped.
        """
        if not self.own.largest_n_per_m or self.own.clipped or self.maps[-1].clipped:
            return None
        return self.largest_n_per_m[-1] / self.own.largest_n_per_m

    def report(self) -> dict[str, Any]:
        """Return the gain as the command line prints it."""
        return {
            "label": self.label,
            "rates_hz": self.rates_hz,
            "largest_stiffness_n_per_m": self.largest_n_per_m,
            "largest_stiffness_interval_n_per_m": [list(each.largest_interval) for each in self.maps],
            "clipped": [each.clipped for each in self.maps],
            "area_n2_s_per_m2": [each.area for each in self.maps],
            "largest_stiffness_at_the_scenes_rates_n_per_m": self.own.largest_n_per_m,
            "largest_stiffness_interval_at_the_scenes_rates_n_per_m": list(self.own.largest_interval),
            "ratio": self.ratio,
            "gains_up_to_hz": self.ends_at_hz,
        }


@dataclass(frozen=True)
class Rates:
    """The result of the study.

    Attributes:
        scene: the scene with its own rates.
        gains: what the rate buys with every method.
        limits: the linear loop's largest stiffness (N/m) at every rate, by the remaining parts of the device.
        effort: effort of the maps.
    """

    scene: Scene
    gains: list[Gain]
    limits: dict[str, list[float]]
    effort: Effort

    def report(self) -> dict[str, Any]:
        """Return the report for the command line, with units in the keys; a limit that is not found is None."""
        methods = [each.report() for each in self.gains]
        limits = {parts: [k if isfinite(k) else None for k in limit] for parts, limit in self.limits.items()}
        return self.effort._asdict() | {"methods": methods, "linear_limits": limits}

    def tables(self) -> list[Table]:
        """Return the table of the largest K by rate."""
        rates = [f"{rate / 1e3:g} kHz" for rate in self.gains[0].rates_hz]
        rows = []
        for each in self.gains:
            values = [_largest_text(a_map) for a_map in (each.own, *each.maps)]
            ratio = "" if each.ratio is None else f"{each.ratio:.2f}"
            ends = "" if each.ends_at_hz is None else f"{each.ends_at_hz / 1e3:g}"
            rows.append([each.label, *values, ratio, ends])
        for parts, limit in self.limits.items():
            rows.append([f"linear: {parts}", "", *(f"{value / 1e3:.0f}" for value in limit), "", ""])
        return [table_of(("largest K (kN/m)",), ("own", *rates, "ratio", "gains to (kHz)"), rows)]

    def notes(self) -> list[str]:
        """Return the meaning of `own` and of a +."""
        clipped = any(a_map.clipped for gain in self.gains for a_map in (gain.own, *gain.maps))
        return ["own: at the scene's own rates", "in brackets: of the starts, in 95 of 100 draws"] + [
            "+: K goes on beyond the map"
        ] * clipped


def _largest_text(each: Map) -> str:
    """Return the largest K of a map and the interval of its starts as text, in kN/m."""
    low, high = (f"{end / 1e3:.0f}" for end in each.largest_interval)
    return f"{each.largest_n_per_m / 1e3:.0f}" + "+" * each.clipped + (f" ({low} to {high})" if low != high else "")


def study(case: Case, curves: list[Curve], rates_hz: list[int], mapper: Mapper) -> Rates:
    """Return what the rate buys with every method.

    Args:
        case: the scene; it need not have a section `zwidth`.
        curves: the methods.
        rates_hz: the rates, ascending.
        mapper: function that makes the maps.

    Raises:
        SceneError: if a case is not valid, or has a coupling.
    """
    case.without_coupling("the linear loop that tells which part ends the gain is a wall's")
    limits, common = linear_limits(case, rates_hz), case.with_defaults(FINE | SHORT)
    step = "zwidth.stiffness_step_n_per_m"
    at = [{step: common.changes[step] / FINER}, *(at_rate(rate_hz) for rate_hz in rates_hz)]
    cases = [common.changed(each | curve.changes, curve.label) for curve in curves for each in at]
    maps = iter(mapper(f"{case.scene.name}, what rate buys", cases))
    gains = [Gain(curve.label, rates_hz, next(maps), [next(maps) for _ in rates_hz]) for curve in curves]
    return Rates(case.scene, gains, limits, mapper.effort())


LAG = {"amplifier.bandwidth_hz": None, "amplifier.current_limit_a": None, "motor": None}
CABLE = {"transmission": None}
WITHOUT = {
    "handle, amplifier and cable": {},
    "without the cable": CABLE,
    "without the amplifier's lag": LAG,
    "rigid": CABLE | LAG,
}
"""The changes that take parts out of a device, by the remaining parts."""


def linear_limits(case: Case, rates_hz: list[int]) -> dict[str, list[float]]:
    """Return the linear loop's largest stiffness (N/m) at every rate, by the remaining parts of the device.

    It is the largest over all dampings of the map. The estimator is the plain difference, without Coulomb friction.
    """
    fdm = {"controller.estimator": "fdm", "controller.output": None}
    common = case.with_defaults(FINE | SHORT).changed(fdm)
    return {
        parts: [_limit(common.changed(at_rate(rate_hz) | taken_out(case.scene, without)).scene) for rate_hz in rates_hz]
        for parts, without in WITHOUT.items()
    }


def _limit(scene: Scene) -> float:
    """Return the linear loop's largest stiffness (N/m) over all dampings of a scene's map."""
    loop = theory.Loop(scene)
    return max(theory.linear_limit_n_per_m(loop, damping) for damping in grid_of(scene).dampings)


def taken_out(scene: Scene, without: dict[str, Any]) -> dict[str, Any]:
    """Return the changes that remove parts of a scene; without a cable the handle gets the motor's mass and damping."""
    handle, cable = scene.handle, scene.transmission
    if "transmission" not in without or cable is None:
        return without
    return without | {
        "handle.mass_kg": handle.mass_kg + cable.motor_mass_kg,
        "handle.viscous_n_s_per_m": handle.viscous_n_s_per_m + cable.motor_viscous_n_s_per_m,
    }
