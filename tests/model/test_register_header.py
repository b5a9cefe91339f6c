"""The C header: what it says of places and fields is so on the line, on the bus and in the words."""

import re

import pytest

from hardwall.model import register_header
from hardwall.model.axes.registers import AxesMap
from hardwall.model.axis import supervisor
from hardwall.model.axis.register_file import CELL_BITS, Design
from hardwall.model.axis.registers import CAPTURE, MAP, RegisterMap
from hardwall.model.estimators.registry import ESTIMATORS
from hardwall.model.link.axi import Response, Subordinate
from hardwall.model.register import Kind
from hardwall.model.register_texts import c_header
from stimuli.specs import SPECS, spec
from stimuli.supervised import supervised
from stimuli.supervised_axes_world import slow
from support.pages import text_of

REGISTERS = supervised("mhz")
HEADER = register_header.header(REGISTERS)
AXES = AxesMap(slow(3, "fdm"))
OF_AXES = register_header.header(AXES)
NUMBER = re.compile(r"^#define HARDWALL_(\w+) (0x[0-9A-F]+|\d+)$", re.M)
NUMBERS = {name: int(value, 0) for name, value in NUMBER.findall(HEADER)}


def test_no_name_is_defined_twice_and_the_guard_ends_last():
    for text in (HEADER, OF_AXES):
        defined = re.findall(r"^#define (\w+)", text, re.M)
        assert len(defined) == len(set(defined))
        assert text.count("#endif") == 1
        assert text.endswith("\n#endif\n")


def test_what_the_header_had_is_in_it():
    """Older programs find every name with its value."""
    assert {line for line in c_header(REGISTERS).splitlines() if line.startswith("#define")} <= set(HEADER.splitlines())


def test_an_older_name_is_the_address_for_modbus():
    for register in REGISTERS.registers:
        name = register.name.upper()
        assert NUMBERS[name] == NUMBERS[f"{name}_MODBUS"] == register.address
    assert (NUMBERS["MAP_MODBUS"], NUMBERS["CAPTURE_MODBUS"]) == (MAP, CAPTURE)


@pytest.mark.parametrize("register", REGISTERS.registers, ids=lambda register: register.name)
def test_a_load_and_a_store_at_the_offset_reach_the_register_on_the_bus(register):
    """A little-endian processor takes its bytes from the lanes of a word that its address says."""
    bus, name = Subordinate(Design(REGISTERS)), register.name.upper()
    offset, bits = NUMBERS[f"{name}_OFFSET"], NUMBERS[f"{name}_BITS"]
    lanes, lowest = ((1 << bits // 8) - 1) << offset % 4, 8 * (offset % 4)
    # Every cell has its own content, and of the status this one alone.
    bus.file.live = list(range(1, len(bus.file.live) + 1))
    bus.file.status[register.name] = register.high
    response, word = bus.read(offset)
    high, low = bus.file.live[register.address], bus.file.live[register.address + register.size - 1]
    expected = high << CELL_BITS | low if register.kind.wide else low
    assert (response, word >> lowest & (1 << bits) - 1) == (Response.OKAY, expected)
    if register.kind is Kind.STATUS:
        assert expected == register.high
    if register.kind is Kind.PULSE:
        assert bus.write(offset, 1 << lowest, lanes) == Response.OKAY
        assert bus.pulses == (register.name,)
    elif register.kind in (Kind.WORD, Kind.LIVE):
        assert bus.write(offset, register.high, lanes) == Response.OKAY
        assert bus.file.live[register.address : register.address + 2] == list(register.to_registers(register.high))
    else:
        assert bus.write(offset, 0, lanes) == Response.DECERR


RULE = re.compile(r"^\| (a [^|]*?) \| 2 · address(?: ([+-]) (\d))? \| (\d+) \|$", re.M)
RULES = {
    row: (int(f"{sign}{more or 0}"), int(bits))
    for row, sign, more, bits in RULE.findall(text_of("docs/reference/link.md"))
}
"""What the page says of a kind of register: the bytes beside twice its address, and the bits of a load or store."""
ROWS = (
    "a value of 32 bits",
    "a pulse or a counter at an even address",
    "a pulse or a counter at an odd address",
)


@pytest.mark.parametrize("name", SPECS)
@pytest.mark.parametrize("estimator", ESTIMATORS)
def test_the_rule_on_the_page_is_the_offset_of_every_register(name, estimator):
    assert set(RULES) == set(ROWS)
    registers, seen = supervised(name, estimator).registers, set()
    for register in registers:
        row = ROWS[0 if register.kind.wide else 1 + register.address % 2]
        more, bits = RULES[row]
        assert (2 * register.address + more, bits) == (register_header.offset_of(register), 16 * register.size)
        seen.add(row)
    assert seen == set(ROWS)


def test_a_store_at_twice_the_address_of_disarm_arms_as_the_page_warns():
    bus, place = Subordinate(Design(REGISTERS)), 2 * REGISTERS["disarm"].address
    assert place != NUMBERS["DISARM_OFFSET"]
    assert bus.write(place, 1 << 8 * (place % 4), 0b11 << place % 4) == Response.OKAY
    assert bus.pulses == ("arm",)


def test_every_bit_has_the_shift_of_its_mask():
    flags = [f"FLAG_{name}" for name in REGISTERS.spec.design.flags]
    record = [f"RECORD_FLAG_{name}" for name in REGISTERS.capture.flags]
    for name in (*flags, *record, *(f"CAUSE_{cause}" for cause in supervisor.names(supervisor.ALL))):
        assert NUMBERS[name.upper()] == 1 << NUMBERS[f"{name.upper()}_SHIFT"]
    assert NUMBERS["LATCHED_MASK"] == supervisor.ALL


def test_a_mask_of_a_register_has_all_bits_that_it_can_have():
    masks = {name.removesuffix("_MASK"): value for name, value in NUMBERS.items() if name.endswith("_MASK")}
    whole = {name: mask for name, mask in masks.items() if not name.startswith("COUNTS_")}
    bits = {"STATE": 2, "FLAGS": len(REGISTERS.spec.design.flags), "CAPTURE_STATE": 3}
    bits |= dict.fromkeys(("LATCHED", "FIRST"), len(supervisor.names(supervisor.ALL)))
    assert whole == {name: (1 << width) - 1 for name, width in bits.items()}


def test_the_fields_of_the_counts_are_a_number_of_each_cause():
    """The words are as the supervisor has them: four bits a cause, the first one lowest, eight to a word."""
    fields = re.findall(r"^#define HARDWALL_COUNTS_(\d)_(\w+)_MASK (0x[0-9A-F]+)$", HEADER, re.M)
    assert [name.lower() for _, name, _ in fields] == supervisor.names(supervisor.ALL)
    for place, (word, name, mask) in enumerate(fields):
        assert int(word) == place // 8
        assert int(mask, 16) == 0xF << NUMBERS[f"COUNTS_{word}_{name}_SHIFT"] == 0xF << 4 * (place % 8)
    assert {f"counts_{word}" for word, _, _ in fields} == {
        each.name for each in REGISTERS.status if each.name.startswith("counts_")
    }


def test_the_windows_and_a_record_are_found():
    """A window begins at twice its address. Register 6 of a record is the upper half of a word: its address is even."""
    assert NUMBERS["MAP_OFFSET"] == 0x8000
    assert (NUMBERS["CAPTURE_OFFSET"], NUMBERS["RECORD_BYTES"], NUMBERS["RECORD_FLAGS_OFFSET"]) == (0x10000, 16, 14)


def test_several_axes_have_no_bus():
    assert "_OFFSET" not in OF_AXES
    assert "#define HARDWALL_BANKS 3\n" in OF_AXES
    for register in AXES.registers:
        assert f"#define HARDWALL_{register.name.upper()}_MODBUS 0x{register.address:04X}\n" in OF_AXES


def test_the_fields_of_a_map_without_a_capture_memory_are_none_of_it():
    text = register_header.header(RegisterMap(spec("mhz"), 0))
    assert "HARDWALL_RECORD" not in text
    assert "CAPTURE_SOURCE" not in text
