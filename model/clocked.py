"""A whole axis, decoder included, clock by clock from its pins: the reference that `hardwall.hdl.axis` must equal."""

from typing import NamedTuple

import numpy as np

from . import axis, design, output, quadrature
from .compiled import compiled


class Pins(NamedTuple):
    """The inputs of the hardware at every clock, by the same names: int64 arrays.

    `drive_enable` and `clear_flags` may change only between a change of the drive and the next strobe.
    """

    encoder_a: np.ndarray
    encoder_b: np.ndarray
    encoder_z: np.ndarray
    drive_enable: np.ndarray
    preload: np.ndarray
    preload_count: np.ndarray
    index_arm: np.ndarray
    clear_flags: np.ndarray


class Outputs(NamedTuple):
    """The outputs of the hardware after every sample, once its drive has changed, by the same names: int64 arrays."""

    drive: np.ndarray
    velocity: np.ndarray
    wall_force: np.ndarray
    flags: np.ndarray
    actuated: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of this name
    illegal_count: np.ndarray
    index_count: np.ndarray
    index_latched: np.ndarray
    index_armed: np.ndarray
    stamp_a_rise: np.ndarray
    stamp_b_rise: np.ndarray
    stamp_a_fall: np.ndarray
    stamp_b_fall: np.ndarray


class State(NamedTuple):
    """The states of decoder and axis; `restart` is 1 from a preload until the next sample."""

    decoder: quadrature.State
    axis: design.State
    restart: int


@compiled
def _take(params, state, outputs, k, enable):
    """Take sample k, store its outputs, and return the axis's state."""
    fault = state.decoder.illegal | state.decoder.overspeed << 1
    outputs.actuated[k] = state.axis.output.phase == 0
    seen = quadrature.seen(state.decoder)
    now, outputs.velocity[k], outputs.wall_force[k] = axis.step(params, state.axis, seen, state.restart, fault, enable)
    outputs.drive[k], outputs.flags[k] = now.output.drive, now.flags
    return now


@compiled
def _show(outputs, k, decoder):
    """Store the decoder's outputs at the clock at which the drive of sample k has changed."""
    outputs.count[k], outputs.illegal_count[k] = decoder.count, decoder.illegal_count
    outputs.index_count[k] = decoder.index_count
    outputs.index_latched[k], outputs.index_armed[k] = decoder.index_latched, decoder.index_armed
    outputs.stamp_a_rise[k], outputs.stamp_b_rise[k] = decoder.stamp_a_rise, decoder.stamp_b_rise
    outputs.stamp_a_fall[k], outputs.stamp_b_fall[k] = decoder.stamp_a_fall, decoder.stamp_b_fall


@compiled
def run(controller, timing, state, pins, outputs, first, until):
    """Run clocks `first` to `until` (not included), fill `outputs` and return the state.

    Args:
        controller: a `stamped.Controller`.
        timing: the `timing` of the axis's `Design`.
        state: the `State` before clock `first`.
        pins: `Pins`, from clock 0 on.
        outputs: `Outputs`, from sample 0 on.
    """
    per_sample, latency = timing
    for n in range(first, until):
        now, restart, decoder = state.axis, state.restart, state.decoder
        if (n + 1) % per_sample == 0:
            now = _take(controller.axis, state, outputs, (n + 1) // per_sample - 1, pins.drive_enable[n])
            restart = 0
        elif (n + 1 - latency) % per_sample == 0 and n >= latency:
            _show(outputs, (n + 1 - latency) // per_sample - 1, decoder)
        if pins.clear_flags[n]:
            now = design.State(now.estimator, now.output, 0)
        if not pins.drive_enable[n]:
            now = design.State(now.estimator, output.State(now.output.phase, 0), now.flags)
        inputs = quadrature.Inputs(
            pins.encoder_a[n], pins.encoder_b[n], pins.encoder_z[n], controller.glitch_clocks, controller.invert
        )
        strobes = quadrature.Strobes(pins.preload[n], pins.preload_count[n], pins.index_arm[n], pins.clear_flags[n])
        state = State(quadrature.step(controller.decoder, decoder, inputs, strobes), now, restart | pins.preload[n])
    return state
