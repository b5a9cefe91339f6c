"""An axis driven by the clock-stamped edges of its encoder: decoder and axis together, one sample at a time.

No clock is stepped: the decoder advances from edge to edge in one call. `run` takes whole records,

    record = stamped.run(Axis(spec), edge_clocks, edge_levels, samples)

and its kernel `sample` closes the loop in `hardwall.sim`. `clocked` has the same axis clock by clock.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import checks
from .axis import design
from .axis.axis import Axis, Record, step
from .encoder import quadrature
from .estimators.acceleration import keep, room_of
from .runtime.compiled import compiled, inlined

SAMPLES_MAX = 10**9
"""The most samples of a record: its arrays then take 32 GB."""


class Edges(NamedTuple):
    """Edges of an encoder: the clocks from which the pins show a new level. Functions take their number separately."""

    clocks: np.ndarray  # int64, never decreasing: the clocks at which a register at the pins first holds the new level
    levels: np.ndarray  # integers: a | b << 1


class Controller(NamedTuple):
    """Parameters of decoder and axis: integer words for the bit-accurate axis, float64 for the real algorithm."""

    decoder: quadrature.Params
    glitch_clocks: int
    invert: int
    axis: design.Params


class State(NamedTuple):
    """The states of decoder and axis after a sample, and the outputs of that sample."""

    drive: float  # force LSB
    velocity: float  # word of the estimator's format; counts a sample if the axis is floating
    force: float  # force LSB, before the output stage
    flags: int
    decoder: quadrature.State
    axis: design.State
    clock: int  # the clock to which the decoder has been advanced
    level: int  # level of the pins, a | b << 1


def room_for(edges: int) -> Edges:
    """Return `Edges` with room for that many edges, all zero."""
    return Edges(np.zeros(edges, np.int64), np.zeros(edges, np.int64))


def controller(axis: Axis, level: int) -> tuple[Controller, State]:
    """Return the parameters of an axis, and its state after reset with the pins at `level`, a | b << 1."""
    words, zero = axis.words, 0.0 if axis.floating else 0
    start = axis.design.start(axis.floating)
    params = Controller(axis.design.decoder, words["encoder_glitch_clocks"], words["encoder_invert"], axis.params)
    return params, State(start.output.drive, zero, zero, 0, quadrature.START, start, 0, level)


@inlined
def _decode(controller, decoder, level, clocks):
    inputs = quadrature.Inputs(level & 1, level >> 1, 0, controller.glitch_clocks, controller.invert)
    return quadrature.advance(controller.decoder, decoder, inputs, clocks)


@inlined
def _decoded(state, decoder, clock, level):
    """Return the state with another decoder, at another clock and with other pins."""
    return State(state.drive, state.velocity, state.force, state.flags, decoder, state.axis, clock, level)


@inlined
def sample_quietly(controller, state, strobe):
    """Take the sample at clock `strobe`, with no edge between the last sample and this one: return the state."""
    decoder = _decode(controller, state.decoder, state.level, strobe - state.clock)
    fault = quadrature.fault(decoder)
    after, velocity, force = step(controller.axis, state.axis, quadrature.seen(decoder), 0, fault, 1)
    return State(after.output.drive, velocity, force, after.flags, decoder, after, strobe, state.level)


@inlined
def _meet(controller, state, edges, n_edges, until):
    """Return (state, number of edges consumed) with the decoder at the last edge before clock `until`."""
    decoder, clock, level, taken = state.decoder, state.clock, state.level, 0
    # A clock sees registers loaded by the clocks before it: an edge at clock `until` comes later.
    while taken < n_edges and edges.clocks[taken] < until:
        if edges.clocks[taken] > clock:
            decoder = _decode(controller, decoder, level, edges.clocks[taken] - clock)
            clock = edges.clocks[taken]
        level = edges.levels[taken]
        taken += 1
    return _decoded(state, decoder, clock, level), taken


@compiled
def sample(controller, state, edges, n_edges, strobe):
    """Take the sample at clock `strobe`: return (state, number of edges consumed).

    Args:
        controller, state: what `controller` returns; later, the state of the previous call.
        edges: `Edges`.
        n_edges: the number of edges.
    """
    state, taken = _meet(controller, state, edges, n_edges, strobe)
    return sample_quietly(controller, state, strobe), taken


@compiled
def decode(controller, state, edges, n_edges, until):
    """Take no sample: return (state, number of edges consumed) with the decoder at clock `until`; see `sample`."""
    state, taken = _meet(controller, state, edges, n_edges, until)
    decoder = _decode(controller, state.decoder, state.level, until - state.clock)
    return _decoded(state, decoder, until, state.level), taken


@compiled
def _run(controller, state, timing, edges, record):
    made, force, drive, flags = record
    first = 0
    for k in range(len(flags)):
        rest = Edges(edges.clocks[first:], edges.levels[first:])
        state, taken = sample(controller, state, rest, len(rest.clocks), design.strobe_of(timing, k))
        first += taken
        keep(made, k, state.velocity, controller.axis.estimator, state.axis.estimator)
        force[k], drive[k], flags[k] = state.force, state.drive, state.flags


def run(axis: Axis, edge_clocks: ArrayLike, edge_levels: ArrayLike, samples: int, level: int = 0) -> Record:
    """Run a record of edges from reset.

    Args:
        axis: the axis.
        edge_clocks: integers, shape (edges,): numbers of the clocks, never decreasing and not negative, at which a
            register at the pins first holds the new level.
        edge_levels: integers of the same shape: the pins from then on, a | b << 1. Edges after
            the last sample have no effect.
        samples: number of samples to take, 1 to `SAMPLES_MAX`.
        level: level of the pins at reset, a | b << 1.

    Returns:
        The record, with arrays of shape (samples,).

    Raises:
        TypeError: if `axis` is not an Axis, or another argument is not an integer or integers.
        ValueError: if the shapes differ, the clocks decrease or are negative, a level is not 0 to 3, or `samples` is
            not 1 to `SAMPLES_MAX`.
    """
    if not isinstance(axis, Axis):
        raise TypeError(f"axis must be an Axis, not a value of type {type(axis).__name__}")
    edges = Edges(*checks.edges(edge_clocks, edge_levels))
    checks.check_int("samples", samples, 1, SAMPLES_MAX)
    checks.check_int("level", level, 0, 3)
    number = np.float64 if axis.floating else np.int64
    made = room_of(axis.design.estimator, (samples,), number)
    force, drive = np.zeros(samples, number), np.zeros(samples, number)
    flags = np.zeros(samples, np.int64)
    start = controller(axis, level)
    _run(*start, axis.design.timing, edges, (made, force, drive, flags))
    return Record(axis.design, made[0], force, drive, flags, *made[1:])
