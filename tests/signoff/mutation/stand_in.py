"""A component whose hardware is the netlist with its mutants, with the same ports."""

import re

from amaranth.hdl import ClockSignal, Instance, Module, ResetSignal, Signal
from amaranth.lib import wiring
from amaranth.lib.wiring import In

from hardwall.testing.harness import ports_of

from .netlist import BLOCK, SELECTOR, SELECTOR_BITS, Netlist

CHOICE = "choice"
"""The module whose register `SELECTOR` chooses the mutant; cocotb writes it."""
_CHOICE_VERILOG = f"""
module {CHOICE}(output reg [{SELECTOR_BITS - 1}:0] {SELECTOR} /*verilator public_flat_rw*/);
  initial {SELECTOR} = 0;
endmodule
"""


class StandIn(wiring.Component):
    """See above.

    Attributes:
        verilog: the modules that it instantiates.
    """

    def __init__(self, netlist: Netlist):
        super().__init__(netlist.component.signature)
        self.verilog = netlist.verilog + _CHOICE_VERILOG
        # A component has no clock or reset where nothing in it needs one.
        self._inputs = set(re.findall(r"^  input (?:\[\d+:0\] )?(\S+);$", _module(netlist.verilog), re.M))

    def elaborate(self, platform: object) -> Module:
        m = Module()
        ports = ports_of(self)
        chosen = Signal(SELECTOR_BITS)
        m.submodules.choice = Instance(CHOICE, **{f"o_{SELECTOR}": chosen})
        given = {f"{'i' if member.flow == In else 'o'}_{name}": port for name, (member, port) in ports.items()}
        own = {"clk": ClockSignal(), "rst": ResetSignal(), SELECTOR: chosen}
        given |= {f"i_{name}": own[name] for name in own if name in self._inputs and name not in ports}
        m.submodules[BLOCK] = Instance(BLOCK, **given)
        return m


def _module(verilog: str) -> str:
    """Return the text of the module `BLOCK`."""
    return re.search(rf"^module {BLOCK}\(.*?^endmodule$", verilog, re.M | re.S)[0]
