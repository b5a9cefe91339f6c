"""The base class of components that take their formats and latency from their twin in `hardwall.model`."""

from abc import abstractmethod

from amaranth.lib import wiring
from amaranth.lib.wiring import Member


class Block(wiring.Component):
    """A component that takes its formats and latency from its twin's `Design`.

    A subclass gives that class as `design_class` and its ports by `members`.

    Raises
    ------
    TypeError
        If `design` is not a `design_class`.
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
        """The design that this component implements."""
        return self._design

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `valid`."""
        return self._design.latency
