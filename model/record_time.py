"""The time of a record: an axis for counts at any sample rate, whole or not.

In the `AxisSpec` of a record a second is `SECOND` *sample periods* (a time in which no stamp of an edge wraps), so that
the same hardware serves any rate. Lengths stay in the unit of the record. A quantity of the unit 1/s^p is, in the
axis's seconds, (SECOND / sample_hz)**p times what it is in true ones.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace

from .checks import FieldError, check_number, check_range
from .estimators.estimate import EstimatorGains
from .requirements import RATES_HZ
from .words import Word

SECOND = 1 << 10
"""The number of sample periods in a second of the axis."""
RATES = 1e-6, float(RATES_HZ[1])
"""The least and the largest sample rate of a record, Hz."""
OF_UNIT = re.compile(r"/s(?:\^\(?(\d+)(?:/(\d+))?\)?)?$")
OF_NAME = {"_sqrt_m_per_s3": 1.5, "_per_s3": 3, "_per_s2": 2, "_per_s": 1, "_hz": 1, "_s": -1}
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
    """True seconds against those of a record's axis.

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

    def to_axis(self, value: float, power: float) -> float:
        """Return a quantity of unit 1/s^power in the axis's seconds."""
        return value * (SECOND / self.sample_hz) ** power

    def from_axis(self, value: float, power: float) -> float:
        """Return a quantity of the axis in true seconds."""
        return value * (self.sample_hz / SECOND) ** power

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

    def encode(self, words: Mapping[str, Word], si: Mapping[str, float]) -> tuple[dict[str, int], dict[str, float]]:
        """Return the words of settings, by name, and the settings in the axis's seconds.

        Args:
            words: the words that may be set, by name.
            si: settings by the name of their word, in true seconds.

        Raises:
            TypeError: if a setting is not a number.
            ValueError: if a name is no word, or a setting does not fit; the message says what is accepted.
        """
        encoded, scaled = {}, {}
        for name, value in si.items():
            if name not in words:
                raise FieldError(name, f"is no setting; accepted are {', '.join(words) or 'none'}")
            word, power = words[name], power_of_unit(words[name].unit)
            true = replace(word, si_per_unit=self.from_axis(word.si_per_unit, power))
            encoded[name], scaled[name] = true.from_si(value), self.to_axis(value, power)
        return encoded, scaled
