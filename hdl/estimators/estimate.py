"""What every velocity estimator is in hardware: its members, and the bus by which it sees the decoder."""

from amaranth.lib.wiring import In, Member, Out

from hardwall.model.estimators.estimate import EstimatorDesign

from ..arithmetic.fixed import shape
from ..block import Block
from ..quadrature import Seen


class EstimatorBlock(Block):
    """A velocity estimator: the members that all of them have; a subclass adds what happens between them.

    Parameters
    ----------
    design : hardwall.model.estimators.estimate.EstimatorDesign
        That of the estimator, of its `design_class`.

    Members
    -------
    strobe : In(1)
        Takes a sample.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    seen : In(Seen)
        What the decoder shows, valid with `strobe`; an estimator uses `design.inputs` of it.
    one input for each of `design.words` : In
        Run-time parameters; constant from a `strobe` to its `valid`.
    velocity : Out(SQ)
        Counts a sample, `design.velocity`; valid from `valid` until the next.
    saturated : Out
        With `valid`: bits as `design.flags`.
    valid : Out(1)
        High for one clock. The next `strobe` may come with it.

    Raises
    ------
    TypeError
        If `design` is not of that class.
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
