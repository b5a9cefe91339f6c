"""What is synthesised: Amaranth components, each held bit for bit to its twin of the same name in `hardwall.model`."""

from collections.abc import Callable

from amaranth.hdl import signed
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from hardwall.model.quadrature import RUN_MAX

from .fixed import shape


def check_int(name: str, value: int, least: int, most: int | None = None) -> None:
    """Raise TypeError unless `value` is an int, ValueError unless it is `least` to `most` (None: no end)."""
    if isinstance(value, bool) or not isinstance(value, int):
        raise TypeError(f"{name} must be an int, not {value!r}")
    if value < least or (most is not None and value > most):
        accepted = f"{least} or more" if most is None else f"{least} to {most}"
        raise ValueError(f"{name} must be {accepted}, not {value!r}")


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


class EstimatorBlock(Block):
    """A velocity estimator: the members that all of them have; a subclass adds what happens between them.

    Parameters
    ----------
    design : Design
        Of its twin; `kind` is the class that it must be of.

    Members
    -------
    strobe : In(1)
        Takes a sample.
    restart : In(1)
        With `strobe`: this sample counts as the first.
    one input for each of `design.inputs` : In
        Outputs of the decoder, by the same names, valid with `strobe`: `count` is the position, counts, and may wrap.
    one input for each of `design.words` : In
        Run-time parameters; constant from a `strobe` to its `valid`.
    velocity : Out(SQ)
        Counts a sample, `design.velocity`; valid from `valid` until the next.
    saturated : Out
        With `valid`: bits as `design.flags`.
    valid : Out(1)
        High for one clock. The next `strobe` may come with it.

    Raises
    ------
    TypeError
        If `design` is not of that class.
    """

    def __init__(self, design, kind: type):
        def members() -> dict:
            seen = {"count": signed(design.count_width), "edge": 2, "down": 1, "run": range(RUN_MAX + 1)}
            return {
                "strobe": In(1),
                "restart": In(1),
                **{name: In(design.stamp_width if name[:5] == "stamp" else seen[name]) for name in design.inputs},
                **{word.name: In(shape(word.format)) for word in design.words},
                "velocity": Out(shape(design.velocity)),
                "saturated": Out(len(design.flags)),
                "valid": Out(1),
            }

        super().__init__(design, kind, members)
