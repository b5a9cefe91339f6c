"""What rate buys a stiff wall: maps from 1 kHz to 1 MHz, estimator and force at one rate, beside the scene's own rates.

A rigid device flatters a fast loop. So the scene's is meant to have an amplifier and a cable, and the linear loop's
limit without either, with one, and with both, tells which of them ends the gain.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..scene.load import load, read
from ..scene.schema import Scene
from ..walls import methods, theory
from ..walls.case import Case, grid_of
from ..walls.zwidth import Map, Mapping

RATES_HZ = (1_000, 2_500, 10_000, 25_000, 100_000, 250_000, 1_000_000)
METHODS = ("fdm", "butterworth", "adjusted", "levant:u1", "kalman", "levant-edge")
CLOCK_HZ = 50_000_000
"""A clock that all of the rates divide."""
FINE = {
    "zwidth.stiffness_step_n_per_m": 10e3,
    "zwidth.stiffness_to_n_per_m": 500e3,
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 150.0,
    "zwidth.damping_step_n_s_per_m": 20.0,
    "controller.stiffness_max_n_per_m": 500e3,
}
"""Steps of the maps: finer in K than in B, for the largest K is what is asked."""
SHORT = {"protocol.settle_s": 1.5, "protocol.mean_s": 0.25, "protocol.measure_s": 0.5}
"""A third of the paper's protocol: the handle comes to the wall after half a second, and a hit at 1 MHz takes long."""
FINER = 5
"""So many times finer are the steps of K at the scene's own rates: its walls are softer."""
GAINED = 0.95
"""Of the largest K at any rate: at the first rate with so much, an estimator has as good as all that it gains."""


def at_rate(rate_hz: int) -> dict[str, Any]:
    """Return what a rate changes in a scene; no force is late any more but by its own path."""
    rates = {"controller.sample_hz": rate_hz, "controller.actuation_hz": rate_hz}
    return {"controller.clock_hz": CLOCK_HZ, "amplifier.delay_s": 0.0, **rates}


@dataclass(frozen=True)
class Gain:
    """What rate buys one method.

    Attributes:
        label: of the method.
        rates_hz: in ascending order.
        own: the map at the scene's own rates.
        maps: at each of the rates.
    """

    label: str
    rates_hz: list[int]
    own: Map
    maps: list[Map]

    @property
    def largest_n_per_m(self) -> list[float]:
        """The largest stable stiffness at each rate."""
        return [each.largest_n_per_m for each in self.maps]

    @property
    def ends_at_hz(self) -> int | None:
        """The lowest rate with as good as the largest stiffness of any; None where a map is clipped."""
        if any(each.clipped for each in self.maps):
            return None
        enough = GAINED * max(self.largest_n_per_m)
        return next(rate for rate, value in zip(self.rates_hz, self.largest_n_per_m, strict=True) if value >= enough)

    @property
    def ratio(self) -> float | None:
        """The largest stiffness at the highest rate over that at the scene's own.

        None where that is 0, or a map is clipped.
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
            "clipped": [each.clipped for each in self.maps],
            "area_n2_s_per_m2": [each.area for each in self.maps],
            "largest_stiffness_at_the_scenes_rates_n_per_m": self.own.largest_n_per_m,
            "ratio": self.ratio,
            "gains_up_to_hz": self.ends_at_hz,
        }


def study(
    scene: str, changes: dict[str, Any], curves: list[methods.Curve], rates_hz: list[int], mapping: Mapping
) -> list[Gain]:
    """Return what rate buys each method.

    Args:
        scene: its name or file; it need not have a section `zwidth`.
        changes: of it, by dotted key.
        curves: the methods.
        rates_hz: ascending.
        mapping: makes the maps.

    Raises:
        SceneError: if a case cannot be.
    """
    text, common = read(scene), FINE | SHORT | changes
    step = "zwidth.stiffness_step_n_per_m"
    at = [{step: common[step] / FINER}, *(at_rate(rate_hz) for rate_hz in rates_hz)]
    cases = [Case(curve.label, scene, text, common | each | curve.changes) for curve in curves for each in at]
    maps = iter(mapping(f"{Path(scene).stem}, what rate buys", cases))
    return [Gain(curve.label, rates_hz, next(maps), [next(maps) for _ in rates_hz]) for curve in curves]


LAG = {"amplifier.bandwidth_hz": None, "amplifier.current_limit_a": None, "motor": None}
CABLE = {"transmission": None}
WITHOUT = {
    "handle, amplifier and cable": {},
    "without the cable": CABLE,
    "without the amplifier's lag": LAG,
    "rigid": CABLE | LAG,
}
"""Parts that are taken out, by what is left."""


def linear_limits(scene: str, changes: dict[str, Any], rates_hz: list[int]) -> dict[str, list[float]]:
    """Return the linear loop's largest stiffness (N/m) over all dampings of the map, at each rate, by what is left.

    The estimator is the plain difference; friction that sticks is left out.
    """
    limits = {}
    for left, without in WITHOUT.items():
        fdm = {"controller.estimator": "fdm", "controller.output": None}
        row = []
        for rate_hz in rates_hz:
            left_out = taken_out(load(scene, changes), without)
            loaded = load(scene, FINE | SHORT | changes | at_rate(rate_hz) | fdm | left_out)
            loop = theory.Loop(loaded)
            row.append(max(theory.linear_limit_n_per_m(loop, damping) for damping in grid_of(loaded).dampings))
        limits[left] = row
    return limits


def taken_out(scene: Scene, without: dict[str, Any]) -> dict[str, Any]:
    """Return what takes parts out of a scene; without a cable the motor's side is the handle's."""
    handle, cable = scene.handle, scene.transmission
    if "transmission" not in without or cable is None:
        return without
    return without | {
        "handle.mass_kg": handle.mass_kg + cable.motor_mass_kg,
        "handle.viscous_n_s_per_m": handle.viscous_n_s_per_m + cable.motor_viscous_n_s_per_m,
    }
