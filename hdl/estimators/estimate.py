"""The members that every velocity estimator has in hardware, with the bus from the decoder."""

from amaranth.lib.wiring import In, Member, Out

from hardwall.model.estimators.estimate import EstimatorDesign

from ..arithmetic.fixed import shape
from ..block import Block
from ..quadrature import Seen


class EstimatorBlock(Block):
    """A velocity estimator with the members that all estimators have; a subclass adds the logic.

    Parameters
    ----------
    design : hardwall.model.estimators.estimate.EstimatorDesign
        The estimator's design, of its `design_class`.

    Members
    -------
    strobe : In(1)
        Pulse: take a sample.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    seen : In(Seen)
        The decoder's outputs, valid with `strobe`; an estimator uses the fields `design.inputs`.
    one input for each of `design.words` : In
        Run-time parameters; constant from a `strobe` to its `valid`.
    velocity : Out(SQ)
        Velocity, counts a sample, in the format `design.velocity`; constant from one `valid` to the next.
    saturated : Out
        From `valid` until the next `strobe`: bits as in `design.flags`.
    valid : Out(1)
        High for one clock. The next `strobe` may come with it.

    Raises
    ------
    TypeError
        If `design` is of another class.
    """

    @staticmethod
    def members(design: EstimatorDesign) -> dict[str, Member]:
        return {
            "strobe": In(1),
            "restart": In(1),
            "seen": In(Seen(design.count_width, design.stamp_width)),
            **{word.name: In(shape(word.format)) for word in design.words},
            "velocity": Out(shape(design.velocity)),
            "saturated": Out(len(design.flags)),
            "valid": Out(1),
        }
