"""A whole axis, decoder included, clock by clock from its pins: the reference of `hardwall.hdl.axis.axis`."""

from typing import NamedTuple

import numpy as np

from ..encoder import quadrature
from ..estimators.acceleration import keep
from ..estimators.estimate import estimate
from ..runtime.compiled import compiled
from . import design, output, passivity, virtual_mass, wall


class Pins(NamedTuple):
    """The inputs of the hardware at every clock, by the same names: int64 arrays.

    `drive_enable` and `clear_flags` may change only between a change of the drive and the next velocity.
    """

    encoder_a: np.ndarray
    encoder_b: np.ndarray
    encoder_z: np.ndarray
    drive_enable: np.ndarray
    preload: np.ndarray
    preload_count: np.ndarray
    index_arm: np.ndarray
    clear_flags: np.ndarray
    origin_shift: np.ndarray
    slip: np.ndarray


class Outputs(NamedTuple):
    """The outputs of the hardware after every sample, once its drive has changed, by the same names: int64 arrays.

    The outputs of the estimator have their own room, of `acceleration.room_of`.
    """

    drive: np.ndarray
    wall_force: np.ndarray
    flags: np.ndarray
    actuated: np.ndarray
    count: np.ndarray  # type: ignore[assignment]  # a tuple has a method of this name
    illegal_count: np.ndarray
    index_count: np.ndarray
    index_latched: np.ndarray
    index_armed: np.ndarray
    referenced: np.ndarray
    stamp_a_rise: np.ndarray
    stamp_b_rise: np.ndarray
    stamp_a_fall: np.ndarray
    stamp_b_fall: np.ndarray


class UnderWay(NamedTuple):
    """A sample between its strobe and its changed drive; its words are kept so long."""

    sampled_count: int
    restart: int
    velocity: int
    force: int  # behind the virtual mass
    enable: int  # no fault was taken with it
    flags: int
    params: design.Params


class State(NamedTuple):
    """The states of decoder and axis, and the samples under way; of two samples, `older` came first."""

    decoder: quadrature.State
    axis: design.State  # the estimator's after the last strobe; the others' after the last changed drive
    restart: int  # 1 from a preload or a shift of the origin until the next sample
    older: UnderWay
    newer: UnderWay


def start(axis: design.Design) -> State:
    """Return the state after reset."""
    nothing = UnderWay(0, 0, 0, 0, 0, 0, axis.params(axis.encode()))
    return State(quadrature.START, axis.start(), 0, nothing, nothing)


@compiled
def _take(params, state, outputs, made, k):
    """Take sample k: return (the estimator's state, the sample under way), and store what is known of it."""
    seen = quadrature.seen(state.decoder)
    estimator, velocity, raised = estimate(params.estimator, state.axis.estimator, seen, state.restart)
    force = wall.render(params.wall, seen.count, velocity)
    borne = virtual_mass.borne(params.mass, params.wall, params.estimator, estimator, seen.count, force)
    fault = quadrature.fault(state.decoder)
    keep(made, k, velocity, params.estimator, estimator)
    outputs.wall_force[k] = force
    flags = fault | raised << params.estimator_bit
    return estimator, UnderWay(seen.count, state.restart, velocity, borne, int(fault == 0), flags, params)


@compiled
def _drive(now, outputs, k, sample, enable):
    """Let the drive follow sample k: store what it comes to, and return the axis's state."""
    params = sample.params
    outputs.actuated[k] = now.output.phase == 0
    observed, given, acted = passivity.step(
        params.passivity,
        now.passivity,
        sample.sampled_count,
        sample.restart,
        sample.velocity,
        sample.force,
        now.output.drive,
    )
    driven, limited = output.step(params.output, now.output, given, enable and sample.enable)
    flags = now.flags | sample.flags | limited << params.output_bit | acted << params.passivity_bit
    outputs.drive[k], outputs.flags[k] = driven.drive, flags
    return design.State(now.estimator, observed, driven, flags)


@compiled
def _show(outputs, k, decoder):
    """Store the decoder's outputs at the clock at which the drive of sample k has changed."""
    outputs.count[k], outputs.illegal_count[k] = decoder.count, decoder.illegal_count
    outputs.index_count[k] = decoder.index_count
    outputs.index_latched[k], outputs.index_armed[k] = decoder.index_latched, decoder.index_armed
    outputs.referenced[k] = decoder.referenced
    outputs.stamp_a_rise[k], outputs.stamp_b_rise[k] = decoder.stamp_a_rise, decoder.stamp_b_rise
    outputs.stamp_a_fall[k], outputs.stamp_b_fall[k] = decoder.stamp_a_fall, decoder.stamp_b_fall


@compiled
def run(controller, timing, state, pins, outputs, made, first, until):
    """Run clocks `first` to `until` (not included), fill `outputs` and `made` and return the state.

    Args:
        controller: a `stamped.Controller`.
        timing: the `timing` of the axis's `Design`.
        state: the `State` before clock `first`.
        pins: `Pins`, from clock 0 on.
        outputs, made: `Outputs`, and the room for what the estimator gives, from sample 0 on.
    """
    per_sample, latency = timing.clocks_per_sample, timing.latency
    overlap = design.overlap_of(timing)
    for n in range(first, until):
        now, restart, older, newer = state.axis, state.restart, state.older, state.newer
        if (n + 1) % per_sample == 0:
            estimator, sample = _take(controller.axis, state, outputs, made, (n + 1) // per_sample - 1)
            now = design.State(estimator, now.passivity, now.output, now.flags)
            restart, older, newer = 0, newer, sample
        # The strobes whose drive has changed before this edge, and behind it.
        before, behind = n - latency, n + 1 - latency
        if before >= 0 and (before + 1) % per_sample == 0:
            _show(outputs, (before + 1) // per_sample - 1, state.decoder)
        if behind >= 0 and (behind + 1) % per_sample == 0:
            sample = older if overlap else newer
            now = _drive(now, outputs, (behind + 1) // per_sample - 1, sample, pins.drive_enable[n])
        if pins.clear_flags[n]:
            now = design.State(now.estimator, now.passivity, now.output, 0)
        if not pins.drive_enable[n]:
            released = output.State(now.output.phase, 0)
            now = design.State(now.estimator, now.passivity, released, now.flags)
        inputs = quadrature.Inputs(
            pins.encoder_a[n], pins.encoder_b[n], pins.encoder_z[n], controller.glitch_clocks, controller.invert
        )
        shift = pins.origin_shift[n]
        strobes = quadrature.Strobes(
            pins.preload[n], pins.preload_count[n], pins.index_arm[n], pins.clear_flags[n], shift, pins.slip[n]
        )
        decoder = quadrature.step(controller.decoder, state.decoder, inputs, strobes)
        state = State(decoder, now, restart | pins.preload[n] | shift, older, newer)
    return state
