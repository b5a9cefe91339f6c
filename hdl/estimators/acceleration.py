"""A velocity estimator with a second output, the acceleration."""

from amaranth.lib.wiring import Member, Out

from hardwall.model.estimators.acceleration import Accelerated

from ..arithmetic.fixed import shape
from .estimate import EstimatorBlock


class AcceleratedBlock(EstimatorBlock):
    """A velocity estimator that also gives the acceleration; a subclass adds the logic.

    Parameters
    ----------
    design : hardwall.model.estimators.acceleration.Accelerated
        The estimator's design, of its `design_class`.

    Members, besides those of every estimator
    -----------------------------------------
    acceleration : Out(SQ)
        Acceleration, counts a sample^2, in the format `design.acceleration`. It belongs to `velocity`, and is constant
        from one `valid` to the next, too.
    """

    @staticmethod
    def members(design: Accelerated) -> dict[str, Member]:
        return EstimatorBlock.members(design) | {"acceleration": Out(shape(design.acceleration))}
