"""How pages show the reports of commands: each view makes the lines of a Markdown table of one."""

from collections.abc import Callable, Iterable
from typing import Any

Report = dict[str, Any]


def table(heads: Iterable[str], rows: Iterable[Iterable[str]], numbers_from: int = 1) -> list[str]:
    """Return the lines of a Markdown table, whose columns from a place on have numbers."""
    heads = list(heads)
    rules = ["---" if place < numbers_from else "---:" for place in range(len(heads))]
    return [f"| {' | '.join(line)} |" for line in (heads, rules, *rows)]


def number(value: float, digits: int = 3) -> str:
    """Return a number with so many digits that matter, without an exponent."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if "e" in text else text


def rate(hertz: float) -> str:
    """Return a rate with its unit."""
    for size, unit in ((1e6, "MHz"), (1e3, "kHz")):
        if hertz >= size:
            return f"{hertz / size:g} {unit}"
    return f"{hertz:g} Hz"


def errors_by_rate(report: Report) -> list[str]:
    """Return the RMS error of every estimator at every rate, in mm/s."""
    rows = report["rows"]
    rates = sorted({row["sample_hz"] for row in rows})
    found = {(row["estimator"], row["output"], row["sample_hz"]): row["rms_mm_s"] for row in rows}
    names = dict.fromkeys((row["estimator"], row["output"]) for row in rows)
    cells = ([f"`{name}` {output}", *(number(found[name, output, each]) for each in rates)] for name, output in names)
    return table(["estimator", *(f"RMS error at {rate(each)} (mm/s)" for each in rates)], cells)


def areas(report: Report) -> list[str]:
    """Return the area of the stable walls of every map with its interval, and its largest stiffness."""
    rows = []
    for each in report["maps"]:
        area, low, high = (each[f"area{end}_n2_s_per_m2"] / 1e3 for end in ("", "_low", "_high"))
        stiffness = each["largest_stiffness_n_per_m"] / 1e3
        rows.append([each["label"], f"{area:.0f}", f"{low:.0f} to {high:.0f}", f"{stiffness:.0f}"])
    return table(["estimator", "area (kN/m N s/m)", "95 % interval", "largest K (kN/m)"], rows)


def settings(report: Report) -> list[str]:
    """Return what every shortcut takes for a hit and for a map, and how far it moves the area of every map."""
    rows = []
    for each in report["settings"]:
        moves = [
            f"{name} {move['area_ratio']:.2f}{'' if move['moved'] else ' (no move)'}"
            for name, move in each["moves"].items()
        ]
        rows.append([each["axis"], each["label"], number(1e3 * each["hit_s"]), number(each["map_s"]), "; ".join(moves)])
    return table(["group", "setting", "a hit (ms)", "a map (s)", "area, against the reference"], rows, 2)


VIEWS: dict[str, Callable[[Report], list[str]]] = {
    "areas": areas,
    "errors-by-rate": errors_by_rate,
    "settings": settings,
}
