"""A component whose formats and latency are those of its twin in `hardwall.model`."""

from collections.abc import Callable

from amaranth.lib import wiring


class Block(wiring.Component):
    """A component whose formats and latency come from its twin's `Design`.

    `members` is called once the design is known to be one.

    Raises
    ------
    TypeError
        If `design` is not a `kind`.
    """

    def __init__(self, design, kind: type, members: Callable[[], dict]):
        if not isinstance(design, kind):
            name = f"{kind.__module__.rsplit('.', 1)[-1]}.{kind.__name__}"
            raise TypeError(f"design must be a {name}, not {design!r}")
        self._design = design
        super().__init__(members())

    @property
    def design(self):
        """The design that this is the hardware of."""
        return self._design

    @property
    def latency(self) -> int:
        """Clocks from `strobe` to `valid`."""
        return self._design.latency
