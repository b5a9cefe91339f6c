"""The value of a bit: an estimator's error and logic as its words shrink, bit by bit, from the derived widths."""

from typing import Any

from ...model.runtime.result import Rows, Table, table_of
from ..estimates import signals
from ..estimates.accuracy import axis_spec, measure
from ..rtl.synthesis import estimator_cells
from ..walls.methods import Curve

SIGNAL = "paper"
DEVICE = "ecp5-25k"
DROPPED = range(13)


class Bits(Rows):
    """Errors and logic by width: rows of `bit`."""

    def tables(self) -> list[Table]:
        """Return a table of the rows."""
        columns = ("bits_dropped", "velocity_bits", "rms_mm_s", "lut4", "ff", "dsp")
        lines = [
            [f"{row['estimator']} {row['output']}", *(f"{row[name]:.5g}" for name in columns)] for row in self.rows
        ]
        heads = ("bits dropped", "velocity bits", "RMS (mm/s)", "LUT4", "FF", "DSP")
        return [table_of(("estimator",), heads, lines)]


def jobs(curves: list[Curve], sample_hz: int) -> list[dict[str, Any]]:
    """Return the arguments of `bit` for every estimator and number of bits dropped."""
    return [
        {"estimator": curve.estimator, "output": curve.output, "sample_hz": sample_hz, "bits_dropped": dropped}
        for curve in curves
        for dropped in DROPPED
    ]


def bit(estimator: str, output: str, sample_hz: int, bits_dropped: int) -> dict | None:
    """Return error and logic of an estimator with fraction bits dropped; None if its words have too few to drop.

    Returns:
        estimator, output, sample_hz, bits_dropped: what was measured.
        velocity_bits: width of the velocity word.
        rms_mm_s: RMS error on the signal `paper`, in fixed point.
        lut4, ff, dsp, bram: cells of the estimator alone.

    Raises:
        SynthesisError: if a tool is missing or fails.
    """
    bound = signals.load(SIGNAL).acceleration_max_m_per_s2
    try:
        spec = axis_spec(estimator, sample_hz, bound, None, bits_dropped)
    except ValueError:
        return None
    row = measure(estimator, output, SIGNAL, sample_hz, "fixed", bits_dropped=bits_dropped)
    return {
        "estimator": estimator,
        "output": output,
        "sample_hz": sample_hz,
        "bits_dropped": bits_dropped,
        "velocity_bits": row["velocity_bits"],
        "rms_mm_s": row["rms_mm_s"],
        **estimator_cells(spec, DEVICE),
    }
