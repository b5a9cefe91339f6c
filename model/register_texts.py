"""The texts that are made from a register map: a Markdown page, a C header and JSON."""

import json
from collections.abc import Iterator

from .axes.capture import Design as OfAxes
from .axes.registers import BANK, AxesMap
from .axis.capture import DONE, RECORD_REGISTERS, SOURCES, STATES, Design
from .axis.registers import ACTIVE, CAPTURE, EVENTS, LAYOUT, MAP, WRITTEN, RegisterMap
from .axis.supervisor import ARMED, CAUSES, DISARMED, TRIPPED
from .register import Register

COLUMNS = ("address", "register", "kind", "access", "format", "one LSB", "range", "reset", "meaning")


def _row(register: Register) -> str:
    unit = f" {register.unit}" if register.unit else ""
    cells = (
        f"0x{register.address:04X}",
        f"`{register.name}`",
        register.kind.value,
        register.kind.access,
        str(register.format),
        f"{register.lsb:.6g}{unit}" if unit else "",
        f"{register.low} to {register.high}",
        str(register.reset),
        register.meaning,
    )
    return f"| {' | '.join(cells)} |\n"


def _window(capture: Design) -> str:
    """Return what is said of the window to the capture memory."""
    flags = ", ".join(f"bit {bit} {name}" for bit, name in enumerate(capture.flags))
    several = "It takes the axis that capture_axis names at capture_start. " if isinstance(capture, OfAxes) else ""
    return (
        f"The capture memory of {RECORD_REGISTERS * capture.records} registers begins at 0x{CAPTURE:04X} with the "
        f"oldest of {capture.records} records. A record has two registers each of count, velocity and driven, as the "
        f"status of these names, then one of flags ({flags}), and one with the lower bits of the number of the clock "
        f"{capture.stamp_clocks} clocks behind its sample. {several}It can be read while capture_state is {DONE}; "
        "before it is refused.\n"
    )


def _of_status(registers: RegisterMap) -> str:
    """Return the text on values that a frame reads together, and on banks if there are several."""
    if isinstance(registers, AxesMap):
        once = ", ".join(f"`{each.name}`" for each in registers.shared)
        return (
            f"These are the registers of axis 0; those of axis k are k times 0x{BANK:04X} above them, for "
            f"{registers.banks} axes in all. The constants, the counters and {once} there are once, here. What a frame "
            "reads of an axis's status is of one sample; the stamps of edges are those of the last edges in its count."
        )
    return (
        "What a frame reads of the status is of one clock, but for the stamps of edges, the counts of causes, and "
        f"{', '.join(EVENTS)}: these are taken soon after it, each whole."
    )


def markdown(registers: RegisterMap) -> str:
    """Return the page `registers.md`: every register in the order of addresses, and the windows."""
    head = f"| {' | '.join(COLUMNS)} |\n|{' --- |' * len(COLUMNS)}\n"
    windows = [
        f"The compressed map (zlib, JSON) of {len(registers.compressed)} bytes begins at 0x{MAP:04X}, two bytes a "
        "register, the first one high.\n",
        _window(registers.capture) if registers.capture else "",
    ]
    return (
        f"# Registers\n\nIdentity {registers.identity}, layout {LAYOUT}. Modbus RTU, unit 1. A value of two registers "
        "has the high one first; half of one can be neither read nor written. A value whose format is signed (SQ) is "
        "two's complement, its sign extended to all bits of its registers. Words that are written become active "
        f"together, by `commit`; the active word of each is at 0x{ACTIVE - WRITTEN:02X} above it. "
        f"{_of_status(registers)}\n\n"
        + head
        + "".join(map(_row, registers.registers))
        + "\n"
        + "\n".join(filter(None, windows))
    )


SIGNS = (
    "A value of two registers has the high one first. One whose NAME_SIGNED is 1 is two's complement, its sign "
    "extended to all bits of its registers: take the 32 bits for an int32_t."
)
"""How a negative value looks."""


def _choices(registers: RegisterMap) -> Iterator[tuple[str, str]]:
    """Yield the names and values of states and masks, for C."""
    for state, number in (("DISARMED", DISARMED), ("ARMED", ARMED), ("TRIPPED", TRIPPED)):
        yield f"STATE_{state}", f"{number}"
    # Of `latched`, `first`, `acknowledged` and `supervisor_causes`.
    for bit, cause in enumerate(CAUSES):
        yield f"CAUSE_{cause.name.upper()}", f"0x{1 << bit:X}"
    for bit, flag in enumerate(registers.spec.design.flags):
        yield f"FLAG_{flag.upper()}", f"0x{1 << bit:X}"
    if registers.capture:
        for number, state in enumerate(STATES):
            yield f"CAPTURE_STATE_{state}", f"{number}"
        for bit, source in enumerate(SOURCES):
            yield f"CAPTURE_SOURCE_{source.upper()}", f"0x{1 << bit:X}"


def c_header(registers: RegisterMap) -> str:
    """Return the header `registers.h`: states and masks; of every register its address, sign, LSB's SI value, range."""
    lines = [
        f"/* Registers of a hardwall axis; identity {registers.identity}, layout {LAYOUT}. */",
        "#ifndef HARDWALL_REGISTERS_H",
        "#define HARDWALL_REGISTERS_H",
        "",
        f'#define HARDWALL_IDENTITY "{registers.identity}"',
        f"#define HARDWALL_MAP 0x{MAP:04X}",
        f"#define HARDWALL_CAPTURE 0x{CAPTURE:04X}",
    ]
    if isinstance(registers, AxesMap):
        lines += [f"#define HARDWALL_AXES {registers.banks}", f"#define HARDWALL_BANK 0x{BANK:04X}"]
    lines += [
        "",
        "/* States of `state` and of the capture; masks of causes, of flags and of what triggers a capture. */",
    ]
    lines += [f"#define HARDWALL_{name} {value}" for name, value in _choices(registers)]
    lines += ["", f"/* {SIGNS} */"]
    for register in registers.registers:
        name = f"HARDWALL_{register.name.upper()}"
        unit = f" in {register.unit}" if register.unit else ""
        lines += ["", f"/* {register.meaning} ({register.kind.value}, {register.format}) */"]
        lines.append(f"#define {name} 0x{register.address:04X}")
        lines.append(f"#define {name}_SIGNED {int(register.format.signed)}")
        lines.append(f"#define {name}_LSB {register.lsb!r} /* one LSB{unit} */")
        if register.kind.access != "read":
            lines += [f"#define {name}_MIN ({register.low})", f"#define {name}_MAX ({register.high})"]
    return "\n".join([*lines, "", "#endif", ""])


def as_json(registers: RegisterMap) -> str:
    """Return the whole map as JSON, with meanings and with the values of the constants."""
    rows = [
        {
            "name": register.name,
            "address": register.address,
            "registers": register.size,
            "kind": register.kind.value,
            "access": register.kind.access,
            "signed": register.format.signed,
            "bits": register.format.width,
            "si_per_lsb": register.lsb,
            "unit": register.unit,
            "least": register.low,
            "most": register.high,
            "reset": register.reset,
            "meaning": register.meaning,
        }
        for register in registers.registers
    ]
    described = {
        "layout": LAYOUT,
        "identity": registers.identity,
        "map_address": MAP,
        "map_bytes": len(registers.compressed),
        "capture_address": CAPTURE,
        "capture_registers": registers.capture_registers,
        **({"banks": registers.banks, "bank": BANK} if isinstance(registers, AxesMap) else {}),
        "registers": rows,
    }
    return json.dumps(described, indent=2) + "\n"
