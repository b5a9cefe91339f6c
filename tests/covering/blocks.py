"""The blocks whose coverage is counted, and the tests that cover each."""

from dataclasses import dataclass
from pathlib import Path

from hardwall.model.estimators.registry import ESTIMATORS

TESTS = Path(__file__).parent.parent


@dataclass(frozen=True)
class Block:
    """A block of the hardware.

    Attributes:
        name: its path below `hdl`.
        modules: its modules below the top of its test. Blocks inside it have tests of their own.
        tested_with: the block whose tests are its own, too, if any.
    """

    name: str
    modules: tuple[str, ...] = ("component",)
    tested_with: str = ""

    @property
    def test(self) -> Path:
        """The file of its tests."""
        folder, _, stem = (self.tested_with or self.name).rpartition("/")
        return TESTS / folder / f"test_{stem}.py"


RECORDED = ("component.component",)
"""The module of a block that a recorder feeds."""
BLOCKS = (
    *(Block(f"arithmetic/{name}") for name in ("divide", "divisionless", "signed_divide", "sqrt")),
    *(Block(f"estimators/{name}") for name in ("bursts", "cycle_times", "history", "kept_edges")),
    *(Block("estimators/finite_difference" if n == "fdm" else f"estimators/{n.replace('-', '_')}") for n in ESTIMATORS),
    Block("quadrature", RECORDED),
    Block("scale_map", RECORDED),
    Block("wall", ("component.law",)),
    Block("passivity", ("component.controller",)),
    Block("output", ("component.stage",)),
    Block("monitors", RECORDED),
    Block("supervisor", RECORDED),
    Block("clock_monitor", RECORDED),
    Block("watchdog", RECORDED),
    *(Block(f"drive/{name}", RECORDED) for name in ("scale", "pdm", "pwm", "dac")),
    Block("capture", RECORDED),
    Block("axes_capture", RECORDED),
    Block("axis"),
    Block("axes"),
    Block("supervised", RECORDED),
    Block("supervised_axes", RECORDED),
    Block("link/uart", ("component.receiver", "component.transmitter")),
    Block("link/line", ("component.line",)),
    Block("link/register_file"),
    Block("link/banked_file", RECORDED),
    Block("link/server", ("component.server",)),
    Block("link/link", ("component.link",)),
    Block("link/axi", ("component.link.subordinate",)),
    Block("link/axi_link", ("component.link",), tested_with="link/axi"),
    Block("board", ("component.board",)),
    Block("axes_board", ("component.board",)),
)
