"""All registers as a page shows them: none is left out, and each says its word, its SI value, range and address."""

import re

import pytest

from hardwall.host.connect import connect
from hardwall.host.device import Device
from hardwall.host.panel.register_tree import blocks_of, markup, ranged, raw, said, told
from hardwall.model.axis.supervisor import ARMED
from hardwall.model.register import Kind


@pytest.fixture
def device(board) -> Device:
    with connect(board.name, answer_s=2.0) as axis:
        return axis.device


def test_every_register_of_the_map_is_in_the_tree_once_in_the_order_of_addresses(device, registers):
    shown = [each for block in blocks_of(device) for each in block.registers]
    assert [(each.address, each.name) for each in shown] == [(each.address, each.name) for each in registers.registers]
    assert [each.unit for each in shown] == [each.unit for each in registers.registers]
    assert re.findall(r'data-register="(\w+)"', markup(device)) == [each.name for each in registers.registers]


def test_a_block_has_one_kind_of_registers_and_its_heading(device):
    kinds = {block.heading: {each.kind for each in block.registers} for block in blocks_of(device)}
    assert kinds == {
        "Constants": {Kind.CONSTANT},
        "Telemetry of the axis": {Kind.STATUS},
        "Supervisor and capture memory": {Kind.STATUS},
        "Counters of the link": {Kind.COUNTER},
        "Pulses": {Kind.PULSE},
        "Words as written": {Kind.WORD},
        "Words in use": {Kind.ACTIVE},
        "Live words": {Kind.LIVE},
    }


@pytest.mark.parametrize(
    ("name", "word", "says", "as_word"),
    [
        ("count", -3, "-3e-06 m", "-3 = 0xFFFFFFFD"),
        ("clock_hz", 50_000_000, "50000000 Hz", "50000000 = 0x02FAF080"),
        ("state", ARMED, "ARMED", "1 = 0x00000001"),
        ("state", 3, "3", "3 = 0x00000003"),
        ("capture_state", 2, "WAITING", "2 = 0x00000002"),
        ("latched", 1 << 13, "emergency_stop", "8192 = 0x00002000"),
        ("latched", 0, "none", "0 = 0x00000000"),
        ("flags", 1, "encoder_illegal", "1 = 0x00000001"),
        ("flags", 0, "none", "0 = 0x00000000"),
        ("link_errors", 65535, "65535", "65535 = 0xFFFF"),
    ],
)
def test_a_word_says_its_si_value_or_its_names(device, registers, name, word, says, as_word):
    assert said(registers[name], word) == says
    assert raw(registers[name], word) == as_word
    assert told(device, {name: word}) == {name: [says, as_word]}


def test_a_range_is_in_si_units(registers):
    word = registers["wall_stiffness"]
    assert ranged(word) == f"0 to {word.high * word.lsb:.6g} N/m"


def test_a_pulse_has_neither_a_value_nor_a_control(device):
    item = re.search(r'<li data-register="arm">.*?</li>', markup(device))[0]
    assert '<span class="value"></span>' in item
    assert "at 0x007" in item
    assert not re.search(r"<(button|input|select|a)\b", markup(device))
