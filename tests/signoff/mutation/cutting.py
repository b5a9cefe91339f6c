"""A netlist as Yosys writes it, with ports in the place of registers and memories, and two of them side by side."""

from itertools import count

from .netlist import SELECTOR

START, FIRST = "START", "FIRST"
"""The ports of the first values of registers that have none of their own, and of the clock at which these hold."""
TO_MEMORY = ("RD_ADDR", "RD_EN", "WR_ADDR", "WR_DATA", "WR_EN")
TO_EVERY_BIT = "WR_DATA", "WR_EN"
"""Those that have a bit for every bit of a word, for one write port after the other."""
OWN = {"RD_CLK": "clk", "WR_CLK": "clk", "RD_ARST": "rst", "RD_SRST": "rst"}
"""What else goes to a memory, and the input of the module that it must be, if it is not left at 0."""

Bit = tuple[str, int]
"""A bit of a register: the name of its cell, and its place in it."""


def registers(module: dict) -> set[Bit]:
    """Return all bits of the registers of a module.

    Raises:
        ValueError: if a register is of a kind that this does not know.
    """
    found = set()
    for name, cell in module["cells"].items():
        if "ff" in cell["type"] or "latch" in cell["type"]:
            if cell["type"] != "$dff":
                raise ValueError(f"a register must be a $dff, not {cell['type']}")
            found |= {(name, place) for place in range(len(cell["connections"]["Q"]))}
    return found


def cut(module: dict, kept: set[Bit], free: bool) -> dict[str, list[Bit]]:
    """Put ports of the module in the place of some bits of its registers; return the bits of each port of next values.

    The other bits stay registers, or if `free` is true, have any value at any time.
    """
    ports: dict[str, list[Bit]] = {}
    for number, name in enumerate(sorted({name for name, _ in registers(module)})):
        cell = module["cells"].pop(name)
        pins = cell["connections"]
        mine, rest = [], []
        for place in range(len(pins["Q"])):
            (mine if (name, place) in kept else rest).append(place)
        if mine:
            ports[f"D_{number}"] = [(name, place) for place in mine]
            for port, direction in (("D", "output"), ("Q", "input")):
                module["ports"][f"{port}_{number}"] = {"direction": direction, "bits": [pins[port][n] for n in mine]}
        if rest and free:
            # The solver takes a cell that it does not know for one with any outputs.
            pins = {"Q": [pins["Q"][n] for n in rest]}
            module["cells"][name] = {"type": "free", "port_directions": {"Q": "output"}, "connections": pins}
        elif rest:
            connections = {port: [bits[n] for n in rest] if port in "DQ" else bits for port, bits in pins.items()}
            parameters = {**cell["parameters"], "WIDTH": f"{len(rest):032b}"}
            module["cells"][name] = {**cell, "connections": connections, "parameters": parameters}
    return ports


def part_from_memories(module: dict) -> None:
    """Put ports of the module in the place of its memories: their contents are equal while equal writes go there.

    A bit of a word that nothing reads is written for nobody, and so is no output.

    Raises:
        ValueError: if a memory's clock or reset is not the module's: two of them may then not be equal.
    """
    memories = [name for name, cell in module["cells"].items() if cell["type"] == "$mem_v2"]
    read = _read(module)
    for number, name in enumerate(memories):
        cell = module["cells"].pop(name)
        pins, width = cell["connections"], int(cell["parameters"]["WIDTH"], 2)
        unread = [place for place in range(width) if read.isdisjoint(pins["RD_DATA"][place::width])]
        for port in TO_EVERY_BIT:
            pins[port] = [bit for place, bit in enumerate(pins[port]) if place % width not in unread]
        for port, own in OWN.items():
            if not set(pins[port]) <= {"0", *module["ports"].get(own, {"bits": []})["bits"]}:
                raise ValueError(f"{port} of the memory {name} must be the module's input {own}, or 0")
        for port in (*TO_MEMORY, "RD_DATA"):
            direction = "output" if port in TO_MEMORY else "input"
            module["ports"][f"M_{number}_{port}"] = {"direction": direction, "bits": pins[port]}


def _read(module: dict) -> set[int | str]:
    """Return the bits that a cell or an output of a module takes."""
    taken = [port["bits"] for port in module["ports"].values() if port["direction"] == "output"]
    for cell in module["cells"].values():
        taken += [cell["connections"][port] for port, way in cell["port_directions"].items() if way == "input"]
    return {bit for bits in taken for bit in bits}


def first_values(module: dict) -> dict[int, str]:
    """Return the value at power-up, 0 or 1, of every bit that has one."""
    initial = {}
    for net in module["netnames"].values():
        bits = zip(net["bits"], reversed(net["attributes"].get("init", "")), strict=False)
        initial |= {bit: value for bit, value in bits if value in "01"}
    return initial


def start_alike(module: dict) -> None:
    """Give every register without a first value that of a port, which is the same for the two that are compared.

    The solver would choose one for each of the two, and find that they differ from power-up on.
    """
    initial = first_values(module)
    numbers = count(1 + max(bit for net in module["netnames"].values() for bit in net["bits"] if isinstance(bit, int)))
    first, start = next(numbers), []
    for name, cell in [(name, cell) for name, cell in module["cells"].items() if cell["type"] == "$dff"]:
        pins = cell["connections"]
        seen = [bit for bit in pins["Q"] if bit not in initial]
        if seen:
            held, given = ([next(numbers) for _ in seen] for _ in range(2))
            renamed = dict(zip(seen, held, strict=True))
            pins["Q"] = [renamed.get(bit, bit) for bit in pins["Q"]]
            module["cells"][f"{START}_{name}"] = {
                "type": "$mux",
                "parameters": {"WIDTH": f"{len(seen):032b}"},
                "port_directions": {"A": "input", "B": "input", "S": "input", "Y": "output"},
                "connections": {"A": held, "B": given, "S": [first], "Y": seen},
            }
            start += given
    if start:
        module["ports"][START] = {"direction": "input", "bits": start}
        module["ports"][FIRST] = {"direction": "input", "bits": [first]}


def joined(module: dict) -> str:
    """Return Verilog of `machine`: the two side by side, with one register for both in the place of their ports."""
    initial = first_values(module)
    heads, inside, pins = ["output trigger"], [], ["trigger"]
    for name, port in module["ports"].items():
        width, number = f"[{len(port['bits']) - 1}:0]", name.removeprefix("Q_")
        if port["direction"] == "output":
            heads += [f"output {width} {side}_{name}" for side in ("gold", "gate")]
            pins += [f"{side}_{name}" for side in ("gold", "gate")]
        elif name.startswith("Q_"):
            bits = "".join(initial.get(bit, "x") for bit in reversed(port["bits"]))
            inside.append(f"reg {width} in_{name} = {len(bits)}'b{bits};")
            inside.append(f"always @(posedge of_both) in_{name} <= gold_D_{number};")
            pins.append(f"in_{name}")
        elif name == FIRST:
            inside.append(f"reg in_{name} = 1'b1;")
            inside.append(f"always @(posedge of_both) in_{name} <= 1'b0;")
            pins.append(f"in_{name}")
        elif name != SELECTOR:
            heads.append(f"input {width} in_{name}")
            pins.append(f"in_{name}")
    connected = ", ".join(f".{name}({name})" for name in pins)
    lines = ["module machine(input of_both, " + ", ".join(heads) + ");", *inside, f"miter miter({connected});"]
    return "\n".join([*lines, "endmodule"]) + "\n"
