"""The resource use and the rate of several axes in one pipeline, against their number."""

from collections.abc import Iterable
from typing import Any

from ...model.axes.axis import AxesSpec
from ...model.runtime.result import Rows, Table, table_of
from ..rtl.pipeline import synthesise_axes
from ..scene.load import load

DEVICE = "ecp5-25k"
SCENE = "mhz"
"""It has the formats of its axis."""
CLOCK_HZ = 96_000_000
"""The clock that is asked for; the placer works as hard as it must for it."""
NUMBERS = (1, 2, 4, 8, 16, 32)


class AxesCosts(Rows):
    """The resource use and the rate of axes: rows of `cost`."""

    def tables(self) -> list[Table]:
        """Return a table for every kind of axes."""
        return [table_of((), (kind, *COLUMNS), [_line(row) for row in own]) for kind, own in self.kinds().items()]

    def kinds(self) -> dict[str, list[dict[str, Any]]]:
        """Return the rows of every kind of axes, by its name."""
        kinds: dict[str, list[dict[str, Any]]] = {}
        for row in self.rows:
            kinds.setdefault(f"{row['estimator']}, {'supervised' if row['supervised'] else 'bare'}", []).append(row)
        return kinds

    def notes(self) -> list[str]:
        """Return what the part has."""
        has = self.rows[0]["available"]
        asked = f"a clock of {CLOCK_HZ / 1e6:g} MHz was asked for"
        return [f"{DEVICE} has {has['lut4']} LUT4, {has['dsp']} DSP and {has['bram']} EBR; {asked}"]


COLUMNS = ("LUT4", "FF", "DSP", "EBR", "fmax (MHz)", "clocks a rota", "M samples/s an axis", "of all")


def _line(row: dict[str, Any]) -> list[str]:
    """Return the cells of a row: with several seeds, fmax has its range."""
    low, high = min(row["fmax_mhz_seeds"]), max(row["fmax_mhz_seeds"])
    spread = "" if len(row["fmax_mhz_seeds"]) == 1 else f" ({low:.1f} to {high:.1f})"
    used = [str(row[name]) for name in ("axes", "lut4", "ff", "dsp", "bram")]
    each = row["max_sample_hz"] / 1e6
    rates = f"{each:.2f}", f"{row['axes'] * each:.1f}"
    return [*used, f"{row['fmax_mhz']:.1f}{spread}", str(row["interval_clocks"]), *rates]


def jobs(estimators: Iterable[str], numbers: Iterable[int], bare: bool, seeds: int) -> list[dict[str, Any]]:
    """Return the arguments of `cost` for every estimator and number of axes, supervised, and if `bare` also without."""
    numbers = list(numbers)
    return [
        {"estimator": name, "axes": axes, "supervised": supervised, "seeds": list(range(1, seeds + 1))}
        for name in estimators
        for supervised in ((True, False) if bare else (True,))
        for axes in numbers
    ]


def cost(estimator: str, axes: int, supervised: bool, seeds: Iterable[int]) -> dict[str, Any]:
    """Return size and speed of axes that sample as fast as their rota allows, placed and routed alone.

    Returns:
        estimator, axes, supervised, device, clock_mhz: the synthesised design, and the requested clock.
        lut4, ff, dsp, bram, available, untimed, latency_clocks, seeds, fmax_mhz_seeds, fmax_mhz: see
            `pipeline.synthesise_axes`.
        interval_clocks: the fewest clocks of a rota; max_sample_hz: the rate of each axis that follows at fmax_mhz.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    spec = fastest(estimator, axes)
    placed = synthesise_axes(spec, DEVICE, supervised, list(seeds))
    return {
        "estimator": estimator,
        "axes": axes,
        "supervised": supervised,
        "device": DEVICE,
        "clock_mhz": spec.clock_hz / 1e6,
        **placed,
        "interval_clocks": spec.slots,
        "max_sample_hz": round(placed["fmax_mhz"] * 1e6 / spec.slots),
    }


def fastest(estimator: str, axes: int) -> AxesSpec:
    """Return axes with the formats of `SCENE` that sample as fast as their rota allows at `CLOCK_HZ`.

    Raises:
        FieldError: if the axes cannot be.
    """
    scene = load(SCENE, {"controller.estimator": estimator, "controller.output": None})
    roomy = AxesSpec(**scene.requirements, axes=axes)
    # A rate is a whole number of hertz.
    slots = next(slots for slots in range(roomy.slots, CLOCK_HZ) if CLOCK_HZ % slots == 0)
    rates = {"clock_hz": CLOCK_HZ, "sample_hz": CLOCK_HZ // slots, "actuation_hz": CLOCK_HZ // slots}
    return AxesSpec(**scene.requirements | rates, axes=axes)
