"""The axis for a record of counts, whose wall and output stage are idle."""

from dataclasses import replace
from typing import Any

from .arithmetic.fixed import bits_for
from .checks import FieldError, shown
from .encoder import quadrature
from .encoder.quadrature_speed import max_edge_rate
from .estimators import registry
from .estimators.estimate import EstimatorGains
from .motion import TRAVEL_MAX, Motion
from .record_time import RecordTime
from .spec import AxisSpec

GLITCH_CLOCKS = 0
"""The glitch filter: edges that are computed have no glitches, and are never too fast for the decoder alone."""
DECODER_CLOCKS = quadrature.latency(GLITCH_CLOCKS)
"""The latency of the decoder: an edge this many clocks before a strobe is the last that is counted at it."""
CLOCKS, CLOCKS_A_SECOND = 1 << 16, 1 << 36
"""The clocks of a sample and of a second for the first trial of a design, which takes the fewer."""
STEP_MAX = 2.0**24
"""The largest bound on the speed, counts a sample."""


def idle_axis(time: RecordTime, fastest: float, clocks: float = 1, **requirements: Any) -> AxisSpec:
    """Return the specification of an axis whose wall and output stage are idle.

    A sample has clocks enough for the force path and for the fastest change through the decoder, a power of two.

    Args:
        time: the record's sample rate; the requirements are in the axis's seconds.
        fastest: the largest change of the count in a sample.
        clocks: the fewest clocks of a sample.
        requirements: count, travel, bounds, estimator and gains, by their names in `AxisSpec`.

    Raises:
        TypeError: if a requirement is of the wrong type.
        ValueError: if a requirement is impossible.
    """
    count, second = requirements["count_m"], time.second
    spec = AxisSpec(
        clock_hz=min(second * CLOCKS, CLOCKS_A_SECOND),
        sample_hz=second,
        actuation_hz=second,
        force_max_n=1.0,
        force_resolution_n=1.0,
        stiffness_max_n_per_m=1.0 / count,
        damping_max_n_s_per_m=1.0 / count / second,
        glitch_clocks=GLITCH_CLOCKS,
        **requirements,
    )
    # The edges of an interval begin before its strobe, and must not overlap the force path of the previous interval.
    path = spec.design.latency_to_drive + DECODER_CLOCKS
    needed = max(path, fastest / max_edge_rate(1.0, GLITCH_CLOCKS), clocks)
    return replace(spec, clock_hz=2 ** bits_for(needed) * second)


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
    fastest = motion.speed_max / (motion.count * time.sample_hz)
    _check(motion, time, estimator, gains)
    try:
        return idle_axis(
            time,
            fastest + 1,
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
        raise ValueError(f"{estimator} has no words for this motion ({time.said}: {error})") from None


def _check(motion: Motion, time: RecordTime, estimator: str, gains: EstimatorGains | None) -> None:
    """Raise unless bounds are within what hardware has, and gains are of the estimator."""
    kind = registry.design_of(estimator).gains_class
    if gains is not None and not isinstance(gains, kind):
        raise TypeError(f"gains must be {kind.__module__.rpartition('.')[2]}.Gains or None, not {shown(gains)}")
    for name, counts, unit, (least, most) in (
        ("travel", motion.travel / motion.count, motion.count, (1.0, TRAVEL_MAX)),
        ("speed_max", motion.speed_max / (motion.count * time.sample_hz), motion.count * time.sample_hz, (0, STEP_MAX)),
    ):
        if not least <= counts <= most:
            where = f"with counts of {motion.count:g} at {time.sample_hz:g} Hz"
            value = getattr(motion, name)
            raise FieldError(name, f"must be {least * unit:g} to {most * unit:g} {where}, not {value:g}")
