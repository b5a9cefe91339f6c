"""Monitors: what is wrong with an axis, seen from its signals; twin of `hardwall.hdl.axis.monitors`.

One `step` is one clock. Every monitor gives one bit of `supervisor.CAUSES`, or the warning; thresholds are run-time
words whose values after reset follow from the axis:

    position_range        the count is below supervisor_position_low or above supervisor_position_high, which lie at
                          twice the travel on either side: a handle anywhere in its travel, whatever its origin, is
                          within
    position_wrap         the count is in the last quarter of its range on either side, three times the travel away
    velocity_limit        |velocity| > supervisor_velocity_limit, after reset one and a half times the largest speed.
                          The largest word is less than the estimate of the fastest handle, so that each can trip
    runaway               the handle has moved against a drive at its limit by more than supervisor_runaway since the
                          drive came to the limit, after reset by a tenth of the travel: a wall that works turns the
                          handle back, and with a reversed polarity it drives the handle in. A hand that pushes
                          through the wall does the same. The limit is what the supervisor lets out, while it rises
                          after arming too; a host that raises it does not begin the way anew, unless the drive is then
                          really below it.
    estimator_saturated   more than supervisor_saturated samples in a row, after reset those of 10 ms
    encoder_loss          a channel equals its complement for more than supervisor_loss clocks, after reset one more
                          than the glitch filter passes over
    index_spacing         two indexes are no turn apart: the distance is neither 0 nor a turn, within
                          supervisor_index_tolerance counts. The decoder says where an index is
    a_channel_idle        a warning, no cause: a hundred edges in a row were of one channel. A handle that dithers on
                          one edge does that too, so no more is promised for a dead channel without its complement.
"""

from typing import NamedTuple

from ..arithmetic.fixed import SQ, UQ, wrap
from ..estimators.estimate import EstimatorDesign
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from .supervisor import CAUSES

BITS = {cause.name: bit for bit, cause in enumerate(CAUSES)}
POSITION_RANGE, POSITION_WRAP = BITS["position_range"], BITS["position_wrap"]
VELOCITY_LIMIT, RUNAWAY = BITS["velocity_limit"], BITS["runaway"]
ESTIMATOR_SATURATED, ENCODER_LOSS = BITS["estimator_saturated"], BITS["encoder_loss"]
INDEX_SPACING = BITS["index_spacing"]
MADE = (
    "encoder_loss", "index_spacing", "position_range", "position_wrap", "velocity_limit", "runaway",
    "estimator_saturated",
)  # fmt: skip
"""The causes that are made here; the others come from the decoder, the axis, the pins and the host."""
CLOCKS = {"position_range": 2, "runaway": 2, "estimator_saturated": 2, "index_spacing": 2}
"""Clocks of the causes that take more than one: their limits or counters are compared in turn."""
SATURATED_S = 0.01
IDLE_EDGES = 100
"""Edges of one channel in a row that raise the warning: so many reversals on one edge are dither, or a dead channel."""
LOSS_BITS = 8
REGISTER_BITS = 31
INDEX_TOLERANCE = 1
"""Counts that an index may be away from its place, after reset.

The decoder takes one edge of Z from both sides. Where that edge lies on an edge of A or B it may be seen a clock before
or after it: its place is then either of two counts. The same holds for a handle that passes both within a clock.
"""


class Params(NamedTuple):
    """The count's width, and the bits that the word of the velocity's limit lacks below the velocity's."""

    count_width: int
    velocity_shift: int


class Inputs(NamedTuple):
    """The inputs of the hardware just before a clock edge, by the same names."""

    count: int = 0  # type: ignore[assignment]  # a tuple has a method of this name
    stepped: int = 0
    edge_kind: int = 0
    edge_down: int = 0
    indexed: int = 0
    valid: int = 0
    velocity: int = 0
    saturated: int = 0
    at_limit: int = 0
    negative: int = 0
    a: int = 0
    a_n: int = 1
    b: int = 0
    b_n: int = 1
    supervisor_position_low: int = 0
    supervisor_position_high: int = 0
    supervisor_velocity_limit: int = 0
    supervisor_runaway: int = 0
    supervisor_saturated: int = 0
    supervisor_loss: int = 0
    supervisor_turn: int = 0
    supervisor_index_tolerance: int = 0


class State(NamedTuple):
    """Every register; the first two are the outputs of the hardware, by the same names."""

    causes: int
    a_channel_idle: int
    at_low: int  # the limit that the next clock compares is supervisor_position_low
    limit: int  # that limit
    wrong: int  # the count was beyond the limit of the last clock
    pressed: int  # the drive was at its limit
    negative: int  # it was negative
    way: int  # counts that the handle has moved since then, against the drive: negative
    samples: int  # successive samples with a saturated estimate
    lost_a: int  # clocks for which a channel has equalled its complement
    lost_b: int
    channel: int  # channel of the last edge, 1: B
    edges: int  # edges in a row of that channel
    has_index: int
    distance: int  # counts from the last index, to either side: negative
    upwards: int  # the side, 1: the count has grown
    away: int  # an index was not at the last one
    beyond: int  # a turn, less its distance


START = State(*(0 for _ in State._fields))._replace(at_low=1, limit=-1)


def latency(cause: str) -> int:
    """Return the most clocks from inputs that are wrong to the cause of a name."""
    return CLOCKS.get(cause, 1)


class Design:
    """Formats and run-time words of an axis's monitors.

    Args:
        axis: the axis.
        estimator: its estimator.
        edges: the most counts between two looks at the way: a rota's, for one of several axes.
    """

    def __init__(self, axis: AxisRequirements, estimator: EstimatorDesign, edges: int = 1):
        self.count_width, self.velocity = axis.count_width, (velocity := estimator.velocity)
        # The word has as many bits as a host's register holds without its sign.
        self.params = Params(axis.count_width, max(velocity.width - 1 - REGISTER_BITS, 0))
        count, distance = SQ(axis.count_width, 0), UQ(axis.count_width - 1, 0)
        speed = UQ(velocity.i - 1, velocity.f - self.params.velocity_shift)
        reach = min(int(2 * axis.travel_m / axis.count_m), count.max)
        # A finite difference knows nothing below one count a sample.
        fastest = int(max(1.5 * axis.speed_max_counts_per_sample, 2.0) * 2**speed.f)
        # A limit that no estimate exceeds is none.
        most = (estimator.fastest - 1) >> self.params.velocity_shift
        samples = max(int(SATURATED_S * axis.sample_hz), 1)
        # A way is as wide as the count: beyond the longest one it has room for what one look adds.
        runaway = max(min(reach // 20, distance.max), 1)
        longest = None if edges == 1 else max(distance.max + 1 - edges, runaway)
        self.words = (
            Word("supervisor_position_low", count, axis.count_m, "m", -reach, "least position while ARMED"),
            Word("supervisor_position_high", count, axis.count_m, "m", reach, "largest position while ARMED"),
            Word(
                "supervisor_velocity_limit", speed, axis.velocity_unit_m_per_s, "m/s", min(fastest, most),
                "largest estimated speed while ARMED", 0, most,
            ),
            Word(
                "supervisor_runaway", distance, axis.count_m, "m", runaway,
                "longest way against a drive at its limit", most=longest,
            ),
            Word(
                "supervisor_saturated", UQ(samples.bit_length() + 3, 0), 1 / axis.sample_hz, "s", samples,
                "longest time of a saturated estimate",
            ),
            Word(
                "supervisor_loss", UQ(LOSS_BITS, 0), 1 / axis.clock_hz, "s", axis.glitch_clocks_at_reset + 2,
                "longest time for which a channel may equal its complement",
            ),
            Word("supervisor_turn", distance, 1.0, "", distance.max, "counts from index to index"),
            Word(
                "supervisor_index_tolerance", UQ(LOSS_BITS, 0), 1.0, "", INDEX_TOLERANCE,
                "counts that an index may be away from its place",
            ),
        )  # fmt: skip


@compiled
def _lost(wrong, passed, limit):
    """Return for how many clocks a channel has equalled its complement after a clock edge; they stop at a limit."""
    if not wrong:
        return 0
    return passed + 1 if passed < limit else passed


@compiled
def _samples(state, inputs):
    """Return the successive samples with a saturated estimate after a clock edge; they stop beyond a limit."""
    if not inputs.valid:
        return state.samples
    if not inputs.saturated:
        return 0
    return state.samples + 1 if state.samples <= inputs.supervisor_saturated else state.samples


@compiled
def _ways(params, state, inputs):
    """Return the way against the drive, and the distance and side from the last index, after a clock edge."""
    up = 1 - inputs.edge_down
    way, distance, upwards = state.way, state.distance, state.upwards
    if not (inputs.at_limit and state.pressed and inputs.negative == state.negative):
        way = 0
    elif inputs.stepped:
        way = wrap(way - 1 if up == inputs.negative else way + 1, params.count_width)
    # An edge that finds an index is one count beyond it.
    if inputs.stepped:
        distance = 0 if inputs.indexed else distance
        if distance == 0 or up == upwards:
            distance, upwards = wrap(distance - 1, params.count_width), up
        else:
            distance = wrap(distance + 1, params.count_width)
    return way, distance, upwards


@compiled
def step(params, state, inputs):
    """Return the state after one clock edge.

    Args:
        params: the `params` of a `Design`.
        state: `START`, or the state after the last edge.
        inputs: `Inputs` just before the edge.
    """
    count, last_quarter = inputs.count, 3 << (params.count_width - 3)
    if state.at_low:
        wrong, limit = count < state.limit, inputs.supervisor_position_high
    else:
        wrong, limit = count > state.limit, inputs.supervisor_position_low
    way, distance, upwards = _ways(params, state, inputs)

    wrong_a, wrong_b, longest = inputs.a == inputs.a_n, inputs.b == inputs.b_n, inputs.supervisor_loss
    is_lost = (wrong_a and state.lost_a >= longest) or (wrong_b and state.lost_b >= longest)

    channel, edges = state.channel, state.edges
    if inputs.stepped:
        channel = inputs.edge_kind & 1
        edges = min(edges + 1, IDLE_EDGES) if channel == state.channel else 1

    near = -inputs.supervisor_index_tolerance <= state.distance <= 0
    away = int(inputs.indexed and state.has_index and not near)
    too_fast = inputs.valid and abs(inputs.velocity) > inputs.supervisor_velocity_limit << params.velocity_shift
    causes = (
        int(wrong or state.wrong) << POSITION_RANGE
        | int(count >= last_quarter or count < -last_quarter) << POSITION_WRAP
        | int(too_fast) << VELOCITY_LIMIT
        | int(-state.way > inputs.supervisor_runaway) << RUNAWAY
        | int(state.samples > inputs.supervisor_saturated) << ESTIMATOR_SATURATED
        | int(is_lost) << ENCODER_LOSS
        | int(state.away and abs(state.beyond) > inputs.supervisor_index_tolerance) << INDEX_SPACING
    )
    return State(
        causes=causes,
        a_channel_idle=int(edges == IDLE_EDGES),
        at_low=state.at_low ^ 1,
        limit=limit,
        wrong=int(wrong),
        pressed=inputs.at_limit,
        negative=inputs.negative,
        way=way,
        samples=_samples(state, inputs),
        lost_a=_lost(wrong_a, state.lost_a, longest),
        lost_b=_lost(wrong_b, state.lost_b, longest),
        channel=channel,
        edges=edges,
        has_index=state.has_index | inputs.indexed,
        distance=distance,
        upwards=upwards,
        away=away,
        beyond=inputs.supervisor_turn + state.distance,
    )
