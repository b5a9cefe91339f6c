"""An axis driven by the clock-stamped edges of its encoder: decoder and axis in one, a sample at a time.

The clock is never stepped: between edges the decoder is advanced at once. `run` takes whole records,

    record = stamped.run(Axis(spec), edge_clocks, edge_levels, samples)

and `sample`, its kernel, is what closes the loop in `hardwall.sim`. Clocks are numbered from 0, the first after reset;
sample k is taken at the strobe, clock (k + 1) D - 1 with D clocks a sample.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import axis, checks, quadrature
from .compiled import compiled


class Controller(NamedTuple):
    """Parameters of decoder and axis; integer words make the bit-accurate axis, float64 ones the real algorithm."""

    decoder: quadrature.Params
    glitch_clocks: int
    invert: int
    axis: axis.Params


class State(NamedTuple):
    drive: float  # force LSB
    velocity: float  # words of the estimator's format; floating axis: counts a sample
    force: float  # force LSB, before the output stage
    flags: int
    decoder: quadrature.State
    axis: axis.State
    clock: int  # to which the decoder has been advanced
    level: int  # of the pins, a | b << 1


def controller(of: axis.Axis, level: int) -> tuple[Controller, State]:
    """Return the parameters of an axis, and its state after reset with the pins at `level`, a | b << 1."""
    design, words, zero = of.design, of.words, 0.0 if of.floating else 0
    start = design.start(of.floating)
    params = Controller(design.decoder, words["encoder_glitch_clocks"], words["encoder_invert"], of.params)
    return params, State(start.output.drive, zero, zero, 0, quadrature.START, start, 0, level)


@compiled
def _decode(controller, decoder, level, clocks):
    return quadrature.advance(
        controller.decoder, decoder, level & 1, level >> 1, 0, clocks, controller.glitch_clocks, controller.invert
    )


@compiled
def sample_quietly(controller, state, strobe):
    """Take the sample at clock `strobe`, with no edges before it: return the state."""
    decoder = _decode(controller, state.decoder, state.level, strobe - state.clock)
    fault = decoder.illegal | decoder.overspeed << 1
    after, velocity, force = axis.step(controller.axis, state.axis, quadrature.seen(decoder), 0, fault, 1)
    return State(after.output.drive, velocity, force, after.flags, decoder, after, strobe, state.level)


@compiled
def sample(controller, state, edge_clocks, edge_levels, first, until, strobe):
    """Take the sample at clock `strobe`: return (state, number of the first edge not yet taken).

    Args:
        controller, state: of `controller`.
        edge_clocks, edge_levels: integer arrays: from which clock on, never decreasing, the pins show which level.
        first, until: the edges to take from them.
    """
    decoder, clock, level, taken = state.decoder, state.clock, state.level, first
    # The strobe sees registers loaded by the clocks before it: an edge at the strobe's own clock is for the next.
    while taken < until and edge_clocks[taken] < strobe:
        if edge_clocks[taken] > clock:
            decoder = _decode(controller, decoder, level, edge_clocks[taken] - clock)
            clock = edge_clocks[taken]
        level = edge_levels[taken]
        taken += 1
    state = State(state.drive, state.velocity, state.force, state.flags, decoder, state.axis, clock, level)
    return sample_quietly(controller, state, strobe), taken


@compiled
def _run(controller, state, clocks_per_sample, edge_clocks, edge_levels, velocity, force, drive, flags):
    first = 0
    for k in range(len(velocity)):
        strobe = (k + 1) * clocks_per_sample - 1
        state, first = sample(controller, state, edge_clocks, edge_levels, first, len(edge_clocks), strobe)
        velocity[k], force[k], drive[k], flags[k] = state.velocity, state.force, state.drive, state.flags


def run(of: axis.Axis, edge_clocks: ArrayLike, edge_levels: ArrayLike, samples: int, level: int = 0) -> axis.Record:
    """Run a record of edges from reset.

    Args:
        of: the axis.
        edge_clocks: integers, shape (edges,): numbers of the clocks, never decreasing and not negative, at which a
            register at the pins first holds the new level.
        edge_levels: integers of the same shape: the pins from then on, a | b << 1.
        samples: how many to take, 1 or more.
        level: of the pins at reset.

    Returns:
        The record, arrays of shape (samples,).

    Raises:
        TypeError: if `of` is not an Axis, or one of the others not an integer or integers.
        ValueError: if the shapes differ, the clocks decrease or are negative, a level is not 0 to 3, or there are no
            samples to take.
    """
    if not isinstance(of, axis.Axis):
        raise TypeError(f"of must be an Axis, not {of!r}")
    edges = checks.edges(edge_clocks, edge_levels)
    checks.check_int("samples", samples, 1)
    checks.check_int("level", level, 0, 3)
    number = np.float64 if of.floating else np.int64
    velocity, force, drive = (np.zeros(samples, number) for _ in range(3))
    flags = np.zeros(samples, np.int64)
    start = controller(of, level)
    _run(*start, of.design.spec.clocks_per_sample, *edges, velocity, force, drive, flags)
    return axis.Record(of.design, velocity, force, drive, flags)
