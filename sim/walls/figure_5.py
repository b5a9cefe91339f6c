"""Seven facts that the founding paper states of its Figure 5, of six methods, and whether maps show them too.

An eighth, that the region does not grow discernibly from 1000 to 4000 Hz, is of filters that the figure does not have.
The paper says that Levant has higher stiffness than every filter over an equal range of damping. Here this is read as a
larger area over that range. The number of B at which its stiffness is at least as high is among the numbers.

The paper's B axis is known except for zeros that may be missing. So the facts are judged over a range from the maps
themselves: from their first B to the end of Levant with adjusted gains. In the figure this is almost the whole range.

Every fact has a shortfall: 0 if it holds, 1 if nothing of it is there, and between them the part that is lacking:

- a region that should be larger than another: the part of the other's area by which it is smaller;
- a region that should enclose others: the part of their area in the range that is outside it;
- a sharp drop: the error of its place beyond `ABOUT`, and the missing fraction of half of the largest K a step before
  the drop; if the region has not ended, the last K over the largest;
- 500 Hz that should go on: the fraction of the range by which it ends early; if it goes on too stiff, the excess of K
  over Levant's largest, as a fraction;
- K that should rise and fall: a quarter for each rise or fall that is missing.
"""

from dataclasses import dataclass, replace

import numpy as np

from .zwidth import Map

NUMBER = 7
"""The number of the facts."""
ABOUT = 0.1
"""Places on the range that differ by no more than this part of it are about equal."""
FILTERS = ("fdm-30", "fdm-100", "fdm-500", "fdm-1000")

Judged = tuple[bool, float, str]
"""Whether a fact is held; its shortfall; the numbers that show it."""


@dataclass(frozen=True)
class Fact:
    """A fact of the paper's figure, whether the maps show it, their shortfall from 0 to 1, and the numbers.

    `share` is the share of the draws of the starts that show it; None if not asked for.
    """

    text: str
    held: bool
    shortfall: float
    numbers: str
    share: float | None = None


def facts(maps: dict[str, Map]) -> list[Fact]:
    """Return the facts; none is held if Levant with adjusted gains is stable nowhere.

    Args:
        maps: the maps by the names of `methods.methods`, all on the same grid.
    """
    seen = _Regions(maps)
    judged = (
        ("30 Hz has the smallest region of all, and it grows to 100, 500 and 1000 Hz", seen.grows()),
        ("Levant adjusted is stiffer than every filtered difference over its range of B", seen.stiffer()),
        ("adjusted gains enlarge Levant's region", seen.enlarged()),
        (
            "Levant proposed beats every filtered difference up to half of the range",
            seen.encloses("proposed", FILTERS, share=0.5),
        ),
        ("Levant ends in a sharp drop, proposed near 0.9 of the range", seen.drops()),
        ("500 Hz goes on to higher B at lower K", seen.goes_on()),
        ("for 500 and 1000 Hz, K first rises and then falls with B", seen.rises_and_falls()),
    )
    if not seen.end:
        return [Fact(text, False, 1.0, numbers) for text, (_, _, numbers) in judged]
    return [Fact(text, bool(held), min(float(lack), 1.0), numbers) for text, (held, lack, numbers) in judged]


def with_shares(maps: dict[str, Map]) -> list[Fact]:
    """Return the facts with the shares of the draws that show them."""
    number = next(iter(maps.values())).drawn.shape[2]
    drawn = [facts({name: each.draw(draw) for name, each in maps.items()}) for draw in range(number)]
    shares = np.mean([[fact.held for fact in each] for each in drawn], axis=0)
    return [replace(fact, share=float(share)) for fact, share in zip(facts(maps), shares, strict=True)]


class _Regions:
    """Stable stiffness (kN/m) by method on the longest map's B (N s/m), 0 where a region has ended."""

    def __init__(self, maps: dict[str, Map]):
        longest = max(maps.values(), key=lambda region: len(region.boundary))
        self.dampings = np.array([point.damping_n_s_per_m for point in longest.boundary])
        self.stiffness = {name: np.zeros(len(self.dampings)) for name in maps}
        for name, region in maps.items():
            self.stiffness[name][: len(region.boundary)] = [point.stable_n_per_m / 1e3 for point in region.boundary]
        self.ends = {name: region.damping_n_s_per_m for name, region in maps.items()}
        self.end = self.ends["adjusted"]
        self.inside = self.dampings <= self.end

    def _area(self, name: str) -> float:
        return float(np.trapezoid(self.stiffness[name][self.inside], self.dampings[self.inside]))

    def grows(self) -> Judged:
        areas = {name: self._area(name) for name in self.stiffness}
        first, second, *rest = FILTERS
        pairs = [(first, other) for other in areas if other != first] + [(second, each) for each in rest]
        shrunk = sum(_part(areas[less] - areas[more], areas[less]) for less, more in pairs)
        numbers = ", ".join(f"{areas[name]:.0f}" for name in FILTERS) + " kN/m N s/m"
        return all(areas[less] < areas[more] for less, more in pairs), shrunk, numbers

    def stiffer(self) -> Judged:
        own, name = self._area("adjusted"), max(FILTERS, key=self._area)
        _, _, where = self.encloses("adjusted", FILTERS)
        numbers = f"{own:.0f}, and {name} {self._area(name):.0f} kN/m N s/m; {where}"
        return own > self._area(name), _part(self._area(name) - own, self._area(name)), numbers

    def enlarged(self) -> Judged:
        # The area on all of the map: the proposed gains may go on where the adjusted ones have ended.
        own, before = (float(np.trapezoid(self.stiffness[name], self.dampings)) for name in ("adjusted", "proposed"))
        return own > before, _part(before - own, before), f"{own:.0f}, from {before:.0f} kN/m N s/m"

    def encloses(self, outer: str, inner: tuple[str, ...], share: float = 1.0) -> Judged:
        where = self.dampings <= share * self.end
        within = np.max([self.stiffness[name] for name in inner], axis=0)
        short = np.flatnonzero(where & (self.stiffness[outer] < within))
        numbers = f"at {where.sum() - len(short)} of {where.sum()} B"
        if len(short):
            first = short[0]
            pair = f"{self.stiffness[outer][first]:g} against {within[first]:g} kN/m"
            numbers += f", not at {self.dampings[first]:g} N s/m: {pair}"
        outside = np.maximum(within - self.stiffness[outer], 0.0)[where].sum()
        return not len(short), _part(outside, within[where].sum()), numbers

    def drops(self) -> Judged:
        """Judge the drops; a drop is sharp if K is at least half of its largest one step of B before the last stable
        wall."""
        held, lack, numbers = True, 0.0, []
        for name, paper_place in (("proposed", 0.9), ("adjusted", 1.0)):
            values, place = self.stiffness[name], self.ends[name] / self.end if self.end else 0.0
            last = int(np.flatnonzero(values > 0)[-1]) if (values > 0).any() else 0
            before, ended = values[max(last - 1, 0)], last + 1 < len(values)
            held = held and ended and before >= values.max() / 2 and abs(place - paper_place) <= ABOUT
            lack += max(abs(place - paper_place) - ABOUT, 0.0) + _part(values.max() / 2 - before, values.max())
            lack += 0.0 if ended else _part(values[last], values.max())
            numbers.append(f"{name}: {before:g}, {values[last]:g}, {'0' if ended else 'on'} kN/m at {place:.2f}")
        return held, lack, "; ".join(numbers)

    def goes_on(self) -> Judged:
        beyond = self.stiffness["fdm-500"][~self.inside].max(initial=0.0)
        most = self.stiffness["adjusted"].max()
        numbers = f"to {self.ends['fdm-500']:g} N s/m, at up to {beyond:g} kN/m; adjusted at up to {most:g}"
        early, over = _part(self.end - self.ends["fdm-500"], self.end), _part(beyond - most, most)
        return 0 < beyond < most, over if beyond else early, numbers

    def rises_and_falls(self) -> Judged:
        missing, numbers = 0, []
        for name in ("fdm-500", "fdm-1000"):
            values = self.stiffness[name]
            top = int(values.argmax())
            missing += (values[0] >= values[top]) + (values[-1] >= values[top])
            at = f"{values[top]:g} at {self.dampings[top]:g} N s/m"
            numbers.append(f"{name}: {values[0]:g}, {at}, {values[-1]:g} kN/m")
        return not missing, missing / 4, "; ".join(numbers)


def _part(lack: float, whole: float) -> float:
    """Return a lack as a part of the whole: 0 if nothing is lacking, 1 if there is no whole."""
    if lack <= 0:
        return 0.0
    return lack / whole if whole else 1.0
