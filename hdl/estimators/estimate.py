"""What every velocity estimator is in hardware: its members, and how a decoder feeds it."""

from amaranth.hdl import signed
from amaranth.lib.wiring import In, Out

from hardwall.model.quadrature import RUN_MAX

from ..arithmetic.fixed import shape
from ..block import Block


class EstimatorBlock(Block):
    """A velocity estimator: the members that all of them have; a subclass adds what happens between them.

    Parameters
    ----------
    design : Design
        Of its twin; `kind` is the class that it must be of.

    Members
    -------
    strobe : In(1)
        Takes a sample.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    one input for each of `design.inputs` : In
        Outputs of the decoder, by the same names, valid with `strobe`: `count` is the position, counts, and may wrap.
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

    def __init__(self, design, kind: type):
        def members() -> dict:
            seen = {"count": signed(design.count_width), "edge": 2, "down": 1, "run": range(RUN_MAX + 1)}
            return {
                "strobe": In(1),
                "restart": In(1),
                **{name: In(design.stamp_width if name[:5] == "stamp" else seen[name]) for name in design.inputs},
                **{word.name: In(shape(word.format)) for word in design.words},
                "velocity": Out(shape(design.velocity)),
                "saturated": Out(len(design.flags)),
                "valid": Out(1),
            }

        super().__init__(design, kind, members)
