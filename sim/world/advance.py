"""Advancing a device and its encoder together over an interval of constant force: the contract of all four solvers.

Which of them runs is decided by the class of the plant: `rigid` (closed form), `presliding` (that and power series),
`taylor` (polynomials to rounding) and `euler` (fixed steps) register their variants here.
"""

from typing import NamedTuple

from ...model.runtime.compiled import by_type
from .encoder import Cell


class Interval(NamedTuple):
    """A length of time under one force."""

    length: object  # in the form that the solver takes: a `rigid.Span` for a rigid handle, else seconds
    clock: int  # number of the clock at which it starts
    clocks: int  # its length in clocks of the encoder, at least 1


class Moment(NamedTuple):
    """The state of plant and encoder between two intervals."""

    motion: object  # a `rigid.Motion`, a `bristles.Bent` or a `linear.State`, as the plant has it
    cell: Cell  # the encoder's cell, which holds its position; `encoder.locate` gives the first
    n_edges: int  # edges that are on their way to the controller; negative: edges were lost


@by_type
def advance_quietly(plant, moment, force_n, interval):
    """Return (moment, quiet): the moment after an interval, and whether it is certain that nothing happened meanwhile.

    Where `quiet` is false (an edge or a turn is likely) the result means nothing and the interval is left to `advance`.
    Nearly every interval of a closed loop takes this path, so it handles no array: passing an array to a compiled
    function costs more than advancing the handle.
    """


@by_type
def advance(plant, encoder, moment, force_n, interval, edges):
    """Return the `Moment` after one `Interval` of constant applied force.

    Args:
        plant: a `rigid.Rigid`, a `bristles.Bristled`, a `taylor.Train` or a `euler.Stepped`.
        encoder: an `Encoder`.
        moment: the `Moment` at the start.
        force_n: force of motor and wall together (N), positive towards positive positions.
        interval: an `Interval`.
        edges: `Edges` of the model's `stamped`, which hold `moment.n_edges` already; new ones are appended. Their
            clocks never decrease: interval.clock < clock <= interval.clock + interval.clocks. Where several share one
            clock, the pins show the last. Once the arrays are full `n_edges` is -1 and stays -1: edges were lost, and
            the cell belongs to the last edge kept.
    """
