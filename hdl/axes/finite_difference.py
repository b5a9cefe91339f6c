"""Velocity as the difference of successive counts, an axis a clock."""

from hardwall.model.estimators.finite_difference import Design

from ..arithmetic.fixed import saturate
from .estimator import Entered, Estimate, moved_since
from .pipe import Pipe


def estimate(pipe: Pipe, design: Design, entered: Entered) -> Estimate:
    """Return the estimate of `hardwall.hdl.estimators.finite_difference`, 2 stages later."""
    moved = moved_since(pipe, design, entered)
    limited = saturate(moved, design.velocity.min, design.velocity.max)
    velocity = limited[: design.velocity.width].as_signed()
    return Estimate(pipe.taken(velocity, "velocity"), pipe.taken(limited != moved, "saturated"))
