"""All registers of a board as a page shows them: grouped as the map groups them, and what their words say."""

from collections.abc import Mapping
from html import escape
from typing import Any, NamedTuple

from ...model.axis.capture import STATES
from ...model.axis.registers import ACTIVE, CONSTANTS, COUNTERS, LIVE, PULSES, SUPERVISOR, TELEMETRY, WRITTEN
from ...model.axis.supervisor import names
from ...model.register import Kind, Register
from ..device import Device
from ..status import State, flag_names

BLOCKS = (
    (LIVE, "Live words", "They act at the next clock."),
    (ACTIVE, "Words in use", "What the axis uses of the words, since their last commit."),
    (WRITTEN, "Words as written", "They act when they are committed."),
    (PULSES, "Pulses", "A pulse has no value. No pulse is given from here."),
    (COUNTERS, "Counters of the link", "They begin again at 0 after 65535."),
    (SUPERVISOR, "Supervisor and capture memory", "What watches over the axis, and what records it."),
    (TELEMETRY, "Telemetry of the axis", "What the axis measures and drives."),
    (CONSTANTS, "Constants", "What the device is."),
)
"""First address, heading and meaning of every block of the map, the last one first."""
CAUSES = ("latched", "first", "acknowledged", "supervisor_causes", "active_supervisor_causes")
"""Registers with a bit for every cause."""
DIGITS = "%.10g"
"""How an SI value is written: with all digits of a word of 32 bits."""


class Block(NamedTuple):
    """Adjacent registers of the map: a heading, a description, and the registers."""

    heading: str
    about: str
    registers: tuple[Register, ...]


def blocks_of(device: Device) -> tuple[Block, ...]:
    """Return all registers of a device in the order of their addresses, by the blocks of the map."""
    registers = sorted((*device.constants, *device.registers.values()), key=lambda each: each.address)
    found: dict[int, list[Register]] = {}
    for each in registers:
        found.setdefault(next(first for first, *_ in BLOCKS if each.address >= first), []).append(each)
    return tuple(Block(heading, about, tuple(found[first])) for first, heading, about in BLOCKS[::-1] if first in found)


def said(register: Register, word: int) -> str:
    """Return what a word of a register says: its SI value with the unit, or the names of its bits or of its choice."""
    name = register.name
    if name == "state" and word in list(State):
        return State(word).name
    if name == "capture_state" and word < len(STATES):
        return STATES[word]
    if name in CAUSES:
        return ", ".join(names(word)) or "none"
    if name == "flags":
        flags = flag_names(register.format.width)
        return ", ".join(flag for bit, flag in enumerate(flags) if word >> bit & 1) or "none"
    return f"{DIGITS % (word * register.lsb)} {register.unit}".rstrip()


def raw(register: Register, word: int) -> str:
    """Return a word as a number, and as its registers have it."""
    digits = 4 * register.size
    return f"{word} = 0x{word & (1 << 4 * digits) - 1:0{digits}X}"


def ranged(register: Register) -> str:
    """Return the range of a register in SI units."""
    low, high = (f"{value * register.lsb:.6g}" for value in (register.low, register.high))
    return f"{low} to {high} {register.unit}".rstrip()


def told(device: Device, words: Mapping[str, int]) -> dict[str, list[str]]:
    """Return a tab's texts for words: by the names of registers, the meaning of each, and the word itself."""
    registers = {each.name: each for each in (*device.constants, *device.registers.values())}
    return {name: [said(registers[name], word), raw(registers[name], word)] for name, word in words.items()}


def markup(device: Device) -> str:
    """Return the tree as HTML, without values: a part to open for every block, and an item for every register."""
    return "".join(_block(block) for block in blocks_of(device))


def _block(block: Block) -> str:
    items = "".join(map(_item, block.registers))
    count = f'<span class="count">{len(block.registers)}</span>'
    about = f"<p>{escape(block.about)}</p>"
    return (
        f'<details class="branch"><summary>{escape(block.heading)} {count}</summary>{about}<ul>{items}</ul></details>'
    )


def _item(register: Register) -> str:
    is_pulse = register.kind is Kind.PULSE
    parts: list[tuple[str, Any]] = [
        ("name", escape(register.name)),
        ("value", "" if is_pulse else "not read yet"),
        ("word", ""),
        ("range", "" if is_pulse or register.kind is Kind.CONSTANT else f"range {escape(ranged(register))}"),
        ("address", f"at 0x{register.address:04X}"),
    ]
    spans = "".join(f'<span class="{part}">{text}</span>' for part, text in parts)
    return f'<li data-register="{escape(register.name)}">{spans}</li>'
