"""The design of one axis: every format, run-time word, flag and latency, and its kernels' parameters and states."""

from itertools import accumulate, chain
from typing import NamedTuple

from ..arithmetic.fixed import UQ
from ..checks import FieldError
from ..encoder import quadrature
from ..encoder.quadrature_speed import GLITCH_CLOCKS_MAX
from ..estimators import registry
from ..estimators.acceleration import Accelerated
from ..estimators.estimate import EstimatorGains
from ..requirements import AxisRequirements
from ..runtime.compiled import compiled
from ..words import Word
from . import output, passivity, virtual_mass, wall

GLITCH_WIDTH = GLITCH_CLOCKS_MAX.bit_length()
"""Bits of the glitch filter's length."""
ILLEGAL_WIDTH = 8
"""Bits of the count of illegal transitions, which saturates: a count of one is a fault, a full count a broken cable."""
ENCODER_FLAGS = ("encoder_illegal", "encoder_overspeed", "count_wrapped")


class Params(NamedTuple):
    """Parameters of the blocks, all integer words or all float64, and the lowest bits of their flags."""

    estimator: tuple
    wall: tuple
    mass: virtual_mass.Params | virtual_mass.FloatParams | virtual_mass.Absent
    passivity: passivity.Params | passivity.FloatParams | passivity.Absent
    output: output.Params
    estimator_bit: int
    output_bit: int
    passivity_bit: int


class State(NamedTuple):
    """The states of the blocks, and the sticky flags (bits as in `Design.flags`, after the encoder's flags)."""

    estimator: tuple
    passivity: passivity.State | passivity.Absent
    output: output.State
    flags: int


class Timing(NamedTuple):
    """The clocks at which an axis samples and changes its drive; clock 0 is the first one after reset."""

    clocks_per_sample: int
    strobe: int  # the clock of the first sample
    latency: int  # clocks from a strobe to the changed drive


@compiled
def strobe_of(timing, k):
    """Return the number of the clock at which sample k is taken."""
    return k * timing.clocks_per_sample + timing.strobe


@compiled
def change_of(timing, k):
    """Return the number of the clock at which the drive is sample k's."""
    return strobe_of(timing, k) + timing.latency


@compiled
def overlap_of(timing):
    """Return how many samples are taken between a strobe and its changed drive; 0 if samples do not overlap.

    A sample that is taken in the very clock of the change is not between. An axis that is alone has one at most.
    """
    return (timing.latency - 1) // timing.clocks_per_sample


class Design:
    """Formats, run-time words and latencies of an axis, derived from its requirements and the choice of an estimator.

    A sample may begin before the drive of the last one has changed. `interval` is then the slowest block's, and long
    enough for the next velocity to come after the changed drive. So everything that is read with a drive belongs to the
    drive's sample. Since no interval of an estimator is below its latency, both together are more than
    `latency_to_drive`: a drive changes before the second next strobe.

    Args:
        requirements: the axis's `AxisRequirements`.
        estimator: name of the velocity estimator.
        gains: that estimator's `Gains`, or None for its default ones.
        passive: whether a passivity observer and controller follow the wall.
        coupling: whether the wall can be a virtual coupling.
        mass_max_kg: the largest virtual mass, kg; None without one.

    Attributes:
        decoder: the decoder's `quadrature.Params`.
        estimator, wall, output: the designs of the other blocks.
        mass: the design of the virtual mass; None without one.
        passivity: the design of the passivity observer and controller; None without one.
        words: every run-time word, in the order of the hardware's ports.
        flags: names of the sticky flags, bit 0 first.
        latency_to_drive: clocks from the sample strobe to the changed drive.
        force_to_drive: the flags from the wall's force on.
        interval: the fewest clocks from a sample strobe to the next.
        timing: the `Timing` of the axis alone, whose first sample ends the first `clocks_per_sample` clocks.
    """

    words: tuple[Word, ...]
    flags: tuple[str, ...]

    def __init__(
        self,
        requirements: AxisRequirements,
        estimator: str,
        gains: EstimatorGains | None = None,
        passive: bool = False,
        coupling: bool = False,
        mass_max_kg: float | None = None,
    ):
        chosen = registry.design_of(estimator)
        gains = chosen.gains_class.default(requirements) if gains is None else gains
        if not isinstance(gains, chosen.gains_class):
            kind = f"{chosen.gains_class.__module__.rpartition('.')[2]}.Gains"
            raise TypeError(f"gains of {estimator} must be {kind} or None, not {gains!r}")
        self.requirements = requirements
        self.gains = gains
        self.decoder = quadrature.Params(requirements.count_width, requirements.stamp_width, ILLEGAL_WIDTH)
        self.estimator = chosen(requirements, gains)
        self.wall = wall.Design(requirements, self.estimator.velocity, coupling, mass_max_kg is not None)
        self.mass = self._mass(mass_max_kg)
        self.passivity = passivity.Design(requirements, self.estimator.velocity) if passive else None
        self.output = output.Design(requirements)
        self.words = (
            Word(
                "encoder_glitch_clocks",
                UQ(GLITCH_WIDTH, 0),
                1.0,
                "",
                requirements.glitch_clocks_at_reset,
                "longest pulse that the glitch filter rejects, clocks; 0: no filter, so that every pulse that a clock "
                "sees is counted forth and back, and falsifies the stamps of edges without a flag",
            ),
            Word("encoder_invert", UQ(1, 0), 1.0, "", 0, "1: count the other way"),
            *self.estimator.words,
            *self.wall.words,
            *(self.passivity.words if self.passivity else ()),
            *self.output.words,
            *(self.mass.words if self.mass else ()),
        )
        flags = ENCODER_FLAGS, self.estimator.flags, self.output.flags, self.passivity.flags if self.passivity else ()
        self.flags = tuple(chain(*flags))
        self._flag_bits = tuple(accumulate(map(len, flags[:3])))
        if self.estimator.latency < self.wall.lead:
            raise ValueError(
                f"estimator must take {self.wall.lead} clocks or more, as the wall's lead does, "
                f"not {self.estimator.latency}"
            )
        for block, name in ((self.mass, "virtual mass"), (self.passivity, "passivity controller")):
            if block and self.wall.latency < block.behind:
                raise ValueError(
                    f"wall must take {block.behind} clocks or more before a {name}, not {self.wall.latency}"
                )
        self.force_to_drive = sum(block.latency for block in (self.mass, self.passivity, self.output) if block)
        behind = self.wall.latency + self.force_to_drive
        self.latency_to_drive = self.estimator.latency + behind
        self.interval = max(self.estimator.interval, self.wall.interval, self.output.interval, behind + 1)
        per_sample = requirements.clocks_per_sample
        self.timing = Timing(per_sample, per_sample - 1, self.latency_to_drive)

    def _mass(self, most_kg: float | None) -> virtual_mass.Design | None:
        """Return the design of the virtual mass, for an estimator that has an acceleration."""
        if most_kg is None:
            return None
        if not isinstance(self.estimator, Accelerated):
            known = ", ".join(name for name, kind in registry.ESTIMATORS.items() if issubclass(kind, Accelerated))
            raise FieldError(
                virtual_mass.FIELD,
                f"needs an estimator with an acceleration ({known}), not {self.estimator.name}",
            )
        return virtual_mass.Design(self.requirements, self.estimator.acceleration, most_kg)

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
        return Params(
            self.estimator.params(words),
            self.wall.params(words),
            self.mass.params(words) if self.mass else virtual_mass.ABSENT,
            self.passivity.params(words) if self.passivity else passivity.ABSENT,
            self.output.params(words),
            *self._flag_bits,
        )

    def float_params(self, words: dict[str, int], si: dict[str, float]) -> Params:
        """Return the float64 kernel's parameters: gains unrounded, as given in `si` by the name of their word."""
        selected = self.estimator.outputs[words.get(self.estimator.output_word(), 0)]
        mass: virtual_mass.FloatParams | virtual_mass.Absent = virtual_mass.ABSENT
        if self.mass:
            mass = self.mass.float_params(si.get("wall_mass", 0.0), si.get("free_mass", 0.0))
        controller: passivity.FloatParams | passivity.Absent = passivity.ABSENT
        if self.passivity:
            controller = self.passivity.float_params(si.get("passivity_damping", 0.0))
        return Params(
            self.estimator.float_params(self.gains, selected, si),
            self.wall.float_params(si.get("wall_stiffness", 0.0), si.get("wall_damping", 0.0), words),
            mass,
            controller,
            self.output.float_params(words),
            *self._flag_bits,
        )

    def start(self, floating: bool = False) -> State:
        """Return the state before the first sample, for one run only: the run may write to arrays in it."""
        started = passivity.FLOAT_START if floating else passivity.START
        return State(
            self.estimator.start(floating),
            started if self.passivity else passivity.ABSENT,
            output.FLOAT_START if floating else output.START,
            0,
        )

    def flag_names(self, flags: int) -> list[str]:
        """Return the names of the flags that are raised in `flags`."""
        return [name for bit, name in enumerate(self.flags) if flags >> bit & 1]
