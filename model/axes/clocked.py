"""One of several axes, decoder included, clock by clock from its pins: the reference of `hardwall.hdl.axes.axis`."""

from typing import NamedTuple

import numpy as np

from ..axis import design, output, wall
from ..encoder import quadrature
from ..estimators.estimate import estimate
from ..runtime.compiled import compiled
from . import axis as axes


class Samples(NamedTuple):
    """The outputs for every sample of an axis: int64 arrays. The record of a sample has the first six."""

    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of this name
    velocity: np.ndarray
    wall_force: np.ndarray
    drive: np.ndarray
    flags: np.ndarray
    actuated: np.ndarray
    fault: np.ndarray  # the encoder's two flags
    raised: np.ndarray  # the flags that it raised, without those of the output stage
    force_limit: np.ndarray  # words of the output stage
    slew_limit: np.ndarray


class Outputs(NamedTuple):
    """The outputs of one axis at every clock, by the names of the hardware's: int64 arrays. All have one `stamp`."""

    drive: np.ndarray
    flags: np.ndarray
    sampled: np.ndarray
    actuated: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of this name
    stepped: np.ndarray
    edge_kind: np.ndarray
    edge_down: np.ndarray
    indexed: np.ndarray
    stamp: np.ndarray
    index_count: np.ndarray
    index_armed: np.ndarray
    index_latched: np.ndarray
    referenced: np.ndarray
    illegal: np.ndarray
    overspeed: np.ndarray
    wrapped: np.ndarray
    illegal_count: np.ndarray


class State(NamedTuple):
    """The state of an axis.

    `restart` is 1 from a preload or a shift of the origin until the next sample. `allowed` is 1 while the force in the
    output stage may become the drive.
    """

    decoder: quadrature.State
    estimator: tuple
    output: output.State
    flags: int
    restart: int
    allowed: int
    sampled: int
    actuated: int


def start(made: design.Design) -> State:
    """Return the state after reset, for one run only."""
    return State(quadrature.START, made.start().estimator, output.START, 0, 0, 0, 0, 0)


@compiled
def _show(outputs, n, state):
    decoder = state.decoder
    outputs.drive[n], outputs.flags[n] = state.output.drive, state.flags
    outputs.sampled[n], outputs.actuated[n] = state.sampled, state.actuated
    outputs.count[n], outputs.stepped[n], outputs.edge_kind[n] = decoder.count, decoder.stepped, decoder.edge
    outputs.stamp[n], outputs.indexed[n], outputs.index_count[n] = decoder.stamp, decoder.indexed, decoder.index_count
    outputs.index_armed[n], outputs.index_latched[n] = decoder.index_armed, decoder.index_latched
    outputs.referenced[n], outputs.edge_down[n] = decoder.referenced, decoder.down
    outputs.illegal[n], outputs.overspeed[n], outputs.wrapped[n] = decoder.illegal, decoder.overspeed, decoder.wrapped
    outputs.illegal_count[n] = decoder.illegal_count


@compiled
def _take(params, state, samples, k):
    """Take sample k and return the estimator's state; the rest of the pipeline takes its words along."""
    seen, fault = quadrature.seen(state.decoder), quadrature.fault(state.decoder)
    estimator, velocity, raised = estimate(params.estimator, state.estimator, seen, state.restart)
    samples.count[k], samples.velocity[k], samples.fault[k] = seen.count, velocity, fault
    samples.wall_force[k] = wall.render(params.wall, seen.count, velocity)
    samples.raised[k] = fault | raised << params.estimator_bit
    samples.force_limit[k], samples.slew_limit[k] = params.output.force_limit, params.output.slew_limit
    return estimator


@compiled
def _drive(params, state, samples, k, clear):
    """End sample k: return the state of the output stage and the flags."""
    words = output.Params(samples.force_limit[k], samples.slew_limit[k], params.output.decimation)
    driven, limited = output.step(words, state.output, samples.wall_force[k], state.allowed)
    flags = (0 if clear else state.flags) | samples.raised[k] | limited << params.output_bit
    samples.flags[k], samples.actuated[k] = flags, state.output.phase == 0
    return driven, flags


@compiled
def run(controller, timing, state, pins, samples, outputs, first, until):
    """Run clocks `first` to `until` (not included), fill `samples` and `outputs`, and return the state.

    Args:
        controller: a `stamped.Controller`.
        timing: the `axes.Timing` of the axis.
        state: the `State` before clock `first`.
        pins: `clocked.Pins` of the axis, from clock 0 on; here all of them may change at any clock.
        samples: `Samples`, from sample 0 on.
        outputs: `Outputs`, from clock 0 on.
    """
    per_sample, strobe, latency = timing
    forced, ended = strobe + latency - axes.OUTPUT_LATENCY, strobe + latency - 1
    for n in range(first, until):
        _show(outputs, n, state)
        estimator, restart, allowed, driven = state.estimator, state.restart, state.allowed, state.output
        clear = pins.clear_flags[n]
        flags, sampled, actuated = 0 if clear else state.flags, 0, 0
        if n >= strobe and (n - strobe) % per_sample == 0:
            estimator, restart = _take(controller.axis, state, samples, (n - strobe) // per_sample), 0
        if n >= forced and (n - forced) % per_sample == 0:
            allowed = samples.fault[(n - forced) // per_sample] == 0
        if n >= ended and (n - ended) % per_sample == 0:
            k = (n - ended) // per_sample
            driven, flags = _drive(controller.axis, state, samples, k, clear)
            sampled, actuated = 1, samples.actuated[k]
        if not pins.drive_enable[n]:
            driven, allowed = output.State(driven.phase, 0), 0
        if sampled:
            samples.drive[(n - ended) // per_sample] = driven.drive
        inputs = quadrature.Inputs(
            pins.encoder_a[n], pins.encoder_b[n], pins.encoder_z[n], controller.glitch_clocks, controller.invert
        )
        shift = pins.origin_shift[n]
        strobes = quadrature.Strobes(
            pins.preload[n], pins.preload_count[n], pins.index_arm[n], clear, shift, pins.slip[n]
        )
        decoder = quadrature.step(controller.decoder, state.decoder, inputs, strobes)
        restart |= pins.preload[n] | shift
        state = State(decoder, estimator, driven, flags, restart, int(allowed), sampled, int(actuated))
    return state
