"""A known motion through an axis on any backend: velocities at every sample, in chunks, with no plant and no wall.

The edges are placed such that the count at the strobe of sample k is the position at time k / sample_hz, exactly: the
decoder's latency is left out, as it is the same for every estimator. A stamp is the clock that decoded its edge.
"""

from collections.abc import Iterator
from contextlib import nullcontext

import numpy as np

from ...model import quadrature, stamped
from ...model.axis import Axis
from ...model.compiled import compiled
from ...model.spec import AxisSpec
from ..loop.controllers import sample, sample_quietly
from ..world.encoder import Encoder
from .motions import Edges, edges
from .signals import Signal

CHUNK = 1 << 18
DECODER_CLOCKS = quadrature.latency(glitch_clocks=0)


@compiled
def _take(controller, state, edge_clocks, edge_levels, taken, clocks_per_sample, latency, first, velocity):
    """Take samples from `first` on, as many as `velocity` holds, and fill it; return (state, edges taken)."""
    for i in range(len(velocity)):
        strobe = (first + i + 1) * clocks_per_sample - 1
        until = strobe + latency
        left = len(edge_clocks) - taken
        if left > 0 and edge_clocks[taken] < until:
            state, some = sample(controller, state, edge_clocks[taken:], edge_levels[taken:], left, strobe, until)
            taken += some
        else:
            state = sample_quietly(controller, state, strobe, until)
        velocity[i] = state.velocity
    return state, taken


def edges_of(signal: Signal, spec: AxisSpec, offsets: tuple[float, float, float, float]) -> Edges:
    """Return the edges of a signal as the pins of an axis get them, from an encoder with these errors (counts)."""
    encoder = Encoder(spec.count_m, float(spec.clock_hz), offsets)
    lead = spec.clocks_per_sample - 1 - DECODER_CLOCKS
    return edges(signal.motion, encoder, signal.seconds, signal.turns_apart_s, lead)


def velocities(
    signal: Signal, spec: AxisSpec, output: str, backend: str, offsets: tuple[float, float, float, float]
) -> Iterator[tuple[int, np.ndarray, int]]:
    """Yield (first sample, velocities in m/s, sticky flags) of chunk after chunk of a signal.

    Args:
        signal: the motion.
        spec: the axis.
        output: the estimator's output.
        backend: `float`, `fixed` or `rtl`.
        offsets: errors of the encoder, counts: `sim.world.encoder.offsets`.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    passed = edges_of(signal, spec, offsets)
    axis = Axis(spec, floating=backend == "float", **spec.design.estimator.choose(output))
    controller, state = stamped.controller(axis, passed.start_level)
    hardware = nullcontext()
    if backend == "rtl":
        from ..rtl.library import (  # noqa: PLC0415  (the other backends need neither Amaranth nor a C++ compiler)
            Hardware,
        )

        hardware = Hardware(spec, axis.words, passed.start_level)
    unit = spec.velocity_unit_m_per_s * (1.0 if backend == "float" else spec.design.estimator.velocity.lsb)
    number = np.float64 if backend == "float" else np.int64
    samples, taken = int(signal.seconds * spec.sample_hz), 0
    with hardware:
        if backend == "rtl":
            controller, state = hardware.controller, hardware.start
        for first in range(0, samples, CHUNK):
            velocity = np.zeros(min(CHUNK, samples - first), number)
            state, taken = _take(
                controller, state, passed.clocks, passed.levels, taken,
                spec.clocks_per_sample, spec.design.latency_to_drive, first, velocity,
            )  # fmt: skip
            yield first, velocity * unit, int(state.flags)
