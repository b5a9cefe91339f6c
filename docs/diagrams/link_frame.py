"""A request of the host and its answer on the line, byte by byte, and where the registers lie."""

from typing import NamedTuple

from hardwall.model.axis import registers
from hardwall.model.axis.register_file import Design
from hardwall.model.axis.registers import RegisterMap
from hardwall.model.link.line import UNIT, Line, framed
from hardwall.model.link.server import Server

from .pin_to_drive import spec_of_scene
from .sheet import BLUE, GREEN, GREY, LINE, ORANGE, PURPLE, SMALL, YELLOW, Box, Sheet, Tone, bold, code, small

READ, NAME, VALUE = 3, "count", -3
"""The function that the host asks for, the register that it reads, and the value that the axis has."""
BYTE, LEFT = 46, 160


class Field(NamedTuple):
    """Bytes of a frame that belong together."""

    name: str
    data: bytes
    tone: Tone


class Block(NamedTuple):
    """A block of registers: its name, its first address and the one behind it, and what is in it."""

    name: str
    first: int
    end: int
    tone: Tone


def frames() -> tuple[bytes, bytes]:
    """Return the request and the answer, as the model of the device gives it."""
    known = RegisterMap(spec_of_scene())
    register, server, line = known[NAME], Server(Design(known)), Line()
    server.file.status[NAME] = VALUE
    request = framed(bytes([UNIT, READ]) + register.address.to_bytes(2, "big") + register.size.to_bytes(2, "big"))
    *_, verdict = map(line.receive, request)
    answer = server.take(verdict, request)
    return request, framed(answer or b"")


def fields(frame: bytes, answer: bool) -> tuple[Field, ...]:
    """Return the fields of a request to read, or of its answer."""
    unit, function = Field("unit", frame[:1], GREY), Field("function", frame[1:2], BLUE)
    crc = Field("CRC", frame[-2:], GREY)
    if answer:
        return unit, function, Field("bytes", frame[2:3], PURPLE), Field(f"{NAME}: {VALUE}", frame[3:-2], GREEN), crc
    return unit, function, Field("address", frame[2:4], ORANGE), Field("registers", frame[4:-2], PURPLE), crc


def blocks() -> tuple[Block, ...]:
    """Return the blocks in the order of their addresses."""
    names = (
        ("constants", registers.CONSTANTS, GREY),
        ("telemetry of the axis", registers.TELEMETRY, BLUE),
        ("status of the supervisor", registers.SUPERVISOR, BLUE),
        ("counters of the link", registers.COUNTERS, GREY),
        ("pulses", registers.PULSES, ORANGE),
        ("words as written", registers.WRITTEN, ORANGE),
        ("words as active", registers.ACTIVE, BLUE),
        ("live words", registers.LIVE, ORANGE),
        ("window: the map", registers.MAP, YELLOW),
        ("window: the capture", registers.CAPTURE, YELLOW),
    )
    firsts = [first for _, first, _ in names]
    behind = {registers.LIVE: registers.END}
    ends = [behind.get(first, end) for first, end in zip(firsts, [*firsts[1:], registers.SPACE], strict=True)]
    return tuple(Block(name, first, end, tone) for (name, first, tone), end in zip(names, ends, strict=True))


def access(block: Block) -> str:
    """Return how the host may use the registers of a block."""
    every = RegisterMap(spec_of_scene()).registers
    kinds = {register.kind.access for register in every if block.first <= register.address < block.end}
    return kinds.pop() if kinds else "read"


def draw() -> str:
    """Return the diagram."""
    sheet = Sheet(448)
    request, answer = frames()
    _frame(sheet, 34, "host asks", fields(request, False))
    _frame(sheet, 112, "board answers", fields(answer, True))
    _byte(sheet, 176, request[3])
    for place, block in enumerate(blocks()):
        column, row = divmod(place, 5)
        at = Box(20 + 336 * column, 244 + 38 * row, 324, 34)
        sheet.box(at, tone=block.tone)
        sheet.text((at.left + 10, at.y), code(f"0x{block.first:04X}", SMALL), align="left")
        sheet.text((at.left + 72, at.y), block.name, align="left")
        sheet.text((at.right - 10, at.y), small(access(block)), align="right")
    return sheet.svg()


def _frame(sheet: Sheet, top: float, name: str, shown: tuple[Field, ...]) -> None:
    """Draw a frame: a box for each field, its bytes in it and its name above."""
    sheet.text((20, top + 18), bold(name), align="left")
    left = LEFT
    for field in shown:
        wide = BYTE * len(field.data)
        at = sheet.box(Box(left, top, wide, 36), code(field.data.hex(" ").upper()), tone=field.tone)
        sheet.text((at.x, top - 13), small(field.name))
        left += wide + 8


def _byte(sheet: Sheet, top: float, byte: int) -> None:
    """Draw a byte on the line: a start bit, the bits from the lowest on, and a stop bit."""
    bits = [0, *(byte >> k & 1 for k in range(8)), 1]
    names = ["start", *map(str, bits[1:-1]), "stop"]
    sheet.text((20, top + 16), bold("byte"), align="left")
    sheet.text((64, top + 16), code(f"{byte:02X}"), align="left")
    low, high, wide = top + 26, top + 6, 40
    path, left = [(LEFT - 30, high), (LEFT, high)], LEFT
    for bit, name in zip(bits, names, strict=True):
        level = high if bit else low
        path += [(left, level), (left + wide, level)]
        sheet.text((left + wide / 2, top + 40), small(name))
        left += wide
    sheet.wire(*path, (left + 16, high), ink=LINE, heads="-")
    sheet.text((left + 28, top + 16), small("lowest bit first"), align="left")
