"""The C header `registers.h`: how a program on a PC, or on a processor beside the axis, reaches every register.

`c_header` has the registers' meaning, sign, LSB and range, the states and the masks. Here each register also gets its
address for Modbus and, for the AXI4-Lite bus of `axi.v`, its byte offset. The two differ. A value of two registers is a
whole word of the bus, at twice its address. A pulse or a counter is half a word: the upper half if its address is even.
A little-endian processor has the lower half first, so the two halves of a word change places: the offset is twice
`address ^ 1`.
"""

from collections.abc import Iterator

from .axes.registers import AxesMap
from .axis.capture import RECORD_REGISTERS, SOURCES, TAKEN_AT
from .axis.registers import CAPTURE, COUNTS, MAP, RegisterMap
from .axis.supervisor import CAUSES, COUNT_BITS
from .register import COUNTER_BITS, VALUE_BITS, Register
from .register_texts import c_header

END = "#endif\n"
"""The end of a header's guard."""
NAMES = """\
/* Three names of a register NAME:
 *
 *   HARDWALL_NAME_MODBUS   its address on the serial line, for Modbus
 *   HARDWALL_NAME_OFFSET   its offset in bytes on the AXI4-Lite bus of axi.v: add it to the bus's base address
 *   HARDWALL_NAME_BITS     the bits of a load or store on that bus: 32, or 16 of a pulse or counter
 *
 * The offsets are for a little-endian processor. HARDWALL_NAME alone is the address for Modbus, NOT an offset: it is an
 * older name of HARDWALL_NAME_MODBUS, and version 0.3.0 will not have it.
 */
"""
NAMES_OF_AXES = """\
/* HARDWALL_NAME_MODBUS is the address of register NAME on the serial line, for Modbus. HARDWALL_NAME alone is an older
 * name of it, and version 0.3.0 will not have it.
 */
"""


def offset_of(register: Register) -> int:
    """Return the offset of a register on the AXI4-Lite bus (bytes), for a little-endian processor.

    It is twice the address only for a value of two registers. A store at twice the address of `disarm` would arm.
    """
    return 2 * (register.address if register.kind.wide else register.address ^ 1)


def _fields(registers: RegisterMap) -> Iterator[str]:
    """Yield the C lines for fields inside words: shifts of the masked bits, and fields of several bits."""
    for kind, names in (
        ("CAUSE", [cause.name for cause in CAUSES]),
        ("FLAG", registers.spec.design.flags),
        ("CAPTURE_SOURCE", SOURCES if registers.capture else ()),
    ):
        for bit, name in enumerate(names):
            yield f"{kind}_{name.upper()}_SHIFT {bit}"
    for register in registers.registers:
        if register.name in ("state", "flags", "latched", "first", "capture_state"):
            yield f"{register.name.upper()}_MASK 0x{register.format.max:X}"
    for bit, cause in enumerate(CAUSES):
        value, shift = divmod(COUNT_BITS * bit, VALUE_BITS)
        field = f"{COUNTS.upper()}{value}_{cause.name.upper()}"
        yield f"{field}_SHIFT {shift}"
        yield f"{field}_MASK 0x{(1 << COUNT_BITS) - 1 << shift:X}"
    if registers.capture:
        for bit, name in enumerate(registers.capture.flags):
            yield f"RECORD_FLAG_{name.upper()} 0x{1 << bit:X}"
            yield f"RECORD_FLAG_{name.upper()}_SHIFT {bit}"


def _places(registers: RegisterMap) -> Iterator[str]:
    """Yield the address of every register and window for Modbus; of one axis also its offset on the bus."""
    for name, address in (("MAP", MAP), ("CAPTURE", CAPTURE)):
        yield f"{name}_MODBUS 0x{address:04X}"
        if not isinstance(registers, AxesMap):
            yield f"{name}_OFFSET 0x{2 * address:05X}"
    if registers.capture and not isinstance(registers, AxesMap):
        yield f"RECORD_BYTES {2 * RECORD_REGISTERS}"
        yield f"RECORD_FLAGS_OFFSET {2 * (TAKEN_AT['flags'] ^ 1)}"
    for register in registers.registers:
        name = register.name.upper()
        yield f"{name}_MODBUS 0x{register.address:04X}"
        if not isinstance(registers, AxesMap):
            yield f"{name}_OFFSET 0x{offset_of(register):05X}"
            yield f"{name}_BITS {COUNTER_BITS * register.size}"


def header(registers: RegisterMap) -> str:
    """Return the header `registers.h` of a map, for C99 and C++."""
    names, text = NAMES, c_header(registers)
    if isinstance(registers, AxesMap):
        # The constant `axes` is a register; its address has the name that the number of axes has here.
        number = f"{registers.banks}\n"
        names, text = NAMES_OF_AXES, text.replace(f"#define HARDWALL_AXES {number}", f"#define HARDWALL_BANKS {number}")
    lines = [
        text.removesuffix(END).rstrip("\n"),
        "",
        "/* Fields: the shifts of the masks above, fields of several bits, and the flags of a capture's record. */",
        *(f"#define HARDWALL_{field}" for field in _fields(registers)),
        "",
        "/* Where each register is. */",
        *(f"#define HARDWALL_{place}" for place in _places(registers)),
        "",
    ]
    return names + "\n".join([*lines, END])
