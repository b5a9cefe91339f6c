"""The Pico's sub-step encoder: the speed between the last edges of two readings, bounded by the cell.

A reading has the cell of the encoder, and the stamp t and direction of its last edge. An edge is at a known place x of
the scale, which a calibration can give for each of the four kinds. In counts and seconds:

    cell changed:  v = (x - x') / (t - t')     x', t' of the last edge of the last reading with a change
    then:          v is held within the speeds that lead from x at t to the ends of the cell now

If the edge is nearer to now than to the last reading, the other side bounds v: by the speeds that lead to x at t from
the ends of the cell at the last reading.

At rest the bounds bring v towards 0. From the third reading without a change on (`IDLE_READINGS`) v is 0. After that
the first change gives no time between edges: v is then 0, or what the bounds allow next to 0.

It uses the cell and the stamp of the last edge. Usual: 100 readings a second, and places without calibration.

Source: the example `quadrature_encoder_substep` of raspberrypi/pico-examples, and the library PicoEncoder
(pmarques-dev/PicoEncoder) of the same method.
"""

from typing import NamedTuple

from ....model.runtime.compiled import compiled
from .rival import edge, read, start

IDLE_READINGS = 3
UNIFORM = 0.0, 0.0, 0.0, 0.0


class Substep(NamedTuple):
    """The estimator of the Pico; `offsets` says how far the four kinds of edges are off their places, in counts."""

    offsets: tuple[float, float, float, float]


class Transition(NamedTuple):
    """The last edge, the last reading, and the edge that the last change was reckoned from."""

    number: int
    edge_s: float
    upwards: bool
    read_number: int
    read_s: float
    place: float
    place_s: float
    idle: int
    stopped: bool
    velocity: float


@compiled
def _place(rival, number):
    """Return the place of an edge, in counts: edge n is the lower end of cell n."""
    return number + rival.offsets[number & 3]


@start.register(Substep)
@compiled
def _start(rival, number):
    return Transition(number, 0.0, True, number, 0.0, _place(rival, number), 0.0, 0, True, 0.0)


@edge.register(Substep)
@compiled
def _edge(rival, state, time_s, number):
    return Transition(
        number,
        time_s,
        number > state.number,
        state.read_number,
        state.read_s,
        state.place,
        state.place_s,
        state.idle,
        state.stopped,
        state.velocity,
    )


@compiled
def _bounded(rival, state, place, place_s, time_s, velocity):
    """Return a velocity within the speeds that the cells now and at the last reading allow."""
    before_s, after_s = place_s - state.read_s, time_s - place_s
    if before_s > 0 and before_s > after_s:
        high = (place - _place(rival, state.read_number)) / before_s
        low = (place - _place(rival, state.read_number + 1)) / before_s
    else:
        high = (_place(rival, state.number + 1) - place) / after_s
        low = (_place(rival, state.number) - place) / after_s
    return max(min(velocity, high), low)


@read.register(Substep)
@compiled
def _read(rival, state, time_s):
    changed = state.number != state.read_number
    idle = 0 if changed else state.idle + 1
    stopped = state.stopped or idle >= IDLE_READINGS
    velocity = 0.0 if stopped else state.velocity
    place, place_s = state.place, state.place_s
    if changed:
        place, place_s = _place(rival, state.number if state.upwards else state.number + 1), state.edge_s
        if not stopped:
            velocity = (place - state.place) / (place_s - state.place_s)
        stopped = False
    if not stopped:
        velocity = _bounded(rival, state, place, place_s, time_s, velocity)
    number, edge_s, upwards = state.number, state.edge_s, state.upwards
    return (
        Transition(number, edge_s, upwards, number, time_s, place, place_s, idle, stopped, velocity),
        velocity,
    )
