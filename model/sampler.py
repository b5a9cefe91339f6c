"""An axis a sample at a time: the position of a handle in, the force out, for loops of one's own.

Between two samples the position moves at constant speed. Its edges reach the pins of the hardware's decoder at their
own clocks. So estimators that time edges work, and latency and faults are the hardware's. In a sample of D clocks from
t0 on, from position x0 to x1, the edge at the border b comes at

    t = t0 + 1 + floor(D (b - x0) / (x1 - x0)),      one edge a clock, the last not after t0 + D

A motion with more edges than clocks in a sample is too fast for any decoder. Both pins then change at once. This raises
the flag `encoder_illegal`, and the force is 0 until `reset`.
"""

import math
from copy import deepcopy
from functools import cache
from typing import Any

import numba
import numpy as np
from numba.experimental import jitclass

from .axis.axis import Axis
from .axis.design import strobe_of
from .checks import check_number, shown
from .encoder.level import level
from .encoder.quadrature import Inputs, advance
from .estimators.acceleration import Accelerated, acceleration_of
from .runtime.compiled import compiled, inlined
from .spec import AxisSpec
from .stamped import State, controller, sample_quietly
from .velocity_estimator import is_floating

REACH = 2.0**52
"""The largest position in either direction, counts: float64 cannot tell the cell of a larger one."""


@compiled
def cell_of(position, count_m):
    """Return the number of the cell between two edges in which a position lies: its count."""
    return math.floor(position / count_m)


@inlined
def turned(controller, state, clock, pins):
    """Return the state with the decoder advanced to `clock`, at which the pins change to `pins`; no sample is taken."""
    inputs = Inputs(state.level & 1, state.level >> 1, 0, controller.glitch_clocks, controller.invert)
    decoder = advance(controller.decoder, state.decoder, inputs, clock - state.clock)
    return State(state.drive, state.velocity, state.force, state.flags, decoder, state.axis, clock, pins)


@inlined
def pass_edges(controller, state, count_m, places, start, clocks):
    """Return the state behind the edges of a motion.

    Args:
        controller, state: of `stamped`.
        count_m: size of a count, m.
        places: the positions before and behind it, m.
        start, clocks: the edges come at clocks start + 1 to start + clocks.
    """
    place, position = places
    count, last = cell_of(place, count_m), cell_of(position, count_m)
    total, direction = abs(last - count), 1 if last > count else -1
    if total > clocks:
        return turned(controller, state, start + 1, state.level ^ 3)
    before = start
    for i in range(total):
        border = max(count, count + direction) * count_m
        share = int(clocks * (border - place) / (position - place))
        before = max(before + 1, min(start + 1 + share, start + clocks - (total - 1 - i)))
        count += direction
        state = turned(controller, state, before, level(count))
    return state


@compiled
def sample(controller, state, timing, count_m, places, k):
    """Return the state after sample k, which ends the motion between two positions, m."""
    clocks, strobe = timing.clocks_per_sample, strobe_of(timing, k)
    state = pass_edges(controller, state, count_m, places, strobe - clocks, clocks)
    return sample_quietly(controller, state, strobe)


@numba.njit(error_model="numpy", nogil=True)
def _take(cell, position):
    """Take the next sample at a position, m; return the drive, force LSB, or NaN for a position without a cell."""
    if not abs(position) <= REACH * cell.count_m:
        return math.nan
    places = cell.place, position
    cell.state = sample(cell.controller, cell.state, cell.timing, cell.count_m, places, cell.samples)
    cell.place = position
    cell.samples += 1
    cell.velocity, cell.flags = cell.state.velocity, cell.state.flags
    cell.count = cell.state.decoder.count
    return float(cell.state.drive)


@numba.njit(error_model="numpy", nogil=True)
def _acceleration(cell):
    """Return the acceleration of the last sample, of a cell whose estimator has one."""
    return float(acceleration_of(cell.controller.axis.estimator, cell.state.axis.estimator))


@cache
def _cell(controller: Any, state: Any, timing: Any) -> type:
    """Return the class of what a sampler keeps between samples, for these types of Numba."""
    members = (
        ("controller", controller),
        ("state", state),
        ("timing", timing),
        ("count_m", numba.float64),
        ("place", numba.float64),
        ("samples", numba.int64),
        ("velocity", numba.float64),
        ("flags", numba.int64),
        ("count", numba.int64),
    )

    class Cell:
        def __init__(self, controller, state, timing, count_m, place, samples):
            self.controller, self.state, self.timing = controller, state, timing
            self.count_m, self.place, self.samples = count_m, place, samples
            self.velocity, self.flags, self.count = state.velocity, state.flags, state.decoder.count

    return jitclass(members)(Cell)


class Sampler:
    """An axis that takes a position and returns its force, sample by sample.

        sampler = Sampler(spec, wall_stiffness=20e3, wall_damping=10.0)
        while True:
            force_n = sampler(position_m)       # every 1 / spec.sample_hz seconds

    The first position is the one at reset: it sets the count, and the velocity is 0. The count is the position divided
    by the size of a count, rounded down; for a count n, pass (n + 0.5) count_m. An edge within the decoder's latency
    before a sample counts at the next sample. The force changes at `spec.actuation_hz`. In hardware it changes
    `spec.design.latency_to_drive` clocks after the sample.

    The first call compiles the kernels, which takes some seconds. `copy.deepcopy` and `pickle` keep the state.

    Args:
        spec: the axis.
        backend: `fixed` for the hardware's words, `float` for the same algorithms in float64 with unrounded gains.
        si: run-time words in SI units by name, e.g. `wall_stiffness=20e3` (N/m); see `axis.design.Design.words`.

    Raises:
        TypeError: if `spec` is no AxisSpec, or a value is not a number.
        ValueError: if a name is unknown or a value is out of range.
    """

    def __init__(self, spec: AxisSpec, backend: str = "fixed", **si: float):
        if not isinstance(spec, AxisSpec):
            raise TypeError(f"spec must be an AxisSpec, not {shown(spec)}")
        self.spec, self._floating, self._si = spec, is_floating(backend), dict(si)
        self._axis = Axis(spec, self._floating, **si)
        self._kept: Any = None

    def __repr__(self) -> str:
        return f"Sampler({self.spec.estimator!r} at {self.spec.sample_hz} Hz)"

    def __getstate__(self) -> dict[str, Any]:
        kept = self._kept
        held = None if kept is None else (self.state, kept.place, kept.samples)
        return {"spec": self.spec, "floating": self._floating, "si": self._si, "held": held}

    def __setstate__(self, held: dict[str, Any]) -> None:
        self.spec, self._floating, self._si = held["spec"], held["floating"], dict(held["si"])
        self._axis, self._kept = Axis(self.spec, self._floating, **self._si), None
        if held["held"] is not None:
            self._keep(*held["held"])

    def reset(self) -> None:
        """Start again: the next position is the first one, and no flag is up. Run-time words stay."""
        self._kept = None

    def set(self, **si: float) -> None:
        """Change run-time words from the next sample on, in SI units by name, as a host does.

        Raises:
            TypeError: if a value is not a number.
            ValueError: if a name is unknown or a value is out of range.
        """
        self._axis = Axis(self.spec, self._floating, **self._si | si)
        self._si |= si
        if self._kept is not None:
            self._kept.controller = controller(self._axis, 0)[0]

    def __call__(self, position_m: float) -> float:
        """Take a sample at a position, m; return the force on the handle after the output stage, N.

        Raises:
            TypeError: if the position is not a number.
            ValueError: if it is not finite, or the first one is beyond the count.
        """
        if type(position_m) is not float:
            position_m = _number(position_m)
        if self._kept is None:
            self._start(position_m)
        drive = _take(self._kept, position_m)
        if math.isnan(drive):
            raise ValueError(f"position_m must be finite, and within 2**52 counts, not {shown(position_m)}")
        return drive * self.spec.force_resolution_n

    def _start(self, position_m: float) -> None:
        reach_m = (1 << (self.spec.count_width - 1)) * self.spec.count_m
        if not -reach_m <= position_m < reach_m:
            raise ValueError(f"position_m must begin within -{reach_m:g} to {reach_m:g} m, not {shown(position_m)}")
        count = cell_of(position_m, self.spec.count_m)
        state = controller(self._axis, int(level(count)))[1]
        self._keep(state._replace(decoder=state.decoder._replace(count=count)), position_m, 0)

    def _keep(self, state: State, place: float, samples: int) -> None:
        words, timing = controller(self._axis, 0)[0], self._axis.design.timing
        kind = _cell(*map(numba.typeof, (words, state, timing)))
        self._kept = kind(words, state, timing, float(self.spec.count_m), place, samples)

    @property
    def state(self) -> State | None:
        """The states of decoder and axis after the last sample, as a copy; None before the first."""
        return None if self._kept is None else deepcopy(self._kept.state)

    @property
    def velocity_m_per_s(self) -> float:
        """The velocity of the last sample, m/s; 0 before the first."""
        lsb = 1.0 if self._floating else self._axis.design.estimator.velocity.lsb
        return 0.0 if self._kept is None else self._kept.velocity * lsb * self.spec.velocity_unit_m_per_s

    @property
    def acceleration_m_per_s2(self) -> float | None:
        """The acceleration of the last sample, m/s^2; 0 before the first, and None for an estimator without one."""
        estimator = self._axis.design.estimator
        if not isinstance(estimator, Accelerated):
            return None
        lsb = 1.0 if self._floating else estimator.acceleration.lsb
        unit_m_per_s2 = self.spec.velocity_unit_m_per_s * self.spec.sample_hz
        return 0.0 if self._kept is None else _acceleration(self._kept) * lsb * unit_m_per_s2

    @property
    def count(self) -> int:
        """The count of the last sample, counts; 0 before the first."""
        return 0 if self._kept is None else self._kept.count

    @property
    def flags(self) -> list[str]:
        """The names of the flags that are up: they stay until `reset`."""
        return [] if self._kept is None else self._axis.design.flag_names(self._kept.flags)


def _number(position_m: Any) -> float:
    """Return a position as a float: of what is a number, or an array of one."""
    value = position_m
    if isinstance(value, np.generic | np.ndarray) and value.size == 1:
        value = value.item()
    check_number("position_m", value)
    try:
        return float(value)
    except OverflowError:
        return math.inf
