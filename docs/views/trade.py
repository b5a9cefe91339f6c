"""Tables of `hardwall trade` and `hardwall bench`."""

import math
from typing import Any

from hardwall.sim.walls.methods import methods

from .tables import Report, number, table

Setting = dict[str, Any]
ROWS = 8
"""The largest number of parts in a table: those that move the edge most."""
SECONDS = " (s)"
"""The unit of a command's time, in its name."""
BACKENDS = {
    "float": "the float64 algorithm",
    "fixed": "the bit-accurate model",
    "rtl": "the Verilog, verilated, in the compiled loop",
    "cocotb": "the Verilog under cocotb",
}
"""What runs on each backend."""


def _moves(setting: Setting) -> list[str]:
    """Return the area of every estimator over the reference's, with its interval; bold if the edge moves."""
    cells = []
    for move in setting["moves"].values():
        area, low, high = (
            None if each is None else f"{each:.2f}"
            for each in (move["area_ratio"], move["area_ratio_low"], move["area_ratio_high"])
        )
        text = f"**{area}**" if move["moved"] else area
        spread = "" if low == high else f" ({low} to {high or 'more'})"
        cells.append(f"{text}{'+' * move['clipped']}{spread}")
    return cells


def _names(report: Report) -> list[str]:
    """Return what a table calls the estimators of a trade."""
    return [methods()[label].label for label in report["settings"][0]["moves"]]


def _of(report: Report, *axes: str) -> list[Setting]:
    """Return the settings of an axis or of several, without those that are two at once."""
    return [each for each in report["settings"][1:] if each["axis"] in axes]


def _farthest(setting: Setting) -> float:
    """Return by how much a setting moves the edge of some estimator, as a logarithm."""
    return max(abs(math.log(move["area_ratio"])) for move in setting["moves"].values())


def parts(report: Report) -> list[str]:
    """Return what parts do to the edge, those that a scene has and those that it lacks; the largest area first."""
    chosen = sorted(_of(report, "parts", "lacked"), key=_farthest)[-ROWS:]
    chosen.sort(key=lambda each: -sum(move["area_ratio"] for move in each["moves"].values()))
    return table(
        ["area, relative to the scene as it is", *_names(report)], ([each["label"], *_moves(each)] for each in chosen)
    )


def shortcuts(report: Report) -> list[str]:
    """Return what settings of the simulation save, the boldest two of a kind, and what they do to the edge."""
    reference = report["settings"][0]["hit_s"]
    chosen = [each for axis in ("backend", "rate", "step", "K step") for each in _of(report, axis)[:2]]
    rows = (
        [each["label"], f"{each['hit_s'] * 1e3:.3g}", number(reference / each["hit_s"], 2), *_moves(each)]
        for each in chosen
    )
    return table(["setting", "a hit (ms)", "times as fast", *_names(report)], rows)


def speed(report: Report) -> list[str]:
    """Return the samples a second of every backend."""
    heads = ["backend", "samples a second", "what runs"]
    rows = ([f"`{name}`", f"{_big(rate)}", BACKENDS.get(name, "")] for name, rate in report["samples_per_s"].items())
    return table(heads, rows, 1)


def _big(rate: float) -> str:
    """Return a rate with three digits, in thousands or millions."""
    return f"{rate / 1e6:.3g} M" if rate >= 1e6 else f"{rate / 1e3:.3g} k"


def waiting(report: Report) -> list[str]:
    """Return how long whole commands take at the prompt."""
    timed = [each for each in report["from_the_prompt"] if each["name"].endswith(SECONDS)]
    return table(["command", "s"], ([each["name"].removesuffix(SECONDS), number(each["here"])] for each in timed))


def costs_of_parts(report: Report) -> list[str]:
    """Return the time of a sample of the model with the parts of a device that slow it most, and without any."""
    parts = report["ns_per_sample_of_parts"]
    slowest = sorted((name for name in parts if name != "none"), key=parts.__getitem__)[-ROWS + 1 :]
    return table(["part", "a sample (ns)"], ([name, number(parts[name])] for name in ("none", *slowest)))
