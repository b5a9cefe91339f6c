"""The values that a run of the closed loop takes, writes to and returns.

A missing part of a scene (`converter`, `sweep`, `delay`, `waiting`, kept samples) is None, and has no machine code.
"""

from typing import NamedTuple

import numpy as np

from ...model.axis.design import Timing
from ...model.stamped import Edges
from ..world.advance import Moment
from ..world.bristles import Bent, Bristled
from ..world.converter import Converter
from ..world.encoder import Encoder
from ..world.euler import Stepped
from ..world.linear import State
from ..world.lines import Waiting
from ..world.rigid import Motion, Rigid, Span
from ..world.taylor import Train
from .record import Kept

Plant = Rigid | Bristled | Train | Stepped
EDGE_CAPACITY = 1 << 14
"""The most edges in one sample before the loop gives up, far beyond the limit of any decoder."""


class World(NamedTuple):
    """The plant and parts that the controller is connected to, with their timing.

    `before` is the time from a changed drive to the next strobe. `after` is the time from the last strobe to the
    changed drive: the sample's own strobe, or a later one if samples overlap.
    """

    plant: Plant
    encoder: Encoder
    converter: Converter | None
    push_n: float  # steady push of the motor, added to the wall's force
    force_lsb_n: float
    timing: Timing
    before: Span | float  # a `Span` for a `Rigid` or a `Bristled`, else s
    after: Span | float
    sweep: "Sweep | None" = None


class Sweep(NamedTuple):
    """The constants of samples that are swept: see `sim.loop.sweep`."""

    until_counted: Span  # from a changed drive to the clock whose cell the next strobe counts
    least_m_per_s: float  # below it there are few edges, and to find them takes less time
    most_m_per_s: float
    margin_m: float  # the least distance of a counted position from an edge


class Progress(NamedTuple):
    """The state of the loop before the drive of `sample` changes: at its strobe or, if samples overlap, at the last
    strobe before the change."""

    sample: int
    moment: Moment
    force_n: float
    taken: tuple[Motion | Bent | State, ...]  # at the strobe of `sample`, and of those that overlap it but the last


class Memory(NamedTuple):
    """The arrays that a run writes to.

    They are apart from the values that it returns, because returning an array for every sample would cost more than the
    sample.
    """

    edges: Edges  # the edges on their way to the controller
    delay: np.ndarray | None  # the drives that a late amplifier still holds, by sample number
    overview: Kept | None
    detail: Kept | None
    positions: np.ndarray  # float64: the position (m) at each sample of a call
    drives: np.ndarray  # the drive (force LSB) after each
    waiting: Waiting | None = None  # what is on its way over the encoder's lines
