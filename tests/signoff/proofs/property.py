"""Properties: a promise of the hardware, how it is proven, and the bugs with which its proof must fail."""

import re
from collections.abc import Callable
from dataclasses import dataclass

from amaranth.back import rtlil

from .bench import Bench
from .bugs import Bug


@dataclass(frozen=True)
class Property:
    """A promise and its proof.

    Attributes:
        promise: what is proven, in words.
        block: the block, and the axis whose formats it has.
        describe: builds the top of the proof on a bench.
        depth: clocks of the induction, or of a bounded proof.
        bounded: whether only the clocks after reset are searched; otherwise the proof is by induction, for ever.
        bugs: each makes a promise fail after a reset.
        quick: whether it is also one of the regressions.
        within: the clocks from power-up in which each bug must show.
    """

    promise: str
    block: str
    describe: Callable[[Bench], None]
    depth: int
    bugs: tuple[Bug, ...]
    bounded: bool = False
    quick: bool = False
    within: int = 30

    @property
    def method(self) -> str:
        return f"{'bounded' if self.bounded else 'induction'}, {self.depth}"

    @property
    def title(self) -> str:
        """The block and the promise, in a line."""
        return f"{self.block}: {self.promise}"

    @property
    def name(self) -> str:
        """A name for files and tests."""
        return "-".join(re.findall(r"\w+", self.title))

    def rtlil(self, bug: Bug | None = None) -> str:
        """Return the top of the proof for Yosys, with a bug in the hardware or without."""
        if bug is None:
            return rtlil.convert(Bench(self.describe), name="top", ports=())
        with bug.seeded():
            return rtlil.convert(Bench(self.describe), name="top", ports=())
