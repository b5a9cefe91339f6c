"""The worst of several variants of a case, for instance of several hands on the handle: at every wall, the variant with
the fewest stable hits.

All variants hit a wall from the same starts. A map of the worst case is an ordinary map: each wall has the verdicts of
its worst variant. So its boundary is the K at which the least P(stable) over the variants passes one half.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from ..scene.case import Case
from ..scene.hand_section import HANDS, OF_A_HAND
from .boundary import BoundaryPoint
from .likelihood import Wall

NO_HAND = "none"
HELD_BY = (NO_HAND, *HANDS)
"""The names of the hands that may hold a handle; none is one of them."""


@dataclass(frozen=True)
class WorstCase(Case):
    """A scene to be mapped in its worst variant.

    Attributes:
        of: the cases of the variants, by name.
    """

    of: dict[str, Case] = field(default_factory=dict)

    @property
    def variants(self) -> dict[str, Case]:
        """The cases of the variants, by name."""
        return self.of


def _held_by(hand: str) -> str:
    return "no hand" if hand == NO_HAND else hand


def changes_of(hand: str) -> dict[str, Any]:
    """Return the changes, by dotted key, that put one of `HANDS` on a scene's handle, or no hand."""
    if hand == NO_HAND:
        return {"hand": None}
    return {"hand.model": hand} | {f"hand.{key}": None for key in OF_A_HAND}


def cases_of(case: Case, hands: Sequence[str]) -> list[Case]:
    """Return a case with each of the hands, of `HANDS` or none, and last, if they are several, with the worst one."""
    held = {hand: case.changed(changes_of(hand), f"{case.label}, {_held_by(hand)}") for hand in hands}
    worst = WorstCase(f"{case.label}, worst hand", case.source, case.text, case.changes, held)
    return [*held.values(), worst][: None if len(held) > 1 else 1]


def of(walls: dict[str, Wall]) -> list[str]:
    """Return the names of the variants with the fewest stable hits of a wall; several if they are equal."""
    least = min(wall.share for wall in walls.values())
    return [name for name, wall in walls.items() if wall.share == least]


def report(variants: dict[str, tuple[Wall, ...]], boundary: list[BoundaryPoint]) -> dict[str, Any]:
    """Return the report of a worst case: the names of the variants, and the worst ones at every point of the boundary
    and at every wall of `p_stable`."""
    return {
        "hands": list(variants),
        "worst_of_boundary": [at_edge(variants, point) for point in boundary],
        "worst_of_p_stable": [
            of(dict(zip(variants, walls, strict=True))) for walls in zip(*variants.values(), strict=True)
        ],
    }


def at_edge(variants: dict[str, tuple[Wall, ...]], point: BoundaryPoint) -> list[str]:
    """Return the variants, by name, in which the fewest hits are stable of the two walls around a boundary together."""
    shares = {}
    for name, walls in variants.items():
        here = [wall for wall in walls if wall.damping_n_s_per_m == point.damping_n_s_per_m]
        below = [wall.share for wall in here if wall.stiffness_n_per_m <= point.stable_n_per_m][-1:]
        above = [wall.share for wall in here if wall.stiffness_n_per_m > point.stable_n_per_m][:1]
        shares[name] = sum(below + above)
    return [name for name, each in shares.items() if each == min(shares.values())]


def told(variants: dict[str, tuple[Wall, ...]], boundary: list[BoundaryPoint]) -> str:
    """Return in words the worst variant at each B; empty for a case without variants."""
    if not variants:
        return ""
    stretches: list[tuple[str, list[float]]] = []
    for point in boundary:
        names = " or ".join(map(_held_by, at_edge(variants, point)))
        if not stretches or stretches[-1][0] != names:
            stretches.append((names, []))
        stretches[-1][1].append(point.damping_n_s_per_m)
    return ", ".join(
        f"{names} at {all_[0]:g}" + (f" to {all_[-1]:g}" if len(all_) > 1 else "") for names, all_ in stretches
    )
