"""Shortcuts that make a simulation cheaper, grouped by the omitted effect, and their changes of a scene.

Every axis of shortcuts begins with its boldest; the boldest are also combined in pairs. Parts that a scene lacks are
the opposite: they show the error of a description that leaves them out. Two more changes, `scatter`, are too slight to
be measured on a bench. They move the results by chance alone, and show how often the study reports a move where there
is none.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import chain, combinations, cycle
from typing import Any

from ..scene.case import Case
from ..scene.errors import SceneError
from ..scene.schema import Scene
from ..walls import hit
from ..walls.grid import grid_of
from ..walls.methods import Curve, methods
from .rates import CABLE, LAG, taken_out

PARTS = {
    "rigid handle only": LAG | CABLE | {"output": None},
    "no cable": CABLE,
    "no motor, no amplifier's lag": LAG,
    "no motor": {"motor": None, "amplifier.current_limit_a": None},
    "no output steps": {"output": None},
}
LACKED = {
    "with dry friction of 0.1 N": {"handle.coulomb_n": 0.1},
    "with friction that bends": {"presliding.model": "dahl", "presliding.stiffness_n_per_m": 1e5},
    "with a hand": {"hand.model": "van-beek-2015"},
    "with an amplifier of 1 kHz": {"amplifier.bandwidth_hz": 1e3},
    "with a converter of 12 bits": {"output.full_scale_n": 40.0, "output.dac_bits": 12},
    "with edges off by 0.05 counts": {"encoder.edge_error_counts": 0.05},
    "with the HEDS-9040's errors": {
        "encoder.edge_error_counts": 0.0067,
        "encoder.duty_error_counts": 0.078,
        "encoder.phase_error_counts": 0.022,
    },
    "with a passivity controller of 10 N s/m": {"passivity.damping_n_s_per_m": 10.0},
    "with a passivity controller of 50 N s/m": {"passivity.damping_n_s_per_m": 50.0},
    "with a resistor and 20 mF across the motor": {
        "motor.damping_resistance_ohm": 2.0,
        "motor.damping_capacitance_f": 0.02,
    },
    "with a virtual coupling of 20 kN/m": {
        "coupling.stiffness_n_per_m": 20e3,
        "coupling.damping_n_s_per_m": 20.0,
        "coupling.mass_kg": 0.05,
        "coupling.sample_hz": 1000,
        "coupling.ahead_s": 0.5e-3,
    },
    "with hysteresis and jitter": {"encoder.hysteresis_counts": 0.2, "encoder.jitter_s": 50e-9},
}
"""Parts that a device or a controller has and a scene may lack, each where the scene says none.

If a data sheet or a paper has their values, they are as in `docs/reference/scenes.md`.
"""
SLOWER = 2, 5
"""The factors by which the sample rate is lower."""
CLOCK = 4
"""The factor by which the clock is slower."""
STEPS = 1, 10, 100
"""The numbers of steps of a fixed-step solver in a sample."""
COARSER = 5, 2
"""The factors by which the steps of K are longer."""
UNKNOWN = 1e-3
"""The relative change of the handle's mass in the scatter."""
SCATTER = "scatter"
"""The name of the axis of changes too slight to be measured."""


METHODS = "adjusted", "fdm-500"
GRID = {
    "zwidth.damping_from_n_s_per_m": 10.0,
    "zwidth.damping_to_n_s_per_m": 70.0,
    "zwidth.damping_step_n_s_per_m": 20.0,
}
"""A grid with few B, as there are many maps; both estimators have a boundary there on the paper's device and drive."""
AROUND = 0.7, 0.85, 0.95, 1 / 0.95, 1 / 0.85, 1 / 0.7
"""The stiffness of the walls that are timed, over the reference's boundary, from one B to the next."""
Wall = tuple[float, float]
"""The stiffness K (N/m) and the damping B (N s/m) of a wall."""


@dataclass(frozen=True)
class Shortcut:
    """A shortcut.

    Attributes:
        axis: name of the axis: what the shortcut simplifies.
        label: unique label in tables and pictures.
        changes: changes of the scene, by dotted key.
        backend: one of `backends.BACKENDS`.
        coarser: factor by which a map's steps of K are longer.
    """

    axis: str
    label: str
    changes: dict[str, Any]
    backend: str = "fixed"
    coarser: int = 1


REFERENCE = Shortcut("reference", "all parts, fixed, exact solver", {})


def shortcuts(scene: Scene, accepted: Callable[[Shortcut], bool]) -> list[Shortcut]:
    """Return the reference and the shortcuts that are compared with it, axis by axis.

    Args:
        scene: the scene, with the grid of its maps.
        accepted: returns whether the scene has a shortcut, which may be not valid or change nothing.
    """
    beside = _scatter(scene), _backends(scene)
    bold = [list(filter(accepted, axis)) for axis in (_parts(scene), _rates(scene), _steps(scene), _grids(scene))]
    pairs = [_together(*pair) for pair in combinations([axis[0] for axis in bold if axis], 2)]
    return [
        REFERENCE,
        *filter(accepted, chain(*beside)),
        *filter(accepted, _lacked(scene)),
        *chain(*bold),
        *filter(accepted, pairs),
    ]


def _backends(scene: Scene) -> list[Shortcut]:
    whole = [Shortcut("backend", backend, {}, backend) for backend in ("float", "rtl")]
    return [*whole, *(Shortcut("backend", f"rtl, {label}", changes, "rtl") for label, changes in _slow_clock(scene))]


def _slow_clock(scene: Scene) -> list[tuple[str, dict]]:
    """Return the label and the changes of a slower clock, if the clock can be divided."""
    clock_hz, rest = divmod(scene.controller.clock_hz, CLOCK)
    return [] if rest else [(f"clock of {clock_hz / 1e6:g} MHz", {"controller.clock_hz": clock_hz})]


def _parts(scene: Scene) -> list[Shortcut]:
    parts = []
    for label, without in PARTS.items():
        present = {key: value for key, value in without.items() if getattr(scene, key.split(".")[0]) is not None}
        changes = taken_out(scene, present)
        if changes and all(changes != other.changes for other in parts):
            parts.append(Shortcut("parts", label, changes))
    return parts


def _lacked(scene: Scene) -> list[Shortcut]:
    def says(key: str) -> bool:
        section, _, name = key.partition(".")
        return bool(getattr(getattr(scene, section), name, None))

    return [Shortcut("lacked", label, keys) for label, keys in LACKED.items() if not any(map(says, keys))]


def _rates(scene: Scene) -> list[Shortcut]:
    rates, old = [], scene.controller
    for slower in SLOWER:
        sample_hz, rest = divmod(old.sample_hz, slower)
        both = sample_hz % old.actuation_hz != 0
        if rest or (both and old.actuation_hz % slower):
            continue
        changes = {"controller.sample_hz": sample_hz}
        if both:
            changes["controller.actuation_hz"] = old.actuation_hz // slower
        what = "samples and force" if both else "samples"
        rates.append(Shortcut("rate", f"{what} at {sample_hz / 1e3:g} kHz", changes))
    return rates + [Shortcut("rate", label, changes) for label, changes in _slow_clock(scene)]


def _steps(scene: Scene) -> list[Shortcut]:
    lengths_s = [1 / (steps * scene.controller.sample_hz) for steps in STEPS]
    return [Shortcut("step", f"steps of {step_s * 1e6:g} µs", {"solver.step_s": step_s}) for step_s in lengths_s]


def _grids(scene: Scene) -> list[Shortcut]:
    step = scene.zwidth.stiffness_step_n_per_m
    return [Shortcut("K step", f"K in steps of {factor * step / 1e3:g} kN/m", {}, coarser=factor) for factor in COARSER]


def _scatter(scene: Scene) -> list[Shortcut]:
    sides = (("heavier", 1 + UNKNOWN), ("lighter", 1 - UNKNOWN))
    return [
        Shortcut(SCATTER, f"scatter: handle {UNKNOWN:.1%} {side}", {"handle.mass_kg": scene.handle.mass_kg * times})
        for side, times in sides
    ]


def _together(one: Shortcut, other: Shortcut) -> Shortcut:
    label, changes = f"{one.label} + {other.label}", one.changes | other.changes
    return Shortcut("two at once", label, changes, coarser=one.coarser * other.coarser)


class Contest:
    """A scene, its shortcuts, and the estimators with which the shortcuts are tried.

    Attributes:
        scene: the scene, with the grid of the maps.
        curves: the estimators, labelled as on the command line.
        shortcuts: all shortcuts; `computed`: a model's; `hardware`: the RTL's.
        refused: why the scene does not take a shortcut, by its label.
    """

    def __init__(self, case: Case):
        self._case = case.with_defaults(GRID)
        self.scene = self._case.scene
        self._grid = grid_of(self.scene)
        if len(self._grid.dampings) < 2:
            key = f"{self.scene.name}: zwidth.damping_to_n_s_per_m"
            raise SceneError(f"{key} must leave two values of B, because a map of one has no area")
        self.refused: dict[str, str] = {}
        self.curves = [replace(methods(self.scene)[method], label=method) for method in METHODS]
        self.shortcuts = shortcuts(self.scene, self._differs)
        self.computed = [each for each in self.shortcuts if each.backend != "rtl"]
        self.hardware = [each for each in self.shortcuts if each.backend == "rtl"]

    def _differs(self, shortcut: Shortcut) -> bool:
        """Return whether a shortcut is valid for the scene, and differs from the reference."""
        reference = [self.case_of(REFERENCE, curve).scene for curve in self.curves]
        try:
            own = [self.case_of(shortcut, curve).scene for curve in self.curves]
        except SceneError as error:
            self.refused[shortcut.label] = str(error).removeprefix(f"{self._case.source}: ")
            return False
        return own != reference or shortcut.backend != REFERENCE.backend or shortcut.coarser > 1

    def case_of(self, shortcut: Shortcut, curve: Curve) -> Case:
        """Return the case of a shortcut with an estimator."""
        changes = curve.changes | shortcut.changes
        if shortcut.coarser > 1:
            changes["zwidth.stiffness_step_n_per_m"] = shortcut.coarser * self._grid.stiffness_step_n_per_m
        return self._case.changed(changes, curve.label)

    def model_of(self, shortcut: Shortcut) -> Shortcut:
        """Return the shortcut that computes the verdicts of another: itself, or the model of the hardware."""
        if shortcut.backend != "rtl":
            return shortcut
        return next(each for each in self.computed if (each.backend, each.changes) == ("fixed", shortcut.changes))

    def timed(self, boundary: dict[float, float]) -> list[Wall]:
        """Return the walls that are timed: one for every B of a boundary, at varying distances from it."""
        step, walls = self._grid.stiffness_step_n_per_m, []
        for (damping, stiffness), times in zip(boundary.items(), cycle(AROUND), strict=False):
            row = round(times * (stiffness / step + 0.5))
            walls.append((min(max(row, 1), self._grid.rows) * step, damping))
        return walls

    def hit(self, shortcut: Shortcut, curve: Curve, wall: Wall, until_sure: bool = True) -> hit.Hit:
        """Hit a wall with a shortcut and an estimator."""
        return hit.run(self.case_of(shortcut, curve).hitting(*wall), shortcut.backend, until_sure=until_sure)
