"""Playback of a known motion through an axis on any backend: velocities in chunks, without a plant or a wall.

The edges are placed so that the count at the strobe of sample k is exactly the count of the position at time k /
sample_hz. The decoder's latency is left out, because it is the same for every estimator. A stamp is the clock in which
its edge was decoded. The pins have no glitches except wanted ones, and `accuracy.axis_spec` has no filter.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from ...model.axis.design import change_of, strobe_of
from ...model.encoder import scale_map
from ...model.estimators.acceleration import Motions, Velocities, room_of
from ...model.record_axis import DECODER_CLOCKS
from ...model.runtime.compiled import compiled, inlined
from ...model.spec import AxisSpec
from ...model.stamped import Edges
from ...model.velocity_estimator import units_of
from ..loop.backends import is_exact, number_of, opened
from ..loop.controllers import sample, sample_quietly
from ..world.encoder import Encoder
from ..world.lines import Lines
from ..world.scale import Scale
from .motions import Encoded, encoded
from .outputs import scaled, write
from .signals import Signal

CHUNK = 1 << 18

Offsets = tuple[float, float, float, float]
"""The errors of the four kinds of edges, in counts, from `sim.world.encoder.offsets`."""


@inlined
def take(controller, state, timing, edges, taken, k):
    """Take sample k of a record of edges, after `taken` edges; return (state, number of edges taken)."""
    strobe, remaining = strobe_of(timing, k), len(edges.clocks) - taken
    if remaining > 0 and edges.clocks[taken] < change_of(timing, k):
        rest = Edges(edges.clocks[taken:], edges.levels[taken:])
        state, some = sample(controller, state, rest, remaining, strobe)
        return state, taken + some
    return sample_quietly(controller, state, strobe), taken


@compiled
def take_all(controller, state, timing, edges, taken, first, made):
    """Fill `made`, `Velocities` or `Motions`, with the samples from `first` on; return (state, edges taken)."""
    for i in range(len(made.velocity)):
        state, taken = take(controller, state, timing, edges, taken, first + i)
        write(made, i, controller, state)
    return state, taken


def encoded_signal(
    signal: Signal, spec: AxisSpec, offsets: Offsets, scale: Scale | None = None, lines: Lines | None = None
) -> Encoded:
    """Return the edges of a signal at the pins of an axis, from an encoder with these errors: see `Encoder`."""
    encoder = Encoder(spec.count_m, float(spec.clock_hz), offsets, scale, lines)
    lead = spec.clocks_per_sample - 1 - DECODER_CLOCKS
    return encoded(signal.motion, encoder, signal.seconds, signal.turns_apart_s, lead)


def outputs(
    signal: Signal,
    spec: AxisSpec,
    output: str,
    backend: str,
    offsets: Offsets,
    scale: Scale | None = None,
    lines: Lines | None = None,
    learned: scale_map.Params | None = None,
) -> Iterator[tuple[int, Velocities | Motions, int]]:
    """Yield the chunks of a signal, each as (first sample, outputs in m/s and m/s^2, sticky flags).

    Args:
        signal: the motion and its duration.
        spec: specification of the axis.
        output: the estimator's output.
        backend: one of `backends.BACKENDS`.
        offsets, scale, lines: errors of the encoder: see `sim.world.encoder.Encoder`.
        learned: the map of the scale that the estimator has, on `float` or `fixed`.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    passed, parameters = encoded_signal(signal, spec, offsets, scale, lines), spec.design.estimator.choose(output)
    units = units_of(spec.design.estimator, not is_exact(backend), spec.count_m, spec.sample_hz)
    samples, taken = int(signal.seconds * spec.sample_hz), 0
    with opened(spec, backend, parameters, passed.start_level, scale=learned) as axis:
        state = axis.state
        for first in range(0, samples, CHUNK):
            some = min(CHUNK, samples - first)
            made = room_of(spec.design.estimator, (some,), number_of(backend))
            state, taken = take_all(axis.controller, state, spec.design.timing, passed.edges, taken, first, made)
            yield first, scaled(made, units), int(state.flags)


def velocities(*how: Any, **more: Any) -> Iterator[tuple[int, np.ndarray, int]]:
    """Yield the chunks of a signal, each as (first sample, velocities in m/s, sticky flags): see `outputs`."""
    for first, made, flags in outputs(*how, **more):
        yield first, made.velocity, flags
