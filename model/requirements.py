"""One axis in SI units, and every format and gain word that follows from it. No width is picked by hand.

Units inside the axis are counts and sample periods, so with q the count size and tau the sample period

    velocity    1 count a sample             = q / tau          m/s
    stiffness   1 force LSB per count        = r / q            N/m      (r: the force LSB)
    damping     1 force LSB per count/sample = r tau / q        N s/m

Counts. Positions and the wall may lie anywhere in the travel, whatever the origin: this takes twice the travel. An
overshoot as large again must not alias. So the count covers plus and minus four times the travel, halved on each side:
`1 + ceil(log2(4 travel / q))` bits with the sign. An edge beyond an end of that range wraps the count and raises a
flag. Differences of two counts of the handle are taken modulo the width. The wall's depth is not taken modulo the
width: it has a bit more.

Force. The force LSB is `force_resolution_n`. `force` is the format between wall and output stage. It has one bit more
than the largest drive needs, so a saturated wall force is always above the limit of the output stage.

Gain words are unsigned and `words.GAIN_BITS` wide. A gain's format has the fewest integer bits that hold its largest
value. So its resolution is largest / 2**GAIN_BITS or finer.
"""

import dataclasses
import math
from dataclasses import dataclass

from .arithmetic.fixed import SQ, bits_for
from .checks import NUMBERS, FieldError, check_int, check_number, check_range, shown
from .encoder.quadrature_speed import GLITCH_CLOCKS_MAX, glitch_clocks_for

CLOCK_HZ_MAX = 1 << 48
"""The largest clock, Hz, far above any FPGA's: it keeps stamps short enough for arithmetic in 64 bits."""
RATES_HZ = 1, 10**9
"""The least and the largest sample rate of an axis or a recording, Hz."""
EDGE_ERROR_COUNTS = 0.1
"""The default RMS error of single edges, counts: a poor scale's."""
JERK_SHARE = 2.0**-7
"""The default bound on the jerk, as a share of C divided by the time in which C moves half a count."""


@dataclass(frozen=True, kw_only=True)
class AxisRequirements:
    """The requirements of one axis in SI units, without the choice of its estimator, and what follows from them alone.

    Attributes:
        clock_hz: FPGA clock, Hz.
        sample_hz: estimator and wall rate, Hz; divides the clock.
        actuation_hz: rate at which the drive changes, Hz; divides the sample rate.
        count_m: size of one x4 count, m.
        travel_m: length of the workspace, m.
        speed_max_m_per_s: largest speed to estimate, m/s.
        acceleration_max_m_per_s2: bound C on the acceleration, m/s^2; sets default estimator gains.
        jerk_max_m_per_s3: bound on the jerk between impacts, m/s^3; sets default gains of `edge-kalman`,
            `count-kalman` and the Levants of order 2 and 3, and of `kalman` if it is given. For
            all but the filters of edges it has to hold at an impact. None for `jerk_bound_m_per_s3`.
        edge_error_max_counts: RMS error of single edges of the encoder that estimates tolerate, counts; sets default
            gains of `edge-kalman`, `count-kalman`, `mt` and `mt-divisionless`.
        force_max_n: largest drive, N.
        force_resolution_n: force LSB, N.
        stiffness_max_n_per_m: largest wall stiffness, N/m.
        damping_max_n_s_per_m: largest wall damping, N s/m.
        glitch_clocks: the encoder's glitch filter after reset, clocks; None for the longest that its speed leaves
            (`quadrature_speed.glitch_clocks_for`).
        estimator_bits_dropped: number of fraction bits removed from the derived widths of the estimator's words, 0 to
            32; for studies of the word width.

    Raises:
        TypeError: if a field is of the wrong type.
        ValueError: if a value is impossible; the message names the field and the accepted range.
    """

    clock_hz: int
    sample_hz: int
    actuation_hz: int
    count_m: float
    travel_m: float
    speed_max_m_per_s: float
    acceleration_max_m_per_s2: float
    force_max_n: float
    force_resolution_n: float
    stiffness_max_n_per_m: float
    damping_max_n_s_per_m: float
    jerk_max_m_per_s3: float | None = None
    edge_error_max_counts: float = EDGE_ERROR_COUNTS
    glitch_clocks: int | None = None
    estimator_bits_dropped: int = 0

    def __post_init__(self):
        for field in dataclasses.fields(self):
            name, kind, value = field.name, field.type, getattr(self, field.name)
            if kind is int:
                check_int(name, value, *((0, 32) if name == "estimator_bits_dropped" else (1, CLOCK_HZ_MAX)))
            if kind is str and not isinstance(value, str):
                raise TypeError(f"{name} must be a str, not {shown(value)}")
            if kind is float:
                check_number(name, value)
                check_range(name, value, *NUMBERS)
        if self.jerk_max_m_per_s3 is not None:
            check_number("jerk_max_m_per_s3", self.jerk_max_m_per_s3)
            check_range("jerk_max_m_per_s3", self.jerk_max_m_per_s3, *NUMBERS)
        if self.glitch_clocks is not None:
            check_int("glitch_clocks", self.glitch_clocks, 0, GLITCH_CLOCKS_MAX)
        self._check_rates()
        self._check_widths()

    def _check_rates(self):
        if self.clock_hz % self.sample_hz:
            raise FieldError("sample_hz", f"must divide clock_hz {self.clock_hz}, not {self.sample_hz!r}")
        if self.sample_hz % self.actuation_hz:
            raise FieldError("actuation_hz", f"must divide sample_hz {self.sample_hz}, not {self.actuation_hz!r}")

    def _check_widths(self):
        if self.travel_m < self.count_m:
            raise FieldError("travel_m", f"must be at least one count of {self.count_m:g} m, not {self.travel_m!r}")
        if self.count_width > 32:
            raise FieldError(
                "travel_m",
                f"must be at most {2**29 * self.count_m:g} for a 32-bit count of {self.count_m:g} m, "
                f"not {self.travel_m!r}",
            )
        if not 1 <= self.force_max_n / self.force_resolution_n < 2**24:
            raise FieldError(
                "force_resolution_n",
                f"must be {self.force_max_n / 2**24:g} to {self.force_max_n:g} for force_max_n "
                f"{self.force_max_n:g}, not {self.force_resolution_n!r}",
            )

    def shrunk(self, derived: int) -> int:
        """Return the fraction bits of an estimator's word: `derived` less `estimator_bits_dropped`.

        Raises:
            ValueError: if the word has fewer fraction bits than are to be dropped.
        """
        left = derived - self.estimator_bits_dropped
        if self.estimator_bits_dropped and left < 0:
            raise FieldError(
                "estimator_bits_dropped",
                f"must be 0 to {max(derived, 0)} with this estimator, not {self.estimator_bits_dropped!r}",
            )
        return left

    @property
    def clocks_per_sample(self) -> int:
        return self.clock_hz // self.sample_hz

    @property
    def samples_per_actuation(self) -> int:
        return self.sample_hz // self.actuation_hz

    @property
    def count_width(self) -> int:
        """Bits of the position count."""
        return 1 + bits_for(4 * self.travel_m / self.count_m)

    @property
    def stamp_width(self) -> int:
        """Bits of a clock stamp. It wraps after a second or more, so edges slower than about 2 Hz read as
        standstill."""
        return bits_for(self.clock_hz)

    @property
    def velocity_unit_m_per_s(self) -> float:
        """Speed of one count a sample, m/s."""
        return self.count_m * self.sample_hz

    @property
    def speed_max_counts_per_sample(self) -> float:
        return self.speed_max_m_per_s / self.velocity_unit_m_per_s

    @property
    def jerk_bound_m_per_s3(self) -> float:
        """The bound on the jerk between impacts: `jerk_max_m_per_s3`, or else JERK_SHARE C sqrt(C / q)."""
        if self.jerk_max_m_per_s3 is not None:
            return self.jerk_max_m_per_s3
        bound = self.acceleration_max_m_per_s2
        return JERK_SHARE * bound * math.sqrt(bound / self.count_m)

    @property
    def glitch_clocks_at_reset(self) -> int:
        """The glitch filter after reset, clocks."""
        if self.glitch_clocks is not None:
            return self.glitch_clocks
        return glitch_clocks_for(self.edges_per_clock_max)

    @property
    def edges_per_clock_max(self) -> float:
        """Rate of the encoder's edges at the largest speed."""
        return self.speed_max_m_per_s / (self.count_m * self.clock_hz)

    @property
    def force_limit_word(self) -> int:
        """The largest drive word: `force_max_n`, rounded down to the LSB."""
        return math.floor(self.force_max_n / self.force_resolution_n * (1 + 1e-12))

    @property
    def force(self) -> SQ:
        """Format of the wall force and of the drive, in force LSB."""
        return SQ(self.force_limit_word.bit_length() + 2, 0)
