"""Ways to make a simulation cheaper, by what they leave out, and what each changes in a scene.

Each axis has its boldest first; these are also taken in pairs. Two more changes, `scatter`, are so slight that nobody
could measure them on a bench: what they do to a verdict is chance, and no shortcut can be judged finer.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import chain, combinations
from typing import Any

from ..scene.schema import Scene
from .rates import CABLE, LAG, taken_out

PARTS = {
    "rigid handle only": LAG | CABLE | {"output": None},
    "no cable": CABLE,
    "no motor, no amplifier's lag": LAG,
    "no motor": {"motor": None, "amplifier.current_limit_a": None},
    "no output steps": {"output": None},
}
SLOWER = 2, 5
"""Times by which the samples are fewer."""
CLOCK = 4
"""Times by which the clock is slower."""
STEPS = 1, 10, 100
"""Of a fixed-step solver, a sample."""
COARSER = 5, 2
"""Times by which the steps of K are longer."""
UNKNOWN = 1e-3
"""Of the handle's mass."""
SCATTER = "scatter"
"""Name of an axis."""


@dataclass(frozen=True)
class Shortcut:
    """One way.

    Attributes:
        axis: of what it is a shortcut.
        label: in tables and pictures; no two have the same.
        changes: of the scene, by dotted key.
        backend: one of `backends.BACKENDS`.
        coarser: times by which a map's steps of K are longer.
    """

    axis: str
    label: str
    changes: dict[str, Any]
    backend: str = "fixed"
    coarser: int = 1


REFERENCE = Shortcut("reference", "all parts, fixed, exact solver", {})


def shortcuts(scene: Scene, accepted: Callable[[Shortcut], bool]) -> list[Shortcut]:
    """Return the reference and what is held against it, of one axis after the other.

    Args:
        scene: with the grid of its maps.
        accepted: whether a shortcut is one of this scene: all may be no scene, or change nothing.
    """
    beside = _scatter(scene), _backends(scene)
    bold = [list(filter(accepted, axis)) for axis in (_parts(scene), _rates(scene), _steps(scene), _grids(scene))]
    pairs = [_together(*pair) for pair in combinations([axis[0] for axis in bold if axis], 2)]
    return [REFERENCE, *filter(accepted, chain(*beside)), *chain(*bold), *filter(accepted, pairs)]


def _backends(scene: Scene) -> list[Shortcut]:
    whole = [Shortcut("backend", backend, {}, backend) for backend in ("float", "rtl")]
    return [*whole, *(Shortcut("backend", f"rtl, {label}", changes, "rtl") for label, changes in _slow_clock(scene))]


def _slow_clock(scene: Scene) -> list[tuple[str, dict]]:
    """Return the label and the changes of a slower clock, if there is one."""
    clock_hz, rest = divmod(scene.controller.clock_hz, CLOCK)
    return [] if rest else [(f"clock of {clock_hz / 1e6:g} MHz", {"controller.clock_hz": clock_hz})]


def _parts(scene: Scene) -> list[Shortcut]:
    found = []
    for label, without in PARTS.items():
        there = {key: value for key, value in without.items() if getattr(scene, key.split(".")[0]) is not None}
        changes = taken_out(scene, there)
        if changes and all(changes != each.changes for each in found):
            found.append(Shortcut("parts", label, changes))
    return found


def _rates(scene: Scene) -> list[Shortcut]:
    found, old = [], scene.controller
    for slower in SLOWER:
        sample_hz, rest = divmod(old.sample_hz, slower)
        both = sample_hz % old.actuation_hz != 0
        if rest or (both and old.actuation_hz % slower):
            continue
        changes = {"controller.sample_hz": sample_hz}
        if both:
            changes["controller.actuation_hz"] = old.actuation_hz // slower
        what = "samples and force" if both else "samples"
        found.append(Shortcut("rate", f"{what} at {sample_hz / 1e3:g} kHz", changes))
    return found + [Shortcut("rate", label, changes) for label, changes in _slow_clock(scene)]


def _steps(scene: Scene) -> list[Shortcut]:
    lengths = [1 / (each * scene.controller.sample_hz) for each in STEPS]
    return [Shortcut("step", f"steps of {each * 1e6:g} us", {"solver.step_s": each}) for each in lengths]


def _grids(scene: Scene) -> list[Shortcut]:
    step = scene.zwidth.stiffness_step_n_per_m
    return [Shortcut("K step", f"K by {each * step / 1e3:g} kN/m", {}, coarser=each) for each in COARSER]


def _scatter(scene: Scene) -> list[Shortcut]:
    sides = (("heavier", 1 + UNKNOWN), ("lighter", 1 - UNKNOWN))
    return [
        Shortcut(SCATTER, f"scatter: handle {UNKNOWN:.1%} {side}", {"handle.mass_kg": scene.handle.mass_kg * times})
        for side, times in sides
    ]


def _together(one: Shortcut, other: Shortcut) -> Shortcut:
    label, changes = f"{one.label} + {other.label}", one.changes | other.changes
    return Shortcut("two at once", label, changes, coarser=one.coarser * other.coarser)
