"""What the founding paper's Figure 5 shows of its six methods, eight facts, and whether maps show them too.

The paper's B axis is known but for zeros that may be missing. So the facts are judged over a range that the maps
themselves give: from their first B to where Levant with adjusted gains ends, which in the figure is about all of it.
"""

from dataclasses import dataclass

import numpy as np

from .zwidth import Map

ABOUT = 0.1
"""Areas that differ by no more than this part are about equal; so are places on the range."""
FILTERS = ("fdm-30", "fdm-100", "fdm-500", "fdm-1000")


@dataclass(frozen=True)
class Fact:
    """Attributes: what the paper's figure shows; whether the maps do; the numbers that say so."""

    text: str
    held: bool
    numbers: str


def facts(maps: dict[str, Map]) -> list[Fact]:
    """Return the eight facts; none is held where Levant with adjusted gains is stable nowhere.

    Args:
        maps: by the names of `figures.methods`, all of one grid.
    """
    seen = _Regions(maps)
    judged = (
        ("the region grows from 30 to 100 to 500 Hz", seen.grows()),
        ("500 and 1000 Hz are about equal", seen.about_equal()),
        ("Levant adjusted encloses every filtered difference", seen.encloses("adjusted", FILTERS)),
        ("Levant adjusted encloses Levant proposed", seen.encloses("adjusted", ("proposed",))),
        (
            "Levant proposed beats every filtered difference up to half of the range",
            seen.encloses("proposed", FILTERS, share=0.5),
        ),
        ("Levant ends in a sharp drop, proposed near 0.9 of the range", seen.drops()),
        ("500 Hz goes on to higher B at lower K", seen.goes_on()),
        ("for 500 and 1000 Hz, K first rises and then falls with B", seen.rises_and_falls()),
    )
    return [Fact(text, bool(held) and seen.end > 0, numbers) for text, (held, numbers) in judged]


class _Regions:
    """Stable stiffness (kN/m) by method on the longest map's B (N s/m), 0 where a region has ended."""

    def __init__(self, maps: dict[str, Map]):
        longest = max(maps.values(), key=lambda each: len(each.edges))
        self.dampings = np.array([edge.damping_n_s_per_m for edge in longest.edges])
        self.stiffness = {name: np.zeros(len(self.dampings)) for name in maps}
        for name, each in maps.items():
            self.stiffness[name][: len(each.edges)] = [edge.stable_n_per_m / 1e3 for edge in each.edges]
        self.ends = {name: each.damping_n_s_per_m for name, each in maps.items()}
        self.end = self.ends["adjusted"]
        self.inside = self.dampings <= self.end

    def _area(self, name: str) -> float:
        return float(np.trapezoid(self.stiffness[name][self.inside], self.dampings[self.inside]))

    def grows(self) -> tuple[bool, str]:
        areas = [self._area(name) for name in FILTERS[:3]]
        return areas[0] < areas[1] < areas[2], ", ".join(f"{area:.0f}" for area in areas) + " kN/m N s/m"

    def about_equal(self) -> tuple[bool, str]:
        slower, faster = self._area("fdm-500"), self._area("fdm-1000")
        return abs(slower - faster) <= ABOUT * faster, f"{slower:.0f} and {faster:.0f} kN/m N s/m"

    def encloses(self, outer: str, inner: tuple[str, ...], share: float = 1.0) -> tuple[bool, str]:
        where = self.dampings <= share * self.end
        within = np.max([self.stiffness[name] for name in inner], axis=0)
        short = np.flatnonzero(where & (self.stiffness[outer] < within))
        numbers = f"at {where.sum() - len(short)} of {where.sum()} B"
        if len(short):
            first = short[0]
            pair = f"{self.stiffness[outer][first]:g} against {within[first]:g} kN/m"
            numbers += f", not at {self.dampings[first]:g} N s/m: {pair}"
        return not len(short), numbers

    def drops(self) -> tuple[bool, str]:
        """Sharp: a step of B before its last stable wall, K is half of its largest or more."""
        held, numbers = True, []
        for name, wanted in (("proposed", 0.9), ("adjusted", 1.0)):
            values, place = self.stiffness[name], self.ends[name] / self.end if self.end else 0.0
            last = int(np.flatnonzero(values > 0)[-1]) if (values > 0).any() else 0
            before = values[max(last - 1, 0)]
            ended = last + 1 < len(values)
            held = held and ended and before >= values.max() / 2 and abs(place - wanted) <= ABOUT
            numbers.append(f"{name}: {before:g}, {values[last]:g}, {'0' if ended else 'on'} kN/m at {place:.2f}")
        return held, "; ".join(numbers)

    def goes_on(self) -> tuple[bool, str]:
        beyond = self.stiffness["fdm-500"][~self.inside].max(initial=0.0)
        most = self.stiffness["adjusted"].max()
        numbers = f"to {self.ends['fdm-500']:g} N s/m, at up to {beyond:g} kN/m; adjusted at up to {most:g}"
        return 0 < beyond < most, numbers

    def rises_and_falls(self) -> tuple[bool, str]:
        held, numbers = True, []
        for name in ("fdm-500", "fdm-1000"):
            values = self.stiffness[name]
            top = int(values.argmax())
            held = held and values[0] < values[top] > values[-1]
            at = f"{values[top]:g} at {self.dampings[top]:g} N s/m"
            numbers.append(f"{name}: {values[0]:g}, {at}, {values[-1]:g} kN/m")
        return held, "; ".join(numbers)
