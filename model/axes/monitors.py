"""The monitors of one of several axes, which look once a sample; twin of `hardwall.hdl.axes.monitors`.

One `step` is one sample. The causes, their thresholds and the warning are as in `monitors`, which looks at every clock.
The differences, and what they cost:

    position_range,       of the counts that the samples took. An excursion between two samples is not seen, nor does
    position_wrap         the wall see it. Both limits are compared in every sample.
    velocity_limit        the same: it looks at estimates, of which every sample has one.
    runaway               the way is the sum of the differences of sampled counts, while the drive was at its limit on
                          one side after the last two turns. What a handle does and undoes between two samples is no
                          way. At a sample after a preload or a shift of the origin the difference is 0, so that the
                          motion of one sample is lost: a host that preloads at every sample has no such monitor.
    estimator_saturated   the same: it counts samples.
    encoder_loss          a channel equalled its complement at every clock of a rota, and of the rotas before it
                          without a gap, for more clocks than supervisor_loss in all. It never trips sooner than
                          `monitors`, and less than two rotas later; a loss that ends before is missed.
    index_spacing         of indexes, the last one before each sample, with the place that it had. One that another
                          follows within a rota is missed: it was at most as many counts away as a rota has clocks.
                          So is one that a shift of the origin follows before the sample; the last one before it moves
                          with the origin. A preload begins anew, and forgets the last index.
    a_channel_idle        a hundred samples with edges of one channel alone, those without an edge left out: as many
                          edges or more.
"""

from typing import NamedTuple

from ..arithmetic.fixed import wrap
from ..axis.monitors import (
    ENCODER_LOSS,
    ESTIMATOR_SATURATED,
    IDLE_EDGES,
    INDEX_SPACING,
    POSITION_RANGE,
    POSITION_WRAP,
    RUNAWAY,
    VELOCITY_LIMIT,
)
from ..runtime.compiled import compiled


class Params(NamedTuple):
    """The count's width, the bits that the word of the velocity's limit lacks, and the clocks of a rota."""

    count_width: int
    velocity_shift: int
    rota: int


class Inputs(NamedTuple):
    """An axis's outputs for a sample, and its words."""

    count: int = 0  # type: ignore[assignment]  # a tuple has a method of this name
    fresh: int = 0  # the count was preloaded since the last sample, or there was none
    shifted: int = 0  # the origin was shifted since the last sample
    shift: int = 0  # by so many counts, which were added to the count
    velocity: int = 0
    saturated: int = 0
    indexed: int = 0  # there was an index since the last sample, or since a preload or a shift after that
    index_count: int = 0  # the place of the last one
    lost_a: int = 0  # channel A has equalled its complement at every clock since the last sample
    lost_b: int = 0
    edge_a: int = 0  # there was an edge of channel A since the last sample
    edge_b: int = 0
    supervisor_position_low: int = 0
    supervisor_position_high: int = 0
    supervisor_velocity_limit: int = 0
    supervisor_runaway: int = 0
    supervisor_saturated: int = 0
    supervisor_loss: int = 0
    supervisor_turn: int = 0
    supervisor_index_tolerance: int = 0


class State(NamedTuple):
    """The causes and the warning of the last sample, and what is kept of an axis."""

    causes: int
    a_channel_idle: int
    last_count: int
    pressed: int  # the drive was at its limit before the last sample
    negative: int  # it was negative
    way: int  # counts that the handle has moved since then, against the drive: negative
    samples: int  # successive samples with a saturated estimate
    lost_a: int  # clocks of the rotas for which a channel has equalled its complement
    lost_b: int
    channel: int  # channel of the last edges, 1: B
    edges: int  # samples in a row with edges of that channel alone
    has_index: int
    last_index: int  # the place of the last index


START = State(*(0 for _ in State._fields))


@compiled
def _lost(wrong, passed, rota, limit):
    """Return for how many clocks a channel has equalled its complement after a sample; they stop beyond a limit."""
    if not wrong:
        return 0
    return passed if passed > limit else passed + rota


@compiled
def _edges(state, inputs):
    """Return the channel of the last edges, and for how many samples with edges they have been of it alone."""
    if inputs.edge_a and inputs.edge_b:
        return state.channel, 0
    if not (inputs.edge_a or inputs.edge_b):
        return state.channel, state.edges
    same = inputs.edge_b == state.channel
    return inputs.edge_b, min(state.edges + 1, IDLE_EDGES) if same else 1


@compiled
def _index_is_wrong(params, state, inputs, last_index):
    """Return whether the index of a sample is neither at the last one nor a turn away."""
    if not (inputs.indexed and state.has_index) or inputs.fresh:
        return False
    distance, tolerance = (
        abs(wrap(inputs.index_count - last_index, params.count_width)),
        inputs.supervisor_index_tolerance,
    )
    return distance > tolerance and abs(distance - inputs.supervisor_turn) > tolerance


@compiled
def step(params, state, inputs, let_out):
    """Return the state after one sample.

    Args:
        params: `Params`.
        state: `START`, or the state after the last sample.
        inputs: `Inputs` of the sample.
        let_out: the `supervisor.State` after the last sample: `at_limit` and `negative` of the drive that was let out.
    """
    count, last_quarter = inputs.count, 3 << (params.count_width - 3)
    moved = 0 if inputs.fresh or inputs.shifted else wrap(count - state.last_count, params.count_width)
    last_index = wrap(state.last_index + inputs.shifted * inputs.shift, params.count_width)
    way = 0
    if let_out.at_limit and state.pressed and let_out.negative == state.negative:
        way = wrap(state.way - moved if let_out.negative else state.way + moved, params.count_width)

    samples = 0
    if inputs.saturated:
        samples = state.samples + 1 if state.samples <= inputs.supervisor_saturated else state.samples
    longest = inputs.supervisor_loss
    lost_a = _lost(inputs.lost_a, state.lost_a, params.rota, longest)
    lost_b = _lost(inputs.lost_b, state.lost_b, params.rota, longest)
    channel, edges = _edges(state, inputs)

    too_fast = abs(inputs.velocity) > inputs.supervisor_velocity_limit << params.velocity_shift
    causes = (
        int(count < inputs.supervisor_position_low or count > inputs.supervisor_position_high) << POSITION_RANGE
        | int(count >= last_quarter or count < -last_quarter) << POSITION_WRAP
        | int(too_fast) << VELOCITY_LIMIT
        | int(-way > inputs.supervisor_runaway) << RUNAWAY
        | int(samples > inputs.supervisor_saturated) << ESTIMATOR_SATURATED
        | int(lost_a > longest or lost_b > longest) << ENCODER_LOSS
        | int(_index_is_wrong(params, state, inputs, last_index)) << INDEX_SPACING
    )
    return State(
        causes=causes,
        a_channel_idle=int(edges == IDLE_EDGES),
        last_count=count,
        pressed=let_out.at_limit,
        negative=let_out.negative,
        way=way,
        samples=samples,
        lost_a=lost_a,
        lost_b=lost_b,
        channel=channel,
        edges=edges,
        has_index=int(inputs.indexed or (state.has_index and not inputs.fresh)),
        last_index=inputs.index_count if inputs.indexed else last_index,
    )
