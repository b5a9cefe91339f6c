"""What a device says of itself: its registers as they were described, and errors for what is none of ours."""

import dataclasses
import zlib

import pytest

from hardwall.host.connect import connect
from hardwall.host.errors import ChangedError, ForeignError
from hardwall.model.axis.registers import MAP
from hardwall.model.register import Kind


def test_the_constants_are_those_of_the_map(axis, registers):
    expected = [each for each in registers.registers if each.kind is Kind.CONSTANT]
    found = axis.device.constants
    assert [(each.address, each.name, each.unit) for each in found] == [
        (each.address, each.name, each.unit) for each in expected
    ]
    assert [axis.read_registers(each.address, 2) for each in found] == [
        each.to_registers(each.reset) for each in expected
    ]
    several = dataclasses.replace(axis.device, axes=2).constants
    assert [each.name for each in several] == [*(each.name for each in expected), "axes"]


def carry(board, compressed: bytes) -> None:
    """Let a board carry another map."""
    cells = board.server.file.design.map_cells
    text = compressed + b"\0" * (len(compressed) % 2)
    cells[: len(text) // 2] = [int.from_bytes(text[k : k + 2], "big") for k in range(0, len(text), 2)]
    board.server.file.live[9] = len(compressed)


def test_a_device_has_the_registers_of_its_map(axis, registers):
    device = axis.device
    assert (device.identity, device.clock_hz) == (registers.identity, registers.spec.clock_hz)
    expected = [each for each in registers.registers if each.kind is not Kind.CONSTANT]
    assert list(device.registers) == [each.name for each in expected]
    for each in expected:
        found = device.registers[each.name]
        assert (found.address, found.kind, found.size, found.unit) == (each.address, each.kind, each.size, each.unit)
        assert (found.low, found.high, found.reset) == (each.low, each.high, each.reset)
        assert (found.lsb, found.format.signed) == (each.lsb, each.format.signed)
        for word in (each.low, each.high):
            assert found.from_registers(found.to_registers(word)) == word


def test_another_identity_than_the_wanted_is_refused(board, registers):
    with pytest.raises(ChangedError, match=f"is {registers.identity}, not 0123456789abcdef: it has another bitstream"):
        connect(board.name, identity="0123456789abcdef")
    connect(board.name, identity=registers.identity).close()


def test_another_layout_is_refused(board):
    board.server.file.live[1] = 2
    with pytest.raises(ForeignError, match="has the register layout 2; this hardwall knows 1"):
        connect(board.name)


def test_another_vendor_is_refused(board, monkeypatch):
    design = board.server.file.design
    identification = {
        key: end.replace(b"hardwall", b"softwall") for key, end in design.registers.identification.items()
    }
    monkeypatch.setattr(type(design.registers), "identification", identification)
    with pytest.raises(ForeignError, match="is 'softwall', not a hardwall board"):
        connect(board.name)


@pytest.mark.parametrize(
    "spoil",
    [
        lambda text: text[:-40],
        lambda text: b"no zlib at all",
        lambda text: zlib.compress(b"no JSON"),
        lambda text: zlib.compress(b"[1]"),
        lambda text: zlib.compress(b'{"identity": 3}'),
        lambda text: zlib.compress(zlib.decompress(text).replace(b'"word"', b'"what"')),
        lambda text: zlib.compress(zlib.decompress(text).replace(b",18,0.001,", b",99,0.001,")),
        lambda text: zlib.compress(zlib.decompress(text).replace(b"si_per_lsb", b"lsb_per_si")),
        lambda text: zlib.compress(zlib.decompress(text).replace(b'"identity":"', b'"identity":"0')),
        lambda text: zlib.compress(b"[" * 300_000, 9),
        lambda text: zlib.compress(b"[" * 200_000, 9),
    ],
)
def test_a_map_that_cannot_be_read_is_an_error(board, registers, spoil):
    spoilt = spoil(registers.compressed)
    assert spoilt != zlib.compress(zlib.decompress(registers.compressed))
    carry(board, spoilt)
    with pytest.raises(ForeignError, match=r"the map of the device at tcp:.* cannot be read: "):
        connect(board.name)


@pytest.mark.parametrize("size", [0, 0xFFFFFFFF])
def test_a_map_of_no_possible_length_is_an_error(board, size):
    board.server.file.live[8:10] = [size >> 16, size & 0xFFFF]
    with pytest.raises(ForeignError, match=f"must have 1 to {2 * (0x10000 - MAP)} bytes, not {size}"):
        connect(board.name)
