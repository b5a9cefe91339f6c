"""One axis, from counts to drive: estimator, wall and output stage, wired as the hardware wires them.

For studies in Python, `Axis` takes and returns numpy arrays and SI units:

    axis = Axis(spec, wall_stiffness=20e3, wall_damping=30.0)
    record = axis.run(counts)
    record.velocity_m_per_s, record.drive_n

The closed loop compiles the kernels beneath it into itself: `step` takes one sample, `run` takes records.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from . import checks, output, quadrature, wall
from .arithmetic.fixed import UQ
from .compiled import compiled, inlined
from .estimators import registry
from .estimators.estimate import estimate
from .words import Word

if TYPE_CHECKING:
    from .spec import AxisSpec

GLITCH_WIDTH = 4
"""Bits of the glitch filter's length, which is up to 15 clocks."""
ILLEGAL_WIDTH = 8
"""Bits of the count of illegal transitions, which saturates: a count of one is a fault, a full count a broken cable."""
ENCODER_FLAGS = ("encoder_illegal", "encoder_overspeed")


class Params(NamedTuple):
    """Parameters of the three blocks, all integer words or all float64, and the lowest bits of their flags."""

    estimator: tuple
    wall: wall.Params | wall.FloatParams
    output: output.Params
    estimator_bit: int
    output_bit: int


class State(NamedTuple):
    """The states of the blocks, and the sticky flags (bits as in `Design.flags`, after the encoder's flags)."""

    estimator: tuple
    output: output.State
    flags: int


class Timing(NamedTuple):
    """The clocks at which an axis samples and changes its drive; clock 0 is the first one after reset."""

    clocks_per_sample: int
    latency: int  # clocks from a strobe to the changed drive


@compiled
def strobe_of(timing, k):
    """Return the number of the clock at which sample k is taken."""
    return (k + 1) * timing.clocks_per_sample - 1


class Design:
    """Formats, run-time words and latencies of an axis, derived from its `AxisSpec`.

    Attributes:
        decoder: the decoder's `quadrature.Params`.
        estimator, wall, output: the designs of the other blocks.
        words: every run-time word, in the order of the hardware's ports.
        flags: names of the sticky flags, bit 0 first.
        latency_to_drive: clocks from the sample strobe to the changed drive.
        timing: the clocks per sample, and `latency_to_drive`.
    """

    words: tuple[Word, ...]
    flags: tuple[str, ...]

    def __init__(self, spec: "AxisSpec"):
        estimator = registry.design_of(spec.estimator)
        gains = estimator.gains_class.default(spec) if spec.gains is None else spec.gains
        if not isinstance(gains, estimator.gains_class):
            kind = f"{estimator.gains_class.__module__.rpartition('.')[2]}.Gains"
            raise TypeError(f"gains of {spec.estimator} must be {kind} or None, not {gains!r}")
        self.spec = spec
        self.gains = gains
        self.decoder = quadrature.Params(spec.count_width, spec.stamp_width, ILLEGAL_WIDTH)
        self.estimator = estimator(spec, gains)
        self.wall = wall.Design(spec, self.estimator.velocity)
        self.output = output.Design(spec)
        self.words = (
            Word(
                "encoder_glitch_clocks",
                UQ(GLITCH_WIDTH, 0),
                1.0,
                "",
                0,
                "longest pulse that the glitch filter rejects, clocks",
            ),
            Word("encoder_invert", UQ(1, 0), 1.0, "", 0, "1: count the other way"),
            *self.estimator.words,
            *self.wall.words,
            *self.output.words,
        )
        self.flags = (*ENCODER_FLAGS, *self.estimator.flags, *self.output.flags)
        self._flag_bits = len(ENCODER_FLAGS), len(ENCODER_FLAGS) + len(self.estimator.flags)
        self.latency_to_drive = self.estimator.latency + self.wall.latency + self.output.latency
        self.timing = Timing(spec.clocks_per_sample, self.latency_to_drive)

    def encode(self, **si: float) -> dict[str, int]:
        """Return every run-time word by name: converted from the SI value where one is given, else its reset word.

        Raises:
            TypeError: if a value is not a number.
            ValueError: if a name is not a word, or a value does not fit; the message says what is accepted.
        """
        known = {word.name: word for word in self.words}
        for name in si:
            if name not in known:
                raise ValueError(f"parameter must be one of {', '.join(known)}, not {name!r}")
        return {name: word.from_si(si[name]) if name in si else word.reset for name, word in known.items()}

    def params(self, words: dict[str, int]) -> Params:
        """Return the integer kernel's parameters."""
        blocks = self.estimator.params(words), self.wall.params(words), self.output.params(words)
        return Params(*blocks, *self._flag_bits)

    def float_params(self, words: dict[str, int], si: dict[str, float]) -> Params:
        """Return the float64 kernel's parameters: gains unrounded, as given in `si` by the name of their word."""
        selected = self.estimator.outputs[words.get(self.estimator.output_word(), 0)]
        return Params(
            self.estimator.float_params(self.gains, selected, si),
            self.wall.float_params(si.get("wall_stiffness", 0.0), si.get("wall_damping", 0.0), words),
            self.output.float_params(words),
            *self._flag_bits,
        )

    def start(self, floating: bool = False) -> State:
        """Return the state before the first sample, for one run only: the run may write to arrays in it."""
        return State(self.estimator.start(floating), output.FLOAT_START if floating else output.START, 0)

    def flag_names(self, flags: int) -> list[str]:
        """Return the names of the flags that are raised in `flags`."""
        return [name for bit, name in enumerate(self.flags) if flags >> bit & 1]


@inlined
def step(
    params: Params, state: State, seen: quadrature.Seen, restart: int, fault: int, enable: int
) -> tuple[State, float, float]:
    """Take one sample: return (state, velocity, force); the drive is `state.output.drive`.

    Args:
        params: what `Design.params` or `Design.float_params` returns.
        state: what `Design.start` or the previous call returned, of the same number type.
        seen: what the decoder shows at the strobe.
        restart: true if the count was preloaded since the last sample; the estimator then starts afresh.
        fault: the encoder's two sticky flags; either of them forces the drive to zero.
        enable: false forces the drive to zero.
    """
    estimator, velocity, estimator_flags = estimate(params.estimator, state.estimator, seen, restart)
    force = wall.render(params.wall, seen.count, velocity)
    driven, output_flags = output.step(params.output, state.output, force, enable and not fault)
    flags = state.flags | fault | estimator_flags << params.estimator_bit | output_flags << params.output_bit
    return State(estimator, driven, flags), velocity, force


@compiled
def run(params, state, counts, velocity, force, drive, flags):
    """Take a record of `counts` sample by sample, fill the other arrays (of the same length) and return the state."""
    for k in range(len(counts)):
        state, velocity[k], force[k] = step(params, state, quadrature.seen_count(counts[k]), 0, 0, 1)
        drive[k] = state.output.drive
        flags[k] = state.flags
    return state


@dataclass(frozen=True)
class Record:
    """The response of an axis to a record of counts, as arrays of the same shape as the counts.

    Attributes:
        velocity: words of `design.estimator.velocity`; counts a sample if the axis is float64.
        force, drive: force on the handle, force LSB, before and after the output stage.
        flags: sticky flags after every sample, bits as in `design.flags`.
    """

    design: Design
    velocity: np.ndarray
    force: np.ndarray
    drive: np.ndarray
    flags: np.ndarray

    @property
    def velocity_m_per_s(self) -> np.ndarray:
        lsb = 1.0 if self.velocity.dtype == np.float64 else self.design.estimator.velocity.lsb
        return self.velocity * (lsb * self.design.spec.velocity_unit_m_per_s)

    @property
    def force_n(self) -> np.ndarray:
        return self.force * self.design.spec.force_resolution_n

    @property
    def drive_n(self) -> np.ndarray:
        return self.drive * self.design.spec.force_resolution_n


class Axis:
    """An axis with its run-time parameters set, in SI units by port name; see `Design.words`.

    Args:
        spec: the axis.
        floating: true for the same algorithms in float64, with gains unrounded and the estimator unsaturated.
        si: run-time parameters, e.g. `wall_stiffness=20e3` (N/m); the others keep their reset values (the wall is off).

    Attributes:
        design: the spec's `Design`.
        words: run-time words by port name.
        params: parameters of `step`.

    Raises:
        TypeError: if `spec` is not an AxisSpec, or a value is not a number.
        ValueError: if a name is unknown or a value is out of range.
    """

    def __init__(self, spec: "AxisSpec", floating: bool = False, **si: float):
        if not isinstance(getattr(spec, "design", None), Design):
            raise TypeError(f"spec must be an AxisSpec, not {spec!r}")
        self.design = spec.design
        self.words = words = self.design.encode(**si)
        self.floating = floating
        self.params = self.design.float_params(words, si) if floating else self.design.params(words)

    def run(self, counts: ArrayLike) -> Record:
        """Run records of counts from the start state.

        Args:
            counts: integers, shape (samples,), or (lanes, samples) for independent axes side by side. A count may
                exceed the count's width: it wraps, as in the hardware. It may not jump by half of its range.

        Raises:
            TypeError: if the counts are not integers.
            ValueError: if the counts do not have one or two dimensions, or jump; or if the estimator also needs the
                stamps of edges, which `hardwall.model.stamped.run` has.
        """
        if self.design.estimator.uses_stamps():
            raise ValueError(f"estimator must be one that needs only counts, not {self.design.spec.estimator!r}")
        spec = self.design.spec
        checked = checks.lanes_of_counts(counts, spec.count_width, spec.clocks_per_sample)
        lanes = np.atleast_2d(checked)
        number = np.float64 if self.floating else np.int64
        velocity, force, drive = (np.zeros(lanes.shape, number) for _ in range(3))
        flags = np.zeros(lanes.shape, np.int64)
        for lane in range(len(lanes)):
            start = self.design.start(self.floating)
            run(self.params, start, lanes[lane], velocity[lane], force[lane], drive[lane], flags[lane])
        return Record(self.design, *(array.reshape(checked.shape) for array in (velocity, force, drive, flags)))
