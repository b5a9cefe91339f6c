"""Whether a closed loop provably repeats: everything that determines its future equals an earlier state.

The loop is a function: plant, encoder, drives on their way and controller after a sample follow from those before it,
and from nothing else. Time enters by differences alone. So a loop that is in one state twice goes through all states in
between for ever. If the handle did not move in between, it never will. Equal is exact: no digit of any number differs.

Two things are left out, because no such future sees them: the stamps of edges, if the estimator uses none; and the
number of the sample, with which the clock of the decoder must be in step. Some loops never count as repeating:
hardware, because its state is hidden; estimators that use stamps; encoders whose lines take time; and pulses of a
carrier.
"""

import math
from typing import Any

import numpy as np

from ...model.stamped import State
from ..loop.coupled import CoupledState
from ..loop.values import Memory, Progress, World
from ..scene.schema import Scene

PERIOD = 2520
"""The time over which a loop is seen to repeat, samples: a multiple of the length of every cycle of 1 to 10."""


def period_of(scene: Scene, world: World, state: Any) -> int | None:
    """Return the number of samples after which a resting loop of a scene is as before; None if this cannot be
    determined."""
    pulse = getattr(world.plant, "pulse", None)
    own = state.controller if isinstance(state, CoupledState) else state
    if not isinstance(own, State) or scene.spec.design.estimator.uses_stamps() or (pulse and pulse.period):
        return None
    if world.encoder.lines is not None:
        return None
    host = scene.coupling.period(scene.spec.sample_hz) if scene.coupling else 1
    return math.lcm(PERIOD, scene.spec.samples_per_actuation, max(scene.delay_samples, 1), host)


def seen(state: State | CoupledState, progress: Progress, memory: Memory, clocks_per_sample: int) -> Any:
    """Return all that the future of a loop depends on, for `==`.

    Args:
        state, progress: what `loop.run` returned.
        memory: what it wrote to.
        clocks_per_sample: the scene's.
    """
    if isinstance(state, CoupledState):
        return *seen(state.controller, progress, memory, clocks_per_sample), state.tool
    stamps = {name: 0 for name in state.decoder._fields if name.startswith("stamp")}
    clock = state.clock - progress.sample * clocks_per_sample
    still = state._replace(decoder=state.decoder._replace(**stamps), clock=clock)
    delay = () if memory.delay is None else memory.delay
    return _comparable((still, progress._replace(sample=0), delay))


def _comparable(value: Any) -> Any:
    """Return a copy of a value in which arrays are bytes."""
    if isinstance(value, tuple):
        return tuple(map(_comparable, value))
    return value.tobytes() if isinstance(value, np.ndarray) else value
