"""A netlist without its registers and memories: what stands for them loses nothing that tells two of them apart."""

import pytest

from signoff.mutation.cutting import OWN, TO_MEMORY, cut, joined, part_from_memories, registers
from signoff.mutation.netlist import BLOCK
from signoff.mutation.solver import answer


def test_registers_become_ports_or_any_value_or_stay():
    pins = {"CLK": [1], "D": [2, 3], "Q": [4, 5]}
    cell = {"type": "$dff", "connections": pins, "parameters": {"WIDTH": f"{2:032b}"}}
    free, stays = ({"ports": {}, "netnames": {}, "cells": {"one": cell}} for _ in range(2))
    assert registers(free) == {("one", 0), ("one", 1)}
    assert cut(free, {("one", 1)}, free=True) == {"D_0": [("one", 1)]}
    assert {name: port["bits"] for name, port in free["ports"].items()} == {"D_0": [3], "Q_0": [5]}
    assert free["cells"]["one"]["connections"] == {"Q": [4]}
    cut(stays, {("one", 1)}, free=False)
    assert stays["cells"]["one"]["connections"] == {"CLK": [1], "D": [2], "Q": [4]}
    stays["netnames"]["register"] = {"bits": [4, 5], "attributes": {"init": "10"}}
    assert "reg [0:0] in_Q_0 = 1'b1;" in joined(stays)
    with pytest.raises(ValueError, match=r"not \$adff$"):
        registers({"cells": {"one": {"type": "$adff"}}})


@pytest.mark.parametrize(("other", "equal"), [("one", True), ("two", False)])
def test_two_registers_of_any_value_are_never_taken_for_one(other, equal, tmp_path):
    """What stands for them is alike and has no inputs, and what is alike is merged."""
    outputs = {"one": 4, "two": 5}
    cells = {name: {"type": "$dff", "connections": {"CLK": [2], "D": [3], "Q": [bit]}} for name, bit in outputs.items()}
    module = {"attributes": {}, "ports": {}, "netnames": {}, "cells": cells}
    cut(module, set(), free=True)
    assert [cell["type"] for cell in cells.values()] == ["free", "free"]
    cells["unlike"] = {
        "type": "$xor",
        "parameters": {"A_SIGNED": 0, "B_SIGNED": 0, "A_WIDTH": 1, "B_WIDTH": 1, "Y_WIDTH": 1},
        "port_directions": {"A": "input", "B": "input", "Y": "output"},
        "connections": {"A": [outputs["one"]], "B": [outputs[other]], "Y": [6]},
    }
    module["ports"] = {"trigger": {"direction": "output", "bits": [6]}}
    design = {"creator": "", "modules": {BLOCK: module}}
    said = answer(tmp_path, design, [], BLOCK, "-ignore_unknown_cells -prove trigger 0")
    assert ("SUCCESS" in said, "FAIL" in said) == (equal, not equal)


def test_memories_become_ports_if_their_clocks_and_resets_are_the_modules_own():
    def module(**other: list[int | str]) -> dict:
        # The memory's words have two bits, of which the module's output shows the lower one alone.
        ports = {"clk": {"direction": "input", "bits": [2]}, "rst": {"direction": "input", "bits": [3]}}
        ports["shown"] = {"direction": "output", "bits": [15]}
        pins = {port: [number, 10 + number] for number, port in enumerate((*TO_MEMORY, "RD_DATA"), 10)}
        pins |= {"RD_CLK": ["0"], "WR_CLK": [2], "RD_ARST": ["0"], "RD_SRST": [3], **other}
        ways = {port: "output" if port == "RD_DATA" else "input" for port in pins}
        memory = {"type": "$mem_v2", "parameters": {"WIDTH": "10"}, "port_directions": ways, "connections": pins}
        return {"ports": ports, "cells": {"cells": memory}}

    parted = module()
    part_from_memories(parted)
    assert parted["cells"] == {}
    assert parted["ports"]["M_0_WR_DATA"] == {"direction": "output", "bits": [13]}
    assert parted["ports"]["M_0_WR_ADDR"] == {"direction": "output", "bits": [12, 22]}
    assert parted["ports"]["M_0_RD_DATA"] == {"direction": "input", "bits": [15, 25]}
    for port, own in OWN.items():
        # A bit of the module, and the module's other input.
        for bit in (9, 2 if own == "rst" else 3):
            said = rf"^{port} of the memory cells must be the module's input {own}, or 0$"
            with pytest.raises(ValueError, match=said):
                part_from_memories(module(**{port: [bit]}))
        alone = module(**{port: [9]})
        del alone["ports"][own]
        with pytest.raises(ValueError, match="must be"):
            part_from_memories(alone)
