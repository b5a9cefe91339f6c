"""A handle on a prescribed path, whatever pushes it, and the force of a scene's wall on it.

Six things are as in the closed loop: the encoder's edges, the decoder's time, the clocks up to the changed drive, the
hold, an amplifier's delay and a converter's steps. What is behind them is left out: an amplifier's lag, a motor, a
cable, and a carrier's pulses about their mean; and handle and hand, because the path is given.
"""

from dataclasses import dataclass

import numpy as np

from ...model.axis.design import change_of
from ...model.runtime.compiled import compiled
from ..loop.backends import number_of, opened
from ..scene.build import world_of
from ..scene.schema import Scene
from ..world.converter import converted
from .motions import encoded
from .playback import take


class MotionError(ValueError):
    """A handle cannot be moved like this; the message is one line with the accepted values."""


def check(moved: str, *quantities: tuple[str, float, float, float, str]) -> None:
    """Raise MotionError unless the quantities of a motion are within their limits.

    Args:
        moved: the motion in words.
        quantities: for each what it is, its value, the least and the largest one, and the unit.
    """
    for what, value, least, most, unit in quantities:
        if not least <= value <= most:
            raise MotionError(f"{moved} is {what} of {value:g} {unit}, which must be {least:g} to {most:g}")


@compiled
def _drives(controller, state, timing, edges, drives):
    """Fill `drives` from the first sample on; return the state."""
    taken = 0
    for k in range(len(drives)):
        state, taken = take(controller, state, timing, edges, taken, k)
        drives[k] = state.drive
    return state


@compiled
def _put_out(converter, commands_n):
    """Replace commands by what a converter makes of them."""
    for k in range(len(commands_n)):
        commands_n[k] = converted(converter, commands_n[k])


@dataclass(frozen=True)
class Answer:
    """The force of a wall on a moved handle, a constant from each change of the drive to the next.

    Attributes:
        drives: the drive's word after each sample; float64 on `float`.
        push_n: the force against positive motion that acts from each change on, N.
        first_s: time of the first change; at time 0 the path begins.
        step_s: time from each change to the next.
        flags: names of the flags that were raised.
    """

    drives: np.ndarray
    push_n: np.ndarray
    first_s: float
    step_s: float
    flags: list[str]

    def impulse_n_s(self, from_s: float, to_s: float) -> float:
        """Return the integral of the push from one time to another, both within the record."""
        changes_s = self.first_s + self.step_s * np.arange(len(self.push_n) + 1)
        sums = np.concatenate(([0.0], np.cumsum(self.push_n) * self.step_s))
        begin, end = np.interp((from_s, to_s), changes_s, sums)
        return float(end - begin)


def answer(scene: Scene, motion: tuple, samples: int, turns_apart_s: float, backend: str) -> Answer:
    """Return the answer of a scene's wall, with its surface at position 0, to a path.

    Args:
        scene: the scene.
        motion: one of `motions`.
        samples: number of samples.
        turns_apart_s: a time in which the motion turns at most once.
        backend: one of `backends.BACKENDS`.

    Raises:
        RuntimeError: if the RTL could not be built.
    """
    spec, world = scene.spec, world_of(scene)
    encoder = encoded(motion, world.encoder, (samples + 1) / spec.sample_hz, turns_apart_s, 0)
    # The count is 0 where the path begins.
    parameters = scene.parameters | {"wall_position": -encoder.start_cell * spec.count_m}
    drives = np.zeros(samples, number_of(backend))
    with opened(spec, backend, parameters, encoder.start_level) as axis:
        state = _drives(axis.controller, axis.state, world.timing, encoder.edges, drives)
    late = min(scene.delay_samples, samples)
    commands_n = np.concatenate((np.zeros(late), drives[: samples - late] * world.force_lsb_n))
    _put_out(world.converter, commands_n)
    return Answer(
        drives=drives,
        push_n=-commands_n,
        first_s=change_of(world.timing, 0) / spec.clock_hz,
        step_s=1 / spec.sample_hz,
        flags=spec.design.flag_names(int(state.flags)),
    )
