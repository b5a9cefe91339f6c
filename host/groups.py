"""The words of a board as attributes, in SI units: of its wall, of free space, and of what limits its drive."""

import difflib
from typing import Protocol


class Words(Protocol):
    """An object with words by name."""

    def get(self, name: str) -> float:
        """Return the SI value that is used."""

    def set(self, **values: float) -> None:
        """Write SI values."""


class Value:
    """An attribute that stands for a word of the board: reading it returns the value in use, setting it writes and
    commits.

    Args:
        meaning: what the word is, with its unit.
    """

    def __init__(self, meaning: str):
        self.__doc__ = meaning

    def __set_name__(self, owner: type["Group"], name: str) -> None:
        self._name = f"{owner.PREFIX}{name}"

    def __get__(self, group: "Group", owner: type["Group"]) -> float:
        return group.words.get(self._name)

    def __set__(self, group: "Group", value: float) -> None:
        group.words.set(**{self._name: value})


class Named:
    """A group of attributes that refuses unknown names: a misspelt one would silently leave the board unchanged.

    It has what its class has or annotates, and whatever begins with an underscore.
    """

    __slots__ = ()

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute.

        Raises:
            AttributeError: if there is no attribute of that name; the message suggests a similar one.
        """
        kind = type(self)
        known = {*dir(kind), *kind.__annotations__}
        if name not in known and not name.startswith("_"):
            near = difflib.get_close_matches(name, [each for each in known if not each.startswith("_")], 1)
            meant = f"; did you mean {near[0]}?" if near else ""
            raise AttributeError(f"{kind.__name__} has no attribute {name}{meant}")
        object.__setattr__(self, name, value)


class Group(Named):
    """Words whose names begin alike.

    Attributes:
        words: what has all words of the board.
    """

    __slots__ = ("words",)
    PREFIX = ""

    def __init__(self, words: Words):
        self.words = words


class Wall(Group):
    """The virtual wall. Every attribute is written and committed when it is set; `Axis.set` takes several at once."""

    __slots__ = ()
    PREFIX = "wall_"
    stiffness = Value("The spring, N/m.")
    damping = Value("The damper, N s/m.")
    position = Value("Where the wall begins, m.")
    left = Value("1 if the wall is on the side of lower positions, else 0.")
    forbid_pull = Value("1 if the wall may not pull the handle in, else 0.")
    velocity = Value("The velocity of its surface, m/s; of a board with a coupling alone.")
    two_sided = Value("1 if the wall holds on both sides, if it may pull, else 0; of a board with a coupling alone.")
    mass = Value("The virtual mass where the wall has a force, kg; of a board with a virtual mass alone.")


class FreeSpace(Group):
    """What the handle feels where the wall has no force. Every attribute is written and committed when it is set."""

    __slots__ = ()
    PREFIX = "free_"
    mass = Value("The virtual mass there, kg; below 0 to lighten the handle; of a board with a virtual mass alone.")


class Supervisor(Group):
    """The limits of the drive. They act at once. Their ranges, and what they are after reset, are the board's."""

    __slots__ = ()
    PREFIX = "supervisor_"
    force_limit = Value("The largest drive either way, N.")
    ramp = Value("The rise of the limit after arming, N/s.")
    watchdog = Value("The longest time between two beats of the host, s.")
    causes = Value("The causes that trip, a bit each.")
    reference = Value("1 if arming needs a reference, which is an origin shifted since the index was found, else 0.")
    position_low = Value("The least position, m.")
    position_high = Value("The largest position, m.")
    velocity_limit = Value("The largest estimated speed, m/s.")
    runaway = Value("The longest way against a drive at its limit, m.")
    saturated = Value("The longest time for which the estimator may be saturated, s.")
    loss = Value("The longest time for which a channel may equal its complement, s.")
    turn = Value("The counts of a turn.")
    index_tolerance = Value("The counts by which an index may be off.")
