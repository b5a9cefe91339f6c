"""The blocks whose coverage is counted, and the tests that cover each."""

from dataclasses import dataclass
from pathlib import Path

from hardwall.hdl.estimators.registry import ESTIMATORS

TESTS = Path(__file__).parents[2]


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
    *(Block(f"arithmetic/{name}") for name in ("curves", "divide", "divisionless", "powers", "signed_divide", "sqrt")),
    *(Block(f"estimators/{name}") for name in ("bursts", "cycle_times", "history", "kept_edges")),
    *(
        Block(f"estimators/{name}")
        for name in dict.fromkeys(e.__module__.rpartition(".")[2] for e in ESTIMATORS.values())
    ),
    Block("encoder/quadrature", RECORDED),
    Block("encoder/scale_map", RECORDED),
    Block("axis/wall", ("component.law",)),
    Block("axis/passivity", ("component.controller",)),
    Block("axis/virtual_mass", ("component.mass",)),
    Block("axis/output", ("component.stage",)),
    Block("axis/monitors", RECORDED),
    Block("axis/supervisor", RECORDED),
    Block("board/clock_monitor", RECORDED),
    Block("axis/watchdog", RECORDED),
    *(Block(f"drive/{name}", RECORDED) for name in ("scale", "pdm", "pwm", "dac")),
    Block("axis/capture", RECORDED),
    Block("axes/capture", RECORDED),
    Block("axis/axis"),
    Block("axes/axis"),
    Block("axis/supervised", RECORDED),
    Block("axes/supervised", RECORDED),
    Block("link/uart", ("component.receiver", "component.transmitter")),
    Block("link/line", ("component.line",)),
    Block("axis/register_file"),
    Block("axes/register_file", RECORDED),
    Block("link/server", ("component.server",)),
    Block("link/link", ("component.link",)),
    Block("link/axi", ("component.link.subordinate",)),
    Block("link/axi_link", ("component.link",), tested_with="link/axi"),
    Block("axis/board", ("component.board",)),
    Block("axes/board", ("component.board",)),
)
