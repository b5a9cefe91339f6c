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
    """Return the eight facts.

    Args:
        maps: by the names of `figures.methods`, all of one grid.
    """
    longest = max(maps.values(), key=lambda each: len(each.edges))
    dampings = np.array([edge.damping_n_s_per_m for edge in longest.edges])
    stiffness = {name: np.zeros(len(dampings)) for name in maps}
    for name, each in maps.items():
        stiffness[name][: len(each.edges)] = [edge.stable_n_per_m / 1e3 for edge in each.edges]
    ends = {name: dampings[values > 0].max(initial=0.0) for name, values in stiffness.items()}
    inside = dampings <= ends["adjusted"]
    half = dampings <= ends["adjusted"] / 2
    areas = {name: float(np.trapezoid(values[inside], dampings[inside])) for name, values in stiffness.items()}
    filters = np.max([stiffness[name] for name in FILTERS], axis=0)
    proposed, adjusted = stiffness["proposed"], stiffness["adjusted"]

    def encloses(outer: np.ndarray, inner: np.ndarray, where: np.ndarray) -> tuple[bool, str]:
        """Return whether one region encloses another, and at how many B it does."""
        short = np.flatnonzero(where & (outer < inner))
        numbers = f"at {where.sum() - len(short)} of {where.sum()} B"
        if len(short):
            first = short[0]
            numbers += f", not at {dampings[first]:g} N s/m: {outer[first]:g} against {inner[first]:g} kN/m"
        return not len(short), numbers

    def rises_and_falls(name: str) -> tuple[bool, str]:
        values = stiffness[name]
        top = int(values.argmax())
        held = 0 < top < len(values) - 1 and values[-1] < values[top]
        return held, f"{values[0]:g}, {values[top]:g} at {dampings[top]:g} N s/m, {values[-1]:g} kN/m"

    def place(name: str) -> float:
        return ends[name] / ends["adjusted"]

    def last(name: str) -> str:
        values = stiffness[name][stiffness[name] > 0]
        return f"{name} from {values[-1]:g} kN/m to 0 after {ends[name]:g} N s/m"

    ratio = areas["fdm-500"] / areas["fdm-1000"]
    onward = dampings > ends["adjusted"]
    beyond = stiffness["fdm-500"][onward & (stiffness["fdm-500"] > 0)]
    wide = {name: rises_and_falls(name) for name in ("fdm-500", "fdm-1000")}
    lower = beyond.max(initial=0.0) < adjusted.max()
    return [
        Fact(
            "the region grows from 30 to 100 to 500 Hz",
            areas["fdm-30"] < areas["fdm-100"] < areas["fdm-500"],
            ", ".join(f"{areas[name]:.0f}" for name in FILTERS[:3]) + " kN/m N s/m",
        ),
        Fact("500 and 1000 Hz are about equal", abs(ratio - 1) <= ABOUT, f"ratio of areas {ratio:.2f}"),
        Fact("Levant adjusted encloses every filtered difference", *encloses(adjusted, filters, inside)),
        Fact("Levant adjusted encloses Levant proposed", *encloses(adjusted, proposed, inside)),
        Fact(
            "Levant proposed beats every filtered difference up to half of the range",
            *encloses(proposed, filters, half),
        ),
        Fact(
            "Levant ends in a sharp drop, proposed near 0.9 of the range",
            abs(place("proposed") - 0.9) <= ABOUT,
            f"{last('proposed')} ({place('proposed'):.2f} of the range), {last('adjusted')}",
        ),
        Fact(
            "500 Hz goes on to higher B at lower K",
            bool(len(beyond)) and bool(lower),
            f"to {ends['fdm-500']:g} N s/m, at up to {beyond.max(initial=0.0):g} kN/m; "
            f"adjusted at up to {adjusted.max():g}",
        ),
        Fact(
            "for 500 and 1000 Hz, K first rises and then falls with B",
            all(held for held, _ in wide.values()),
            "; ".join(f"{name}: {numbers}" for name, (_, numbers) in wide.items()),
        ),
    ]
