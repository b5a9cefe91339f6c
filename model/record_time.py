"""The time of a record: an axis for samples at any rate, whole or not.

An `AxisSpec` has a whole number of samples a second. The axis of a record has its own second, so that the same hardware
serves any rate. That second is a number of sample periods: the least power of two that is a true second or longer, and
at least `SECOND`. Lengths stay in the unit of the record. In that second, a quantity of the unit 1/s^p is (second /
sample_hz)**p times its value in true seconds.

The clock stamps of edges wrap after that second or more. So edges that are further apart read as standstill, as they do
in hardware after a true second.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from .arithmetic.fixed import bits_for
from .checks import FieldError, check_number, check_range
from .estimators.estimate import EstimatorGains
from .requirements import RATES_HZ
from .words import Word

SECOND = 1 << 10
"""The fewest sample periods in the second of a record's axis."""
RATES = 1e-6, float(RATES_HZ[1])
"""The least and the largest sample rate of a record, Hz."""
OF_UNIT = re.compile(r"/s(?:\^\(?(\d+)(?:/(\d+))?\)?)?$")
OF_NAME = {"_sqrt_m_per_s3": 1.5, "_per_s4": 4, "_per_s3": 3, "_per_s2": 2, "_per_s": 1, "_hz": 1, "_s": -1}
"""The power of 1/s in a gain, by the end of its name: the first that fits."""


def power_of_unit(unit: str) -> float:
    """Return the power of 1/s in the unit of a word, such as `m^(1/2)/s^(3/2)`."""
    if unit in ("s", "Hz"):
        return 1.0 if unit == "Hz" else -1.0
    found = OF_UNIT.search(unit)
    return int(found[1] or 1) / int(found[2] or 1) if found else 0.0


def power_of_name(name: str) -> float:
    """Return the power of 1/s in a gain, from the end of its name."""
    return next((power for ending, power in OF_NAME.items() if name.endswith(ending)), 0.0)


@dataclass(frozen=True)
class RecordTime:
    """True seconds, and the seconds of a record's axis.

    Attributes:
        sample_hz: the record's sample rate in true seconds, within `RATES`.

    Raises:
        TypeError: if the rate is not a number.
        ValueError: if it is not within `RATES`.
    """

    sample_hz: float

    def __post_init__(self) -> None:
        check_number("sample_hz", self.sample_hz)
        check_range("sample_hz", self.sample_hz, *RATES)

    @property
    def second(self) -> int:
        """The sample periods in a second of the axis."""
        return max(SECOND, 1 << bits_for(max(self.sample_hz, 1.0)))

    @property
    def said(self) -> str:
        """The words of a message on the axis about its second."""
        return f"as if {self.second} samples were a second"

    def to_axis(self, value: float, power: float) -> float:
        """Return a quantity of unit 1/s^power in the axis's seconds."""
        return value * (self.second / self.sample_hz) ** power

    def from_axis(self, value: float, power: float) -> float:
        """Return a quantity of the axis in true seconds."""
        return value * (self.sample_hz / self.second) ** power

    def gains(self, gains: EstimatorGains) -> EstimatorGains:
        """Return gains in the axis's seconds."""
        powers = {name: power_of_name(name) for name in vars(gains)}
        return replace(gains, **{name: self.to_axis(getattr(gains, name), p) for name, p in powers.items() if p})

    def named(self, gains: EstimatorGains) -> dict[str, float]:
        """Return an axis's gains in true seconds, by name."""
        return {
            name: self.from_axis(value, power) if (power := power_of_name(name)) else value
            for name, value in vars(gains).items()
        }

    def words(self, words: Iterable[Word]) -> dict[str, Word]:
        """Return an axis's words with their values in true seconds, by name."""
        return {
            word.name: replace(word, si_per_unit=self.from_axis(word.si_per_unit, power_of_unit(word.unit)))
            for word in words
        }

    def settings(self, words: Mapping[str, Word], si: Mapping[str, float]) -> dict[str, float]:
        """Return settings in the axis's seconds.

        Args:
            words: the words that may be set, by name, in true seconds.
            si: settings by the name of their word, in true seconds.

        Raises:
            TypeError: if a setting is not a number.
            ValueError: if a name is no word, or a setting does not fit; the message says what is accepted.
        """
        for name, value in si.items():
            if name not in words:
                raise FieldError(name, f"is no setting; accepted are {', '.join(words) or 'none'}")
            words[name].from_si(value)
        return {name: self.to_axis(value, power_of_unit(words[name].unit)) for name, value in si.items()}
