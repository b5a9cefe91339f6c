"""Tables of what places and routes: `hardwall costs`, `synth`, `axes` and `bits`."""

from typing import Any

from .tables import Report, number, table

Row = dict[str, Any]


def _rate(hz: float | None) -> str:
    """Return a rate in M samples/s."""
    return "does not fit" if hz is None else f"{hz / 1e6:.3g}"


def costs(report: Report) -> list[str]:
    """Return what every estimator costs: alone, and the board with it."""
    heads = ["estimator", "clocks", "LUT4", "DSP", "board: LUT4", "fmax (MHz)", "M samples/s"]
    rows = [
        [
            f"`{row['estimator']}`",
            *(str(row[key]) for key in ("latency_clocks", "lut4", "dsp")),
            *(_board(row["board"])),
        ]
        for row in report["rows"]
    ]
    return table(heads, rows)


def _board(board: Row | None) -> list[str]:
    """Return the cells of a board, its fmax and its rate."""
    if board is None:
        return ["too many", "", ""]
    return [str(board["lut4"]), f"{board['fmax_mhz']:.1f}", _rate(board["max_sample_hz"])]


def placed(*reports: Report) -> list[str]:
    """Return the cells and the speed of a board, a row for each report of `hardwall synth`."""
    heads = ["part", "LUT4", "FF", "DSP", "BRAM", "fmax (MHz)", "asked (MHz)", "pin to drive (ns)", "M samples/s"]
    return table(heads, map(_placed, reports))


def _placed(report: Report) -> list[str]:
    available = report["available"]["lut4"]
    return [
        f"`{report['device']}`",
        f"{report['lut4']} of {available}",
        *(str(report[key]) for key in ("ff", "dsp", "bram")),
        _fmax(report),
        number(report["clock_mhz"]),
        number(report["pin_to_force_ns"]),
        _rate(report["max_sample_hz"]),
    ]


def _fmax(row: Row) -> str:
    """Return the median fmax in MHz, with the range of several seeds."""
    low, high = min(row["fmax_mhz_seeds"]), max(row["fmax_mhz_seeds"])
    return f"{row['fmax_mhz']:.1f}" + (f" ({low:.1f} to {high:.1f})" if high > low else "")


def axes(report: Report) -> list[str]:
    """Return the cells and the speed of the pipeline by the number of its axes."""
    heads = ["axes", "LUT4", "FF", "DSP", "fmax (MHz)", "clocks a rota", "M samples/s an axis", "of all"]
    rows = [
        [
            str(row["axes"]),
            *(str(row[key]) for key in ("lut4", "ff", "dsp")),
            _fmax(row),
            str(row["interval_clocks"]),
            _rate(row["max_sample_hz"]),
            number(row["axes"] * row["max_sample_hz"] / 1e6),
        ]
        for row in report["rows"]
    ]
    return table(heads, rows)


def bits(report: Report) -> list[str]:
    """Return the error of every estimator with fewer bits, as a multiple of that with all, and the logic saved."""
    by_name: dict[str, dict[int, Row]] = {}
    for row in report["rows"]:
        by_name.setdefault(f"`{row['estimator']}` {row['output']}", {})[row["bits_dropped"]] = row
    dropped = [3, 6, 9, 12]
    rows = []
    for name, own in by_name.items():
        whole = own[0]
        times = [number(own[each]["rms_mm_s"] / whole["rms_mm_s"], 3) if each in own else "" for each in dropped]
        saved = f"{100 * (1 - own[6]['lut4'] / whole['lut4']):.0f} %" if own.get(6, {}).get("lut4") else ""
        rows.append([name, str(whole["velocity_bits"]), *times, saved])
    heads = ["estimator", "bits", *(f"{each} fewer" for each in dropped), "logic saved by 6"]
    return table(heads, rows)
