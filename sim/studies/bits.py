"""What a bit buys: an estimator's error and its logic against the width of its words, bit by bit below the derived."""

from ..estimates import signals
from ..estimates.accuracy import axis_spec, measure
from ..rtl.synthesis import estimator_cells

SIGNAL = "paper"
DEVICE = "ecp5-25k"
DROPPED = range(13)


def bit(estimator: str, output: str, sample_hz: int, bits_dropped: int) -> dict | None:
    """Return error and logic of an estimator whose words lack so many fraction bits; None if there are not so many.

    Returns:
        estimator, output, sample_hz, bits_dropped: what was measured.
        velocity_bits: width of the velocity's word.
        rms_mm_s: error on the signal `paper`, in fixed point.
        lut4, ff, dsp: cells of the estimator alone.

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
