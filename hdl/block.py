"""A component whose formats and latency are those of its twin in `hardwall.model`."""

from abc import abstractmethod

from amaranth.lib import wiring
from amaranth.lib.wiring import Member


class Block(wiring.Component):
    """A component whose formats and latency come from its twin's `Design`.

    A subclass names that class as `design_class` and says by `members` what its ports are.

    Raises
    ------
    TypeError
        If `design` is not of that class.
    """

    def __init__(self, design):
        kind = self.design_class
        if not isinstance(design, kind):
            raise TypeError(f"design must be a {kind.__module__.rpartition('.')[2]}.{kind.__name__}, not {design!r}")
        self._design = design
        super().__init__(self.members(design))

    @staticmethod
    @abstractmethod
    def members(design) -> dict[str, Member]:
        """Return the members for a design."""

    @property
    def design(self):
        """The design that this is the hardware of."""
        return self._design

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `valid`."""
        return self._design.latency
