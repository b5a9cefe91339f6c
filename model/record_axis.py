"""The axis for a record of counts, whose wall and output stage are idle."""

from dataclasses import replace
from typing import Any

from .arithmetic.fixed import bits_for
from .encoder import quadrature
from .encoder.quadrature_speed import max_edge_rate
from .estimators.estimate import EstimatorGains
from .motion import Motion
from .record_time import SECOND, RecordTime
from .spec import AxisSpec

GLITCH_CLOCKS = 0
"""The glitch filter: edges that are computed have no glitches, and are never too fast for the decoder alone."""
DECODER_CLOCKS = quadrature.latency(GLITCH_CLOCKS)
"""The latency of the decoder: an edge this many clocks before a strobe is the last that is counted at it."""
CLOCKS = 1 << 16
"""The clocks of a sample with which a design is tried first."""


def idle_axis(fastest: float, clocks: float = 1, **requirements: Any) -> AxisSpec:
    """Return the specification of an axis with `SECOND` samples a second, whose wall and output stage are idle.

    A sample has clocks enough for the force path and for the fastest change through the decoder, a power of two.

    Args:
        fastest: the largest change of the count in a sample.
        clocks: the fewest clocks of a sample.
        requirements: count, travel, bounds, estimator and gains, by their names in `AxisSpec`.

    Raises:
        TypeError: if a requirement is of the wrong type.
        ValueError: if a requirement is impossible.
    """
    count = requirements["count_m"]
    spec = AxisSpec(
        clock_hz=SECOND * CLOCKS,
        sample_hz=SECOND,
        actuation_hz=SECOND,
        force_max_n=1.0,
        force_resolution_n=1.0,
        stiffness_max_n_per_m=1.0 / count,
        damping_max_n_s_per_m=1.0 / count / SECOND,
        glitch_clocks=GLITCH_CLOCKS,
        **requirements,
    )
    # The edges of an interval begin before its strobe, and must not overlap the force path of the previous interval.
    path = spec.design.latency_to_drive + DECODER_CLOCKS
    needed = max(path, fastest / max_edge_rate(1.0, GLITCH_CLOCKS), clocks)
    return replace(spec, clock_hz=2 ** bits_for(needed) * SECOND)


def axis_of(
    motion: Motion, time: RecordTime, estimator: str, gains: EstimatorGains | None = None, clocks: float = 1
) -> AxisSpec:
    """Return the specification of the axis for a motion: see `idle_axis` and `record_time`.

    Args:
        motion: the bounds.
        time: the record's sample rate.
        estimator: name of the velocity estimator.
        gains: its gains in true seconds and the motion's unit; None for its default ones.
        clocks: the fewest clocks of a sample.

    Raises:
        TypeError: if the gains are of another estimator.
        ValueError: if the hardware has no words for these bounds.
    """
    try:
        return idle_axis(
            motion.speed_max / (motion.count * time.sample_hz) + 1,
            clocks,
            count_m=float(motion.count),
            travel_m=float(motion.travel),
            speed_max_m_per_s=time.to_axis(motion.speed_max, 1),
            acceleration_max_m_per_s2=time.to_axis(motion.acceleration_max, 2),
            jerk_max_m_per_s3=None if motion.jerk_max is None else time.to_axis(motion.jerk_max, 3),
            edge_error_max_counts=float(motion.edge_error),
            estimator=estimator,
            gains=None if gains is None else time.gains(gains),
        )
    except ValueError as error:
        why = f"with {SECOND} samples a second: {error}"
        raise ValueError(f"{estimator} has no words for this motion ({why})") from None
