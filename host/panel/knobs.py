"""The words of a board as a page shows them: a name, a unit that hands use, a range, and the way along a slider."""

import math
from dataclasses import dataclass
from enum import Enum

from ...model.register import Kind, Register
from ..bounds import is_whole
from ..device import Device
from ..words import OF_THE_HEARTBEAT

HIDDEN = ("preload_count", "supervisor_causes", *OF_THE_HEARTBEAT)
CAPTURE = "capture_"
"""Words that are no settings for a person at a page, and the prefix of the names of a capture's words."""
UNITS = {
    **{"m": ("mm", 1e3), "m/s": ("mm/s", 1e3), "s": ("ms", 1e3), "kg": ("g", 1e3)},
    **{"m/s^2": ("m/s\u00b2", 1.0), "m^(1/2)/s": ("\u221am/s", 1.0)},
}
"""The unit that is shown, and how many of it the SI unit has."""
DIGITS = "%.7g"
"""How a number is written in a field, and beside it."""
DECADES = 4
"""The decades of a logarithmic slider, whose lower end is the least value."""
BY_RATIO = ("wall_stiffness", "wall_damping", "supervisor_ramp", "output_slew_limit")
"""Words that a hand feels by ratios."""
LABELS = {
    "wall_stiffness": "Stiffness K",
    "wall_damping": "Damping B",
    "wall_position": "Wall begins at",
    "wall_left": "Wall on the lower side",
    "wall_forbid_pull": "Never pull",
    "wall_velocity": "Velocity of the surface",
    "wall_two_sided": "Hold on both sides",
    "wall_mass": "Virtual mass in the wall",
    "free_mass": "Virtual mass in free space",
    "supervisor_force_limit": "Force limit",
    "supervisor_ramp": "Rise of the limit",
    "supervisor_watchdog": "Watchdog",
    "supervisor_position_low": "Least position",
    "supervisor_position_high": "Largest position",
    "supervisor_velocity_limit": "Velocity limit",
    "supervisor_runaway": "Runaway after",
    "supervisor_saturated": "Saturated for",
    "supervisor_loss": "Channel lost for",
    "supervisor_reference": "Arming needs the index",
    "supervisor_turn": "Counts of a turn",
    "supervisor_index_tolerance": "Index tolerance",
    "output_slew_limit": "Slew limit",
    "levant_output": "Output u1 in place of u",
    "drive_invert": "Motor inverted",
    "encoder_invert": "Encoder inverted",
    "encoder_glitch_clocks": "Glitch filter, clocks",
}
"""The names of words on the page; other words keep their own names."""


class Group(Enum):
    """The groups of words by purpose; the value is the heading."""

    WALL = "Wall"
    ESTIMATOR = "Estimator"
    LIMITS = "Limits"
    WIRING = "Wiring and monitors"


WIRING = (
    *("supervisor_loss", "supervisor_reference", "supervisor_turn", "supervisor_index_tolerance", "drive_invert"),
    *("encoder_invert", "encoder_glitch_clocks", "output_slew_limit"),
)


class Way(Enum):
    """How a value goes along its slider, whose positions are 0 to 1."""

    SWITCH = "switch"
    LINEAR = "linear"
    DECADES = "decades"
    CUBE = "cube"


@dataclass(frozen=True)
class Knob:
    """A word as a page shows it.

    Attributes:
        name: the word's name; label: its name on the page; group: its purpose.
        unit: the unit that is shown; scale: how many of it the SI unit has.
        least, most, step: the word's range and its 1, in SI units.
        way: how a value goes along the slider: `DECADES` for values that a hand feels by ratios; `CUBE` for signed
            values, fine near 0.
        whole: whether there is nothing between two values.
    """

    name: str
    label: str
    group: Group
    unit: str
    scale: float
    least: float
    most: float
    step: float
    way: Way
    whole: bool

    @property
    def spoken(self) -> str:
        """Its name with the unit, for places without the unit beside it."""
        return f"{self.label}, {self.unit}" if self.unit else self.label

    def to_slider(self, value: float) -> float:
        """Return the slider's position, 0 to 1, of an SI value."""
        if self.way is Way.DECADES:
            return 1 + math.log10(value / self.most) / DECADES if value > self.most / 10**DECADES else 0.0
        if self.way is Way.CUBE:
            return (1 + math.cbrt(value / max(self.most, -self.least))) / 2
        return (value - self.least) / (self.most - self.least)

    def from_slider(self, place: float) -> float:
        """Return the SI value of a slider's position, within the word's range."""
        if self.way is Way.DECADES:
            return max(self.most * 10 ** (DECADES * (place - 1)), self.least) if place > 0 else self.least
        if self.way is Way.CUBE:
            value = max(self.most, -self.least) * (2 * place - 1) ** 3
        else:
            value = self.least + place * (self.most - self.least)
            value = float(round(value)) if self.whole and self.way is Way.LINEAR else value
        return min(max(value, self.least), self.most)

    def shown(self, value: float) -> float:
        """Return an SI value in the unit that is shown, with no more digits than the word has."""
        digits = 1 - math.floor(math.log10(self.step * self.scale))
        return round(value * self.scale, max(digits, 0))

    def in_si(self, value: float) -> float:
        """Return the SI value of what is shown."""
        return value / self.scale


class Field:
    """The text in a knob's field; it distinguishes a look from a wish."""

    def __init__(self, knob: Knob):
        self._knob, self._stands = knob, math.nan

    def show(self, value: float) -> float:
        """Return the text of an SI value in the field, with as many digits as the field itself keeps."""
        self._stands = float(DIGITS % self._knob.shown(value))
        return self._stands

    def takes(self, typed: float | None) -> bool:
        """Take a typed text; return whether it is a wish: not empty, and other than before."""
        if typed is None or typed == self._stands:
            return False
        self._stands = typed
        return True


def knob_of(word: Register) -> Knob:
    """Return a word as a page shows it."""
    unit, scale = UNITS.get(word.unit, (word.unit, 1.0))
    least, most = word.low * word.lsb, word.high * word.lsb
    label = LABELS.get(word.name, word.name.replace("_", " ").capitalize())
    return Knob(word.name, label, _group(word.name), unit, scale, least, most, word.lsb, _way(word), is_whole(word))


def knobs_of(device: Device) -> tuple[Knob, ...]:
    """Return all settings of a board, in the order of its map."""
    words = (*device.of_kind(Kind.WORD), *device.of_kind(Kind.LIVE))
    return tuple(knob_of(word) for word in words if word.name not in HIDDEN and not word.name.startswith(CAPTURE))


def _group(name: str) -> Group:
    if name in WIRING:
        return Group.WIRING
    if name.startswith(("wall_", "free_")):
        return Group.WALL
    return Group.LIMITS if name.startswith("supervisor_") else Group.ESTIMATOR


def _way(word: Register) -> Way:
    if (word.low, word.high, word.unit) == (0, 1, ""):
        return Way.SWITCH
    if word.low < 0:
        return Way.CUBE
    return Way.DECADES if word.name in BY_RATIO else Way.LINEAR
