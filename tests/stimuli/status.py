"""Status shown to a link, as an axis shows it."""

from typing import Any

from cocotb.triggers import RisingEdge

from hardwall.model.axis.registers import EDGE_STAMPS, RegisterMap
from hardwall.testing import Bench


def edge(registers: RegisterMap, name: str, stamp: int) -> dict[str, int]:
    """Return what is at a link's inputs in the clock behind the one whose stamp an edge has."""
    stamps = 1 << registers["stamp"].format.width
    return {"stepped": 1, "edge_kind": EDGE_STAMPS.index(name), "stamp": (stamp + 1) % stamps}


async def show(dut: Any, bench: Bench, registers: RegisterMap, status: dict[str, int]) -> None:
    """Show status: the stamps of edges by an edge of every kind, and then the rest at its inputs."""
    for name in EDGE_STAMPS:
        bench.drive(**edge(registers, name, status[name]))
        await RisingEdge(dut.clk)
    bench.drive(stepped=0, **{name: word for name, word in status.items() if name not in EDGE_STAMPS})
